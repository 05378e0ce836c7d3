// What the page does beyond showing: filter, copy, and ways to look at two pictures. Without this
// script all of the text and all pictures are there.
'use strict';
(() => {
  const all = (root, what) => Array.from(root.querySelectorAll(what));
  const make = (tag, settings = {}, ...children) => {
    const element = Object.assign(document.createElement(tag), settings);
    element.append(...children);
    return element;
  };

  // ---- Filter: words and outcomes; kept in the address, so that it can be sent to others
  const form = document.querySelector('.filter');
  const items = all(document, '[data-outcome]');
  const count = form.querySelector('output');
  const show = () => {
    const words = form.elements.words.value.toLowerCase().split(/\s+/).filter(Boolean);
    const outcomes = new Set(all(form, '[name=outcome]:checked').map((box) => box.value));
    let shown = 0;
    for (const item of items) {
      const fits = outcomes.has(item.dataset.outcome) &&
          words.every((word) => item.dataset.words.includes(word));
      item.hidden = !fits;
      if (fits && item.tagName === 'TR') ++shown;
    }
    count.textContent = `${shown} of ${items.filter((item) => item.tagName === 'TR').length} cases`;
  };
  form.hidden = false;
  form.addEventListener('input', show);
  form.addEventListener('submit', (event) => event.preventDefault());
  show();

  // ---- Lines to copy
  for (const line of all(document, '.copy')) {
    const button = make('button', {type: 'button', textContent: 'Copy'});
    button.addEventListener('click', async () => {
      const text = line.querySelector('code').textContent;
      try {
        await navigator.clipboard.writeText(text);
        button.textContent = 'Copied';
      } catch {  // of a file the browser may refuse it: select the text instead
        getSelection().selectAllChildren(line.querySelector('code'));
        button.textContent = 'Selected';
      }
    });
    line.append(button);
  }

  // ---- Pictures
  const copyOf = (image) => make('img', {src: image.src, alt: image.alt});
  const label = (text, control) => make('label', {}, text + ' ', control);
  const enhance = (figure) => {
    const views = figure.querySelector('.views');
    const accepted = views.querySelector('.accepted img');
    const tonight = views.querySelector('.tonight img');
    if (!accepted || !tonight) return;
    const tools = make('div', {className: 'tools'});

    const sliderStack = make('div', {className: 'stack'}, copyOf(accepted), copyOf(tonight));
    const slider = make('input', {type: 'range', min: 0, max: 100, value: 50, step: 1});
    slider.setAttribute('aria-label', 'left of it the accepted frame, right of it tonight’s');
    const cut = () => { sliderStack.lastChild.style.clipPath = `inset(0 0 0 ${slider.value}%)`; };
    slider.addEventListener('input', cut);
    sliderStack.addEventListener('pointermove', (event) => {
      if (!event.buttons) return;
      const box = sliderStack.getBoundingClientRect();
      slider.value = 100 * (event.clientX - box.left) / box.width;
      cut();
    });
    views.append(make('div', {className: 'view slider'},
        make('div', {className: 'scroll'}, sliderStack), slider));

    const blend = make('div', {className: 'stack'}, copyOf(accepted), copyOf(tonight));
    views.append(make('div', {className: 'view difference'},
        make('div', {className: 'scroll'}, blend)));

    const mode = make('select', {name: 'mode'}, ...[['side', 'side by side'], ['slider', 'slider'],
      ['flip', 'flip (key F)'], ['difference', 'difference']].map(
        ([value, text]) => make('option', {value, textContent: text})));
    const gain = make('input', {type: 'range', name: 'gain', min: 0, max: 7, step: 1, value: 4});
    const gainText = make('output');
    const gainLabel = label('gain', gain);
    gainLabel.append(gainText);
    const zoom = make('input', {type: 'range', name: 'zoom', min: 1, max: 12, step: 1, value: 1});
    const stops = make('select', {name: 'stops'}, ...[['', '0'], ['m2', '−2'], ['p2', '+2']].map(
        ([value, text]) => make('option', {value, textContent: text})));

    const update = () => {
      figure.dataset.mode = mode.value;
      gainLabel.hidden = mode.value !== 'difference';
      gainText.textContent = ` × ${2 ** gain.value}`;
      blend.style.filter = `brightness(${2 ** gain.value})`;
      const size = accepted.naturalWidth * zoom.value;
      for (const image of all(views, 'img')) {
        const source = image.alt === 'accepted' ? 'accepted' : image.alt === 'tonight' ? 'tonight' : '';
        const key = source + (stops.value === 'm2' ? 'Under' : stops.value === 'p2' ? 'Over' : '');
        if (source && figure.dataset[key]) image.src = figure.dataset[key];
        if (size) image.style.width = `${size}px`;
      }
    };
    const flip = () => {
      mode.value = 'flip';
      figure.dataset.shown = figure.dataset.shown === 'accepted' ? 'tonight' : 'accepted';
      update();
    };
    figure.dataset.accepted = accepted.src;
    figure.dataset.tonight = tonight.src;
    for (const control of [mode, gain, zoom, stops]) control.addEventListener('input', update);
    const flipButton = make('button', {type: 'button', textContent: 'Flip'});
    flipButton.addEventListener('click', flip);
    figure.addEventListener('keydown', (event) => {
      if (event.key === 'f' || event.key === 'F') flip();
    });
    // Zoomed pictures move together
    const scrolls = all(views, '.scroll');
    for (const one of scrolls)
      one.addEventListener('scroll', () => {
        for (const other of scrolls)
          if (other !== one) [other.scrollLeft, other.scrollTop] = [one.scrollLeft, one.scrollTop];
      });
    tools.append(label('view', mode), flipButton, gainLabel, label('zoom', zoom));
    if (figure.dataset.acceptedUnder) tools.append(label('stops', stops));
    views.before(tools);
    figure.tabIndex = 0;
    cut();
    update();
    accepted.addEventListener('load', update, {once: true});
  };
  const near = new IntersectionObserver((entries) => {
    for (const entry of entries)
      if (entry.isIntersecting) {
        near.unobserve(entry.target);
        enhance(entry.target);
      }
  }, {rootMargin: '600px'});
  for (const figure of all(document, 'figure.frame')) near.observe(figure);
})();

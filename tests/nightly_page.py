#!/usr/bin/env python3
"""Opens pages of `catoptric nightly` in headless Chromium and uses them: by mouse and keyboard, without JavaScript,
under a strict Content-Security-Policy, in the dark and in the light.

    tests/nightly_page.py out/page --make build/release/bin/nightly_test [--chromium chromium] [--shots FOLDER]

By default only the page in a folder is used in the light too; CATOPTRIC_LONG=1 uses all of them in both.
--make writes folder/ and single/ into the folder first: the page of 2,000 cases of page_test.cpp. Exit 1 and a line for
each fault; 77 where there is no Chromium."""

import argparse
import functools
import http.server
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading
import time

POLICY = ("default-src 'none'; img-src 'self'; style-src 'self'; script-src 'self'; base-uri 'none'; "
          "form-action 'none'; frame-ancestors 'none'")
MOST_SECONDS = 3.0  # of the processors, by all of Chromium, until a page of 2,000 cases with 200 failures can be used
MOST_BYTES = 10_000_000  # of a single file
LONG = os.environ.get("CATOPTRIC_LONG") == "1"
OPENINGS = 4  # of which one has to be quick enough: other programs may disturb the others


class Browser:
    """Chromium, spoken to by its debugging pipe: JSON with a zero byte at its end."""

    def __init__(self, program: str, profile: str):
        to_browser, self.write = os.pipe()
        self.read, from_browser = os.pipe()

        def places():
            os.dup2(to_browser, 103)
            os.dup2(from_browser, 104)
            os.dup2(103, 3)
            os.dup2(104, 4)

        self.process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
             "--disable-background-networking", "--disable-component-update", "--no-first-run",
             "--remote-debugging-pipe", f"--user-data-dir={profile}", "--allow-file-access-from-files=false",
             "about:blank"], preexec_fn=places, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.number = 0
        self.rest = b""
        self.events = []

    def message(self):
        while b"\0" not in self.rest:
            more = os.read(self.read, 1 << 20)
            if not more:
                raise RuntimeError("the browser has ended")
            self.rest += more
        text, self.rest = self.rest.split(b"\0", 1)
        return json.loads(text)

    def call(self, method, session=None, **parameters):
        self.number += 1
        order = {"id": self.number, "method": method, "params": parameters}
        if session:
            order["sessionId"] = session
        text = json.dumps(order).encode() + b"\0"
        while text:
            text = text[os.write(self.write, text):]
        while True:
            answer = self.message()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def close(self):
        self.process.terminate()
        self.process.wait()


    def ticks(self):
        """What each of its processes has taken of the processors: other programs do not count."""
        children, ticks = {}, {}
        for file in pathlib.Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = file.read_text().rsplit(")", 1)[1].split()
            except OSError:
                continue  # has ended
            children.setdefault(int(fields[1]), []).append(int(file.parent.name))
            ticks[int(file.parent.name)] = int(fields[11]) + int(fields[12])
        mine = [self.process.pid]
        for process in mine:
            mine += children.get(process, [])
        return {process: ticks.get(process, 0) for process in mine}


class Page:
    def __init__(self, browser: Browser, url: str, script=True, dark=False):
        self.browser = browser
        target = browser.call("Target.createTarget", url="about:blank")["targetId"]
        self.target = target
        self.session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=1280, height=1400, deviceScaleFactor=1, mobile=False)
        self.call("Emulation.setScriptExecutionDisabled", value=not script)
        self.call("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        browser.events.clear()
        before = browser.ticks()
        self.call("Page.navigate", url=url)
        while not any(e.get("method") == "Page.loadEventFired" for e in browser.events):
            browser.events.append(browser.message())
        if script:  # painted, and answering
            self.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        # A closed page's process may end meanwhile
        taken = sum(ticks - before.get(process, 0) for process, ticks in browser.ticks().items())
        self.seconds = taken / os.sysconf("SC_CLK_TCK")

    def call(self, method, **parameters):
        return self.browser.call(method, session=self.session, **parameters)

    def evaluate(self, expression: str):
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def key(self, key: str, text: str = "", code: int = 0):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code,
                      **({"text": text} if text and kind == "keyDown" else {}))

    def complaints(self):
        """What the console says, refused by the policy or not."""
        return [e["params"].get("entry", e["params"]).get("text", "") for e in self.browser.events
                if e.get("method") in ("Log.entryAdded", "Runtime.exceptionThrown")]

    def shot(self, file: pathlib.Path):
        import base64
        file.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def close(self):
        self.browser.call("Target.closeTarget", targetId=self.target)


class Strict(http.server.SimpleHTTPRequestHandler):
    def end_headers(self):
        self.send_header("Content-Security-Policy", POLICY)
        super().end_headers()

    def log_message(self, *_):
        pass


def use(page: Page, expect):
    """The filter, the slider, the difference, the zoom and the keyboard of a page with its script."""
    expect(page.evaluate("document.querySelector('.filter').hidden") is False, "the filter is there")
    shown = "document.querySelectorAll('article:not([hidden])').length"
    rows = "document.querySelectorAll('tr[data-outcome]:not([hidden])').length"
    expect(page.evaluate(shown) == 200 and page.evaluate(rows) == 2000, "everything is shown at first")
    page.evaluate("document.querySelector('[name=words]').focus()")
    for letter in "scene_7.":
        page.key(letter, letter)
    expect(page.evaluate(shown) == 10 and page.evaluate(rows) == 10, "typing in the filter chooses cases")
    expect("10 of 2000" in page.evaluate("document.querySelector('.filter output').textContent"), "it says how many")
    page.evaluate("document.querySelector('[name=words]').value = ''")
    page.evaluate("document.querySelector('[value=regression]').click()")
    expect(page.evaluate(shown) == 0 and page.evaluate(rows) == 1800, "a box of the filter chooses outcomes")
    page.evaluate("document.querySelector('[value=regression]').click()")

    first = "document.querySelector('figure.frame')"
    page.evaluate(f"{first}.scrollIntoView()")
    for _ in range(50):
        if page.evaluate(f"!!{first}.querySelector('[name=mode]') && {first}.querySelector('img').naturalWidth > 0"):
            break
        time.sleep(0.1)
    choose = (lambda name, value: page.evaluate(
        f"(() => {{ const one = {first}.querySelector('[name={name}]'); one.value = '{value}'; "
        "one.dispatchEvent(new Event('input', {bubbles: true})); })()"))
    visible = (lambda what: page.evaluate(
        f"getComputedStyle({first}.querySelector('{what}')).display") != "none")
    choose("mode", "slider")
    expect(visible(".view.slider") and not visible(".view.accepted"), "the slider is shown alone")
    page.evaluate(f"{first}.querySelector('.slider input').focus()")
    before = page.evaluate(f"{first}.querySelector('.slider .stack').lastChild.style.clipPath")
    for _ in range(20):
        page.key("ArrowRight", code=39)
    after = page.evaluate(f"{first}.querySelector('.slider .stack').lastChild.style.clipPath")
    expect("50%" in before and "70%" in after, f"arrows move the slider: {before} -> {after}")
    choose("mode", "difference")
    choose("gain", "6")
    expect(visible(".view.difference"), "the difference is shown")
    expect(page.evaluate(f"{first}.querySelector('.difference .stack').style.filter") == "brightness(64)", "gain")
    choose("mode", "flip")
    page.evaluate(f"{first}.focus()")
    seen = []
    for _ in range(2):
        page.key("f", "f")
        seen.append((visible(".view.accepted"), visible(".view.tonight")))
    expect(sorted(seen) == [(False, True), (True, False)], f"the key F flips: {seen}")
    choose("zoom", "3")
    expect(page.evaluate(f"{first}.querySelector('.tonight img').getBoundingClientRect().width") >= 300, "zoom")
    choose("mode", "side")
    choose("zoom", "12")
    page.evaluate(f"{first}.querySelector('.accepted .scroll').scrollLeft = 120")
    time.sleep(0.3)
    expect(page.evaluate(f"{first}.querySelector('.tonight .scroll').scrollLeft") == 120, "zoomed pictures move together")
    choose("zoom", "2")
    if page.evaluate(f"!!{first}.querySelector('[name=stops]')"):
        choose("stops", "p2")
        expect("over" in page.evaluate(f"{first}.querySelector('.tonight img').src"), "exposure")
        choose("stops", "")
    # Everything can be reached by the keyboard
    page.evaluate("document.activeElement.blur(); scrollTo(0, 0)")
    reached = set()
    for _ in range(40):
        page.key("Tab", code=9)
        reached.add(page.evaluate("document.activeElement.tagName + '.' + document.activeElement.className"))
    kinds = {name.split(".")[0] for name in reached}
    expect({"A", "INPUT", "BUTTON", "FIGURE", "SELECT"} <= kinds, f"the keyboard reaches {sorted(kinds)}")


def opened(browser: Browser, url: str, dark: bool) -> Page:
    page = Page(browser, url, dark=dark)
    for _ in range(OPENINGS - 1):
        if page.seconds < MOST_SECONDS:
            break
        page.close()
        page = Page(browser, url, dark=dark)
    return page


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--chromium", default="chromium")
    parser.add_argument("--make", metavar="NIGHTLY_TEST")
    parser.add_argument("--shots", type=pathlib.Path)
    options = parser.parse_args()
    if not shutil.which(options.chromium):
        print(f"skipped: there is no {options.chromium}")
        return 77
    if options.make:
        subprocess.run([options.make, "--gtest_filter=LargePage.*"], check=True, stdout=subprocess.DEVNULL,
                       env=dict(os.environ, NIGHTLY_PAGE=str(options.folder.resolve())))
    faults = []

    def expect(condition, what):
        if not condition:
            faults.append(what)
            print("FAILED:", what)

    def shot(page, name):
        if options.shots:
            options.shots.mkdir(parents=True, exist_ok=True)
            page.shot(options.shots / f"{name}.png")

    folder = options.folder.resolve()
    expect((folder / "single/index.html").stat().st_size <= MOST_BYTES, f"a single file has at most {MOST_BYTES} bytes")
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Strict, directory=folder / "folder"))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    places = {"folder": f"file://{folder}/folder/index.html", "single": f"file://{folder}/single/index.html",
              "strict": f"http://127.0.0.1:{server.server_port}/index.html"}
    # The browser's own children may still write into its profile for a moment after it has ended.
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(options.chromium, profile)
        try:
            Page(browser, "about:blank").close()
            for name, url in places.items():
                for dark in (False, True) if name == "folder" or LONG else (True,):
                    page = opened(browser, url, dark)
                    print(f"{name}, {'dark' if dark else 'light'}: opened in {page.seconds:.2f} s")
                    expect(page.seconds < MOST_SECONDS, f"{name}: opens in {MOST_SECONDS} s")
                    shot(page, f"{name}_{'dark' if dark else 'light'}_top")
                    use(page, lambda condition, what, name=name: expect(condition, f"{name}: {what}"))
                    page.evaluate("document.querySelector('figure.frame').scrollIntoView()")
                    time.sleep(0.5)
                    shot(page, f"{name}_{'dark' if dark else 'light'}_figure")
                    complaints = [text for text in page.complaints() if "favicon" not in text and "404" not in text]
                    expect(not complaints, f"{name}: the console is silent: {complaints[:3]}")
                    page.close()
            page = Page(browser, places["folder"], script=False)
            shot(page, "no_script")
            tree = {node.get("role", {}).get("value") for node in
                    page.call("Accessibility.getFullAXTree", depth=12)["nodes"]}
            expect({"heading", "link", "table", "image"} <= tree, f"without a script it can be read: {sorted(map(str, tree))}")
            expect("searchbox" not in tree, "without a script there is no filter, which could do nothing")
            page.close()
        finally:
            browser.close()
    print("ok" if not faults else f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

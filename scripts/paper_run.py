"""Runs of catoptric for scripts/paper_tables, and the document that its tables go to."""
import csv
import itertools
import json
import math
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import time

NOT_RENDERING = {"waiting", "extras", "check"}  # kinds of steps: for the writers, or of asked-for extras


class Frames:
    """One method's frames of one or several processes: steps in seconds and counters, by frame. Of a frame
    rendered several times each step counts at its least: what else ran on the machine only adds."""

    def __init__(self):
        self.steps = {}
        self.kinds = {}
        self.counters = {}

    def add(self, folder, skip):
        added = {}
        self.kinds.update(json.loads((folder / "summary.json").read_text())["step_kinds"])
        with open(folder / "timings.csv", newline="") as file:
            for row in csv.DictReader(file):
                number = int(row["frame"])
                if number in (0, *skip) or row["clock"] == "overlapped":
                    continue
                steps = added.setdefault(number, {})
                steps[row["step"]] = steps.get(row["step"], 0.0) + float(row["seconds"])
        for number, steps in added.items():
            known = self.steps.setdefault(number, steps)
            for step, seconds in steps.items():
                known[step] = min(known[step], seconds)
        for line in (folder / "frames.jsonl").read_text().splitlines():
            record = json.loads(line)
            if record["frame"] not in skip:
                self.counters[record["frame"]] = record["counters"]

    def times(self, without=()):
        """Milliseconds of rendering by frame, without some steps."""
        return {n: 1e3 * sum(s for step, s in steps.items()
                             if self.kinds.get(step) not in NOT_RENDERING and step not in without)
                for n, steps in self.steps.items()}

    def ms(self, without=()):
        return statistics.median(self.times(without).values())

    def step(self, name):
        """Milliseconds of a step by frame."""
        return [1e3 * steps.get(name, 0.0) for steps in self.steps.values()]

    def count(self, name):
        return [counters.get(name, 0) for counters in self.counters.values()]

    def ratio(self, other):
        """Median over frames of `other`'s time over ours."""
        ours, theirs = self.times(), other.times()
        return statistics.median(theirs[n] / ours[n] for n in ours)


class Bench:
    """Runs catoptric; `effort` (full, quick, smoke) says how many frames of a path count."""

    def __init__(self, build, work, effort):
        self.program = pathlib.Path(build, "bin", "catoptric").resolve()
        self.work = work
        self.effort = effort
        self.started = time.monotonic()
        self.growth = {}  # time by quantity: (values, milliseconds)

    def catoptric(self, *command, check=True):
        done = subprocess.run([self.program, *map(str, command)], capture_output=True, text=True)
        if check and done.returncode != 0:
            raise SystemExit(f"paper_tables: catoptric {' '.join(map(str, command))}: exit "
                             f"{done.returncode}: {done.stderr.strip()}")
        return done.stdout

    def path_frames(self, full=30, quick=90):
        """Frames of a path that count, in parts: ([two that warm up], [those that count]). The first
        ones of a process compile programs and load the module that writes images."""
        if self.effort == "smoke":
            return [([449], [450]), ([899], [900])]
        step = full if self.effort == "full" else quick
        numbers = list(range(step // 2, 901, step))
        parts = max(1, min(len(numbers) // 5, 3))
        return [([numbers[i] - 2, numbers[i] - 1], numbers[i::parts]) for i in range(parts)]

    def one_part(self):
        """The first part alone where time is short, for what needs many runs."""
        return self.path_frames()[:1] if self.effort != "full" else None

    def render(self, config, name, settings=(), parts=None, methods=None, repeats=1):
        """Renders a config of configs/papers/, `repeats` times for times; Frames by method's name."""
        file = f"configs/papers/{config}.json"
        methods = methods or [m if isinstance(m, str) else m.get("name", m["method"])
                              for m in json.loads(pathlib.Path(file).read_text())["methods"]]
        runs = {method: Frames() for method in methods}
        parts = parts or self.path_frames()
        repeats = 1 if self.effort == "smoke" else repeats
        for i, k in itertools.product(range(len(parts)), range(repeats)):
            warm, numbers = parts[i]
            out = self.work / name / str(i)
            shutil.rmtree(out, ignore_errors=True)
            command = ["render", file, "--out", out, "-q", "--frames",
                       ",".join(map(str, [*warm, *numbers]))]
            for method in reversed(methods) if (i + k) % 2 else methods:
                command += ["--method", method]
            for setting in (*settings, "errors.against=[]", "image.compression=none"):
                command += ["--set", setting]
            print(f"{time.monotonic() - self.started:6.0f} s  {name} {i + 1}", file=sys.stderr)
            self.catoptric(*command)
            for method in methods:
                runs[method].add(out if len(methods) == 1 else out / method, warm)
        return runs

    def errors(self, name, method, reference):
        """Errors of a rendered config's method against another: by frame, and L1_8bit by object id
        as (pixels, mean), where the layer id was asked for."""
        frames, objects = [], {}
        for out in sorted((self.work / name).iterdir()):
            result = json.loads(self.catoptric("compare", out / method, out / reference,
                                               "--json"))[0]
            frames += result["frames"]
            for part in result["pooled"]["objects"]:
                pixels, mean = objects.get(part["id"], (0, 0.0))
                whole = pixels + part["pixels"]
                mean += (part["L1_8bit"] - mean) * part["pixels"] / whole
                objects[part["id"]] = (whole, mean)
        return frames, objects


def exponent(xs, ys):
    """Slope of log y over log x, by least squares."""
    return slope([math.log(x) for x in xs], [math.log(y) for y in ys])


def slope(xs, ys):
    """Slope of y over x, by least squares."""
    x0, y0 = statistics.fmean(xs), statistics.fmean(ys)
    return (sum((x - x0) * (y - y0) for x, y in zip(xs, ys))
            / sum((x - x0) ** 2 for x in xs))


def number(value, digits=3):
    """With about three significant digits."""
    if value is None:
        return ""
    if value == 0 or not math.isfinite(value):
        return f"{value:.0f}"
    return f"{value:.{max(0, digits - 1 - math.floor(math.log10(abs(value))))}f}"


def preview(frame):
    """The PNG beside a frame, as an image of PIL."""
    from PIL import Image
    return Image.open(str(frame).replace("/frames/", "/previews/").replace(".exr", ".png"))


def sheet(file, rows, labels, width=256):
    """Rows of panels, `width` pixels wide, with a label above each column."""
    from PIL import Image, ImageDraw, ImageFont
    bar, gap = 22, 4
    height = round(width * rows[0][0].height / rows[0][0].width)
    out = Image.new("RGB", (len(labels) * (width + gap) - gap,
                            bar + len(rows) * (height + gap) - gap), "white")
    font = ImageFont.truetype("DejaVuSans.ttf", 13)
    for i, label in enumerate(labels):
        ImageDraw.Draw(out).text((i * (width + gap) + 4, 3), label, "black", font)
        for j, row in enumerate(rows):
            out.paste(row[i].convert("RGB").resize((width, height), Image.LANCZOS),
                      (i * (width + gap), bar + j * (height + gap)))
    out.save(file, optimize=True)


def sections(text):
    """Parts of a page by name, with their marks; "": what stands before the first one."""
    marks = [("", 0), *((m[1], m.start()) for m in re.finditer(r"^<!-- part (\w+) -->$", text, re.M)), (None, len(text))]
    return {name: text[begin:end] for (name, begin), (_, end) in zip(marks, marks[1:])}


class Document:
    """Markdown with pictures beside it in images/; printed as it grows."""

    def __init__(self, folder, name):
        self.file = folder / "papers" / f"{name}.md"
        self.images = folder / "images" / name
        self.images.mkdir(parents=True, exist_ok=True)
        self.blocks = []

    def text(self, text):
        self.blocks.append(text)
        print(text + "\n")

    def table(self, titles, rows):
        cells = [titles, *([c if isinstance(c, str) else number(c) for c in row] for row in rows)]
        widths = [max(3, *(len(row[i]) for row in cells)) for i in range(len(titles))]
        line = lambda row: "| " + " | ".join(c.ljust(w) for c, w in zip(row, widths)) + " |"  # noqa
        self.text("\n".join([line(cells[0]), "|" + "|".join("-" * (w + 2) for w in widths) + "|",
                             *map(line, cells[1:])]))

    def picture(self, name, what):
        """Refers to a picture and returns where it is to be written."""
        file = self.images / name
        self.text(f"![{what}]({os.path.relpath(file, self.file.parent)})")
        return file

    def part(self, name):
        """Begins a part of the page, which says what else the machine did then."""
        self.text(f"<!-- part {name} -->\n\n*Load of the machine before this part: {os.getloadavg()[0]:.1f}.*")

    def write(self, order=()):
        """`order`: names of all parts; those that the document has not are taken from the file, if it has them."""
        text = "\n\n".join(self.blocks) + "\n"
        if order and self.file.exists():
            parts = {**sections(self.file.read_text()), **sections(text)}
            text = "\n\n".join(parts[name].strip() for name in ("", *order) if name in parts) + "\n"
        self.file.parent.mkdir(parents=True, exist_ok=True)
        self.file.write_text(text)
        print(self.file, file=sys.stderr)

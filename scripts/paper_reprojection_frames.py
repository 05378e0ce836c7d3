"""Errors and shares of what is traced anew of every frame of reprojection's paths, for scripts/paper_tables."""
import csv
import hashlib
import itertools
import math
import shutil
import statistics
import time

from display_steps import display, l1
from paper_reprojection import PATHS, reflective
from paper_run import Bench, Document, number
from paper_second_order import average_and_most

FRAMES = 500
CHUNK = 64  # frames between two restarts: a chunk renders nothing twice
METHODS = ("reprojection", "traced")
COLUMNS = ["frame", "l1_8bit", "change", "change_of_traced", "reflective", "retraced", "key_frame", "partial_key"]


def measure(bench, name, numbers):
    """Rows of COLUMNS of consecutive frames; of the frames themselves the last one stays, for the next ones."""
    scene, path = PATHS[name][:2]
    folder = f"every_{path}"
    kept = bench.work / f"{folder}_last"
    runs = bench.render("reprojection", folder,
                        [f"scene=scenes/{scene}.json", f"path=paths/{path}.json", "image.layers=[]",
                         "image.masks=false", "preview.enabled=false"], [([], numbers)], list(METHODS))
    out = bench.work / folder / "0"
    errors, change, before = {}, {m: {} for m in METHODS}, {}
    for method in METHODS:
        if (last := kept / method / f"frame.{numbers[0] - 1:04d}.exr").exists():
            before[method] = display(last)
    for n in numbers:
        shown = {m: display(out / m / "frames" / f"frame.{n:04d}.exr") for m in METHODS}
        errors[n] = l1(*shown.values())
        for method in before:
            change[method][n] = l1(shown[method], before[method])
        before = shown
    for method in METHODS:
        shutil.rmtree(kept / method, ignore_errors=True)
        (kept / method).mkdir(parents=True)
        shutil.copy(out / method / "frames" / f"frame.{numbers[-1]:04d}.exr", kept / method)
    shutil.rmtree(bench.work / folder)
    counters = runs["reprojection"].counters
    return [[n, errors[n], *(change[m].get(n, "") for m in METHODS), reflective(counters[n]), counters[n]["retraced"],
             counters[n]["key_frame"], counters[n]["partial_key"]] for n in numbers]


class Measured:
    """A path's rows, in a file of this build's, so that an interrupted run goes on where it was."""

    def __init__(self, bench, name):
        build = hashlib.sha256(bench.program.read_bytes()).hexdigest()[:8]
        self.file = bench.work / f"every_{PATHS[name][1]}.{bench.effort}.{build}.csv"
        self.rows = []
        if self.file.exists():
            with open(self.file, newline="") as text:
                self.rows = [[float(v) if v else None for v in row] for row in list(csv.reader(text))[1:]]

    def add(self, rows):
        self.rows += rows
        temporary = self.file.with_suffix(".tmp")
        with open(temporary, "w", newline="") as text:
            csv.writer(text).writerows([COLUMNS, *self.rows])
        temporary.replace(self.file)

    def column(self, name, where=lambda row: True):
        values = [row[COLUMNS.index(name)] for row in self.rows if where(row)]
        return [v for v in values if v not in (None, "")]


def write(bench: Bench, document: Document, frames=range(1, FRAMES + 1), seconds=math.inf):
    """Measures the paths, one after the other, for about so many seconds, and writes the document of what there is."""
    paths = {name: Measured(bench, name) for name in PATHS}
    chunks = [list(frames[i:i + CHUNK]) for i in range(0, len(frames), CHUNK)]
    began = time.monotonic()
    for (name, measured), chunk in itertools.product(paths.items(), chunks):
        if chunk[0] not in measured.column("frame") and time.monotonic() - began < seconds:
            measured.add(measure(bench, name, chunk))

    document.text(f"""# reprojection: every frame of the paths

Written by `scripts/paper_tables reprojection --every-frame`: 1024 x 1024 pixels, one sample, consecutive frames from the
first one on, reprojection compared with `traced`. "a / b" is the average and the maximum over the frames. L1_8bit is the
mean absolute difference per channel, of 255, over the frame. The change is that of a frame from the one before it, as
L1_8bit; the next column divides the method's by that of `traced`, as means over the path and at the worst frame.
"Recomputed" is the share of the reflective samples that were traced anew, without key frames, then with them.""")

    def shares(measured, keys):
        part = [100 * (1 if row[COLUMNS.index("key_frame")] else row[COLUMNS.index("retraced")] / row[COLUMNS.index("reflective")])
                for row in measured.rows if keys or not row[COLUMNS.index("key_frame")]]
        return part or [0]

    rows = []
    for name, measured in paths.items():
        if not measured.rows:
            continue
        pairs = list(zip(measured.column("change"), measured.column("change_of_traced")))
        keys = [row[0] for row in measured.rows if row[COLUMNS.index("key_frame")]] + [measured.rows[-1][0] + 1]
        gaps = [b - a for a, b in zip(keys, keys[1:])]
        rows.append([name, str(len(measured.rows)), average_and_most(measured.column("l1_8bit")),
                     number(statistics.fmean(b for _, b in pairs)),
                     f"{number(sum(a for a, _ in pairs) / sum(b for _, b in pairs))} / {number(max(a / b for a, b in pairs))}",
                     f"{number(statistics.fmean(shares(measured, False)))}, {number(statistics.fmean(shares(measured, True)))}",
                     PATHS[name][3], f"{max(gaps):.0f} / {statistics.fmean(gaps):.1f}" if gaps else "", PATHS[name][2],
                     number(sum(measured.column("partial_key")))])
    document.table(["path", "frames", "L1_8bit", "change of `traced`", "ours / `traced`", "recomputed %", "printed",
                    "intervals, most / average", "printed", "partial key frames"], rows)
    document.text("## Worst frames\n\nTo look at them: `catoptric render configs/papers/reprojection.json --set scene=... "
                  "--set path=... --frames N`.")
    document.table(["path", "frames of the largest L1_8bit", "most traced anew, without key frames"],
                   [[name, *(", ".join(f"{r[0]:.0f}" for r in sorted(part, key=lambda r, c=c: -r[COLUMNS.index(c)])[:3])
                             for c, part in (("l1_8bit", m.rows), ("retraced", [r for r in m.rows if not r[COLUMNS.index("key_frame")]])))]
                    for name, m in paths.items() if m.rows])
    document.write()

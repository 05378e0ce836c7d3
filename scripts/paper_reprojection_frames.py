"""Errors and shares of what is traced anew of every frame of reprojection's paths, for scripts/paper_tables."""
import csv
import hashlib
import json
import shutil
import statistics

from paper_reprojection import PATHS, reflective
from paper_run import Bench, Document, number
from paper_second_order import average_and_most

FRAMES = 500
CHUNK = 64  # frames between two restarts: a chunk renders nothing twice
METHODS = ("reprojection", "traced")
COLUMNS = ["frame", "l1_8bit", "change", "change_of_traced", "reflective", "retraced", "key_frame", "partial_key"]


def by_frame(bench, run, reference):
    """L1_8bit by frame; one exposure, as HDR-FLIP is not asked for."""
    result = json.loads(bench.catoptric("compare", run, reference, "--json", "--num-exposures", "1"))
    return {f["frame"]: f["L1_8bit"] for f in result[0]["frames"]}


def changes(bench, frames):
    """L1_8bit of each frame of a folder against the one before it, where that is there."""
    after, before = frames.parent / "after", frames.parent / "before"
    for folder in (after, before):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
    numbers = {int(f.suffixes[0][1:]): f for f in frames.glob("*.exr")}
    for n in numbers:
        if n - 1 in numbers:
            (after / f"frame.{n:04d}.exr").symlink_to(numbers[n])
            (before / f"frame.{n:04d}.exr").symlink_to(numbers[n - 1])
    return by_frame(bench, after, before) if any(after.iterdir()) else {}


def measure(bench, name, numbers):
    """Rows of COLUMNS of consecutive frames; of the frames themselves the last one stays, for the next ones."""
    scene, path = PATHS[name][:2]
    folder = f"every_{path}"
    kept = bench.work / f"{folder}_last"
    runs = bench.render("reprojection", folder,
                        [f"scene=scenes/{scene}.json", f"path=paths/{path}.json", "image.layers=[]",
                         "image.masks=false", "preview.enabled=false"], [([], numbers)], list(METHODS))
    out = bench.work / folder / "0"
    errors = by_frame(bench, out / "reprojection", out / "traced")
    change = {}
    for method in METHODS:
        frames = out / method / "frames"
        before = kept / method / f"frame.{numbers[0] - 1:04d}.exr"
        if before.exists():
            shutil.copy(before, frames)
        change[method] = changes(bench, frames)
        shutil.rmtree(kept / method, ignore_errors=True)
        (kept / method).mkdir(parents=True)
        shutil.copy(frames / f"frame.{numbers[-1]:04d}.exr", kept / method)
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


def write(bench: Bench, document: Document, frames=range(1, FRAMES + 1), measures=True):
    """Measures the paths, a part of each in turn, and writes the document; without `measures` of what there is."""
    paths = {name: Measured(bench, name) for name in PATHS}
    chunks = [list(frames[i:i + CHUNK]) for i in range(0, len(frames), CHUNK)]
    for chunk in chunks if measures else []:
        for name, measured in paths.items():
            if chunk[0] not in measured.column("frame"):
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
                     PATHS[name][6], f"{max(gaps):.0f} / {statistics.fmean(gaps):.1f}" if gaps else "", PATHS[name][5],
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

#!/usr/bin/env python3
"""Renders scenes at their extremes with every method and measures each against a picture that must
be the same; fails where a stated bound does not hold.

    tests/extremes/run.py [--build build/release] [--program FILE] [--size 128] [--only PATTERN] [--methods NAME,...]
                          [--work FOLDER] [--huge] [--sample] [--tight] [--jobs N]
    tests/extremes/run.py --write [--huge] [--sequences] ...    measures, and writes docs/extremes.csv and docs/extremes.md

A case (cases.py, implicit.py, impostors.py, lobes.py) is a scene and a camera, a truth, and bounds of the mean
difference in 8-bit steps. Every frame must be there and finite, with no refused ray and, except where the case is about
it, no clamped value. A bound is at most three times the figure, or FLOOR above it, or it states a reason: --tight fails
where that is not so, and each run holds the bounds to the figures in docs/extremes.csv. --huge adds the frames that take
minutes. --sample leaves out the cases of LEFT_OUT, each of which another case resembles; the test extremes does so."""
import argparse
import concurrent.futures
import csv
import fnmatch
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests"))
import cases  # noqa: E402
import implicit  # noqa: E402
import impostors  # noqa: E402
import lobes  # noqa: E402
import work_folder  # noqa: E402

BASES = cases.BASES + implicit.BASES + impostors.BASES + lobes.BASES
CASES = cases.CASES + implicit.CASES + impostors.CASES + lobes.CASES
# Sizes in pixels at which bounds hold: that of the table, and that of the test extremes.
SIZES = (128, 48)
# Frames of different processors differ by up to this L1_8bit: no bound needs to be nearer to its figure.
FLOOR = 0.05
CSV = ROOT / "docs/extremes.csv"
COLUMNS = ["case", "what", "truth", "method", *(f"L1_8bit_{size}" for size in SIZES), "bound", "reason", "max_8bit",
           "refused", "not_finite", "clamped"]
# Options that make small frames cheap, and keep levels of detail from hiding what is measured; other
# methods run with those that their entry names for tests.
OPTIONS = {"environment_map": {"face_size": 128}, "reference": {"rays": 8, "bounces": 1, "max_standard_error": 0},
           "second_order": {"level_error": 0},
           "perturbation": {"unsupported": "environment_map"},
           "glossy_lod": {"rays": 8}}
# What --sample leaves out: the rooms but for one scaling of the bathroom; other scalings of scenes that are also moved or
# scaled the other way; other cameras in a mirror's plane, close to a floor, or with a narrow view; frames of a column;
# milder normals, scales and lamps; hundreds of reflectors, and 100,000 objects (100,000 nodes stay).
LEFT_OUT = {"living_room_small", "living_room_large", "bathroom_large", "spheres_large", "spheres_and_far", "box_small",
            "box_large", "baked_box_small", "baked_box_large", "vase_small", "vase_large", "grazing_floor", "on_floor",
            "on_mirror", "narrow", "column", "odd_normals", "nonuniform_scale", "bright_1e5", "reflectors_500",
            "objects_100k"}
# Counters of clamped values. Those of one line count together: an object with an impostor is in its image
# and left out of the cube map.
CLAMPED = [("clamped_half",), ("clamped_cube_map", "clamped_images")]


class Bench:
    def __init__(self, arguments):
        program = arguments.program or pathlib.Path(arguments.build, "bin", "catoptric")
        self.program = str(pathlib.Path(program).resolve())
        self.work = pathlib.Path(arguments.work)
        sizes = arguments.size or ",".join(map(str, SIZES if arguments.write else SIZES[:1]))
        self.sizes = tuple(int(size) for size in sizes.split(","))
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(self.work / "cache"))
        known = json.loads(self.run("list", "methods", "--json").stdout)["methods"]
        self.order = names = [m["name"] for m in known]
        self.small = {m["name"]: m["tests"]["small"] for m in known}
        # Without the reference most errors have no truth
        self.methods = [n for n in names if not arguments.methods or n == "reference"
                        or n in arguments.methods.split(",")]

    def run(self, *command):
        return subprocess.run([self.program, *command], env=self.environment, capture_output=True,
                              text=True, cwd=ROOT)

    def of(self, case):
        return [m for m in self.methods if not case.methods or m in case.methods]

    @staticmethod
    def bound(case, method):
        """L1_8bit that the picture stays below, and why it is loose; None: it is only measured."""
        bound = case.bounds.get(method, case.bounds.get("*"))
        return bound if isinstance(bound, tuple) else (bound, "")

    def sizes_of(self, case):
        return self.sizes[:1] if "width" in case.settings else self.sizes

    def render(self, case, size):
        """Renders a case by its methods; the run's exit code and messages when it failed."""
        folder = self.work / str(size) / case.name
        folder.mkdir(parents=True)
        case.make(folder)
        scene = "scene.gltf" if (folder / "scene.gltf").exists() else "scene.json"
        image = {"width": size, "height": size, "samples": 2, **case.settings}
        methods = [{"method": m, **OPTIONS.get(m, self.small[m]), **case.options.get(m, {})}
                   for m in self.of(case)]
        for method in methods:
            if method["method"] == "reference":
                method["samples"] = image["samples"]
        config = {"scene": scene, "path": "path.json", "image": image, "methods": methods,
                  "preview": {"enabled": not case.huge}}
        if scene == "scene.gltf":
            config["environment"] = "sky"
        (folder / "run.json").write_text(json.dumps(config))
        done = self.run("render", str(folder / "run.json"), "--out", str(folder / "out"), "-q")
        return "" if done.returncode == 0 else f"exit {done.returncode}: {done.stderr.strip()}"

    def folder(self, case, method, size):
        out = self.work / str(size) / case.name / "out"
        return out / method if len(self.of(case)) > 1 else out

    def counters(self, case, method, size):
        record = (self.folder(case, method, size) / "frames.jsonl").read_text().splitlines()[0]
        return json.loads(record)["counters"]

    def errors(self, method, pairs):
        """Errors of frames against their truths, by case: one comparison of numbered files."""
        with tempfile.TemporaryDirectory(dir=self.work) as name:
            sides = [pathlib.Path(name, side) for side in ("run", "truth")]
            for side in sides:
                side.mkdir()
            for number, (_, frame, truth) in enumerate(pairs, 1):
                shutil.copy(frame, sides[0] / f"{number}.exr")
                shutil.copy(truth, sides[1] / f"{number}.exr")
            done = self.run("compare", *map(str, sides), "--json")
            if done.returncode != 0:
                raise SystemExit(f"extremes: compare failed: {done.stderr}")
            frames = json.loads(done.stdout)[0]["frames"]
            return {pairs[f["frame"] - 1][0]: f for f in frames}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--build", default=str(ROOT / "build/release"))
    parser.add_argument("--program", help="instead of the build folder's bin/catoptric")
    parser.add_argument("--size", help=f"pixels along a side, several with commas [{SIZES[0]}; with --write "
                                       f"{' and '.join(map(str, SIZES))}, at which bounds hold]")
    parser.add_argument("--write", action="store_true",
                        help="replace what was measured in docs/extremes.csv and docs/extremes.md; other rows stay")
    parser.add_argument("--only", default="*", help="cases whose name fits this pattern")
    parser.add_argument("--methods", help="these methods and the reference only, with commas")
    parser.add_argument("--work", help="folder that is cleared, for one that is kept [a temporary one]")
    parser.add_argument("--huge", action="store_true",
                        default=os.environ.get("CATOPTRIC_LONG") == "1",
                        help="also frames that take minutes; CATOPTRIC_LONG=1 does the same")
    parser.add_argument("--sample", action="store_true",
                        help="leave out what other cases resemble, unless CATOPTRIC_LONG=1")
    parser.add_argument("--sequences", action="store_true", help="also the sequences of reprojection's tests")
    parser.add_argument("--tight", action="store_true",
                        help="fail on bounds over three times this run's figures that state no reason")
    parser.add_argument("--jobs", type=int, default=1, help="renders at a time [1]")
    arguments = parser.parse_args()
    temporary = None
    if arguments.work:
        arguments.work = work_folder.fresh(arguments.work)
    else:
        temporary = tempfile.TemporaryDirectory()
        arguments.work = temporary.name
    bench = Bench(arguments)
    assert LEFT_OUT < {c.name for c in CASES}
    left_out = LEFT_OUT if arguments.sample and os.environ.get("CATOPTRIC_LONG") != "1" else {}
    cases = [c for c in CASES if fnmatch.fnmatch(c.name, arguments.only) and c.name not in left_out
             and (arguments.huge or not c.huge) and bench.of(c)]
    failures = []
    rows = {}
    for size in bench.sizes:
        measure(bench, [c for c in cases if size in bench.sizes_of(c)], size, arguments.jobs, rows, failures)
    table = [line(cases_by_name()[name], method, row) for (name, method), row in rows.items()]
    if arguments.sequences:
        table += sequences(arguments)
    slack = [row for row in table if is_loose(row)]
    if arguments.tight:
        failures += [loose_text(row) for row in slack]
    if arguments.write:
        table = merged(table, bench.order)
        write(table)
    failures += unlike_table(bench, cases)
    for failure in failures:
        print("FAILED " + failure, file=sys.stderr)
    print(f"{len(rows)} pictures of {len(cases)} cases, {len(failures)} failures; {len(slack)} bounds are over three times "
          "this run's figures and state no reason (--tight names them)", file=sys.stderr)
    return 1 if failures else 0


def cases_by_name():
    return {c.name: c for c in CASES}


def measure(bench, cases, size, jobs, rows, failures):
    """Renders cases at one size; adds what was measured to the rows of (case, method)."""
    bases = [b for b in BASES if any(c.truth == b.name for c in cases)]
    broken = set()
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for case, message in zip(bases + cases, pool.map(lambda case: bench.render(case, size), bases + cases)):
            if message:
                broken.add(case.name)
                failures.append(f"{case.name}, {size} pixels: {message}")

    # The truth of a case by a method: the same method's picture of another case, or another
    # method's of this one.
    by_name = {c.name: c for c in bases + cases}
    frame = "frames/frame.0001.exr"
    for method in bench.methods:
        pairs = []
        for case in cases:
            truth_case = by_name[case.truth] if case.truth in by_name else case
            truth_method = "reference" if case.truth == "reference" else method
            if (case.truth is None or {case.name, truth_case.name} & broken
                    or (truth_case, truth_method) == (case, method)
                    or method not in bench.of(case) or truth_method not in bench.of(truth_case)):
                continue
            pairs.append((case.name, bench.folder(case, method, size) / frame,
                          bench.folder(truth_case, truth_method, size) / frame))
        errors = bench.errors(method, pairs) if pairs else {}
        for case in cases:
            if case.name in broken or method not in bench.of(case):
                continue
            row = rows.setdefault((case.name, method), {"errors": {}, "bound": bench.bound(case, method)})
            counters = bench.counters(case, method, size)
            row.setdefault("counters", counters)
            error = row["errors"][size] = errors.get(case.name)
            bound = row["bound"][0] if size in SIZES else None
            failures += [f"{case.name}, {method}, {size} pixels: {f}" for f in faults(case, error, bound, counters)]


def faults(case, error, bound, counters):
    """What a picture does not hold."""
    found = []
    if error and error["not_finite"] > 0:
        found.append(f"{error['not_finite']} pixels are not finite")
    if error and bound is not None and not error["L1_8bit"] <= bound:
        found.append(f"L1_8bit is {error['L1_8bit']:.3f}, bound {bound}")
    for name, count in counters.items():
        if name == "not_finite" and count > 0 or name == "refused" and count > case.refused:
            found.append(f"{name} {count}")
    for names in CLAMPED:
        counted = {name: counters[name] for name in names if name in counters}
        if counted and (sum(counted.values()) > 0) != case.clamped:
            shown = ", ".join(f"{name} {count}" for name, count in counted.items())
            found.append(f"{shown}, expected {'some' if case.clamped else 'none'}")
    unknown = {name for name in counters if name.startswith("clamped")} - set().union(*CLAMPED)
    found += [f"{name} is no counter of CLAMPED" for name in sorted(unknown)]
    return found


# --- The table: a row of COLUMNS for each case and method, all cells text ---------------------------

def line(case, method, row):
    errors, counters = row["errors"], row["counters"]
    bound, reason = row["bound"]
    error = next(iter(errors.values()))
    cells = {"case": case.name, "what": case.what, "truth": case.truth or "", "method": method,
             "bound": f"{bound:g}" if error and bound is not None else "", "reason": reason if error else "",
             "max_8bit": str(error["max_8bit"]) if error else "",
             **{name: str(counters.get(name, 0)) for name in ("refused", "not_finite")},
             "clamped": str(sum(v for k, v in counters.items() if k.startswith("clamped")))}
    for size, error in errors.items():
        if error and f"L1_8bit_{size}" in COLUMNS:
            cells[f"L1_8bit_{size}"] = f"{error['L1_8bit']:.3f}"
    return {name: cells.get(name, "") for name in COLUMNS}


def sequences(arguments):
    """Rows of what reprojection's tests of sequences have measured."""
    test = pathlib.Path(arguments.build, "bin", "reprojection_gl_test")
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder, "out.json")
        subprocess.run([test, "--gtest_filter=ReprojectionSequences.*", f"--gtest_output=json:{out}"],
                       check=True, stdout=subprocess.DEVNULL)
        tests = json.loads(out.read_text())["testsuites"][0]["testsuite"]
    words = lambda name: re.sub("[A-Z]", lambda m: " " + m[0].lower(), name.removeprefix("Hold")).strip()  # noqa: E731
    return [{**dict.fromkeys(COLUMNS, ""), "case": "sequence", "what": words(t["name"]), "truth": "traced",
             "method": "reprojection", f"L1_8bit_{SIZES[0]}": f"{float(t['l1']):.3f}", "bound": f"{float(t['bound']):g}",
             "reason": t.get("reason", "")} for t in tests if "l1" in t]


def figure(row):
    """The largest L1 of a row's sizes; None: it has none."""
    figures = [float(row[name]) for name in COLUMNS if name.startswith("L1_8bit") and row[name]]
    return max(figures) if figures else None


def is_loose(row):
    most = figure(row)
    return (most is not None and row["bound"] != "" and not row["reason"]
            and float(row["bound"]) > max(3 * most, most + FLOOR) + 5e-4)


def loose_text(row):
    return (f"{row['case']} ({row['what']}), {row['method']}: the bound {row['bound']} is over three times the figure, "
            f"{figure(row):.3f}, and states no reason")


def read():
    with CSV.open(newline="") as file:
        return list(csv.DictReader(file))


def key(row):
    return row["case"], row["method"], row["what"] if row["case"] == "sequence" else ""


def merged(table, methods):
    """The table's rows, with what docs/extremes.csv has of other cases, methods and sizes; all with today's bounds."""
    rows = {key(row): row for row in read()}
    for row in table:
        old = rows.get(key(row), {})
        rows[key(row)] = {name: cell or name.startswith("L1_8bit") and old.get(name) or "" for name, cell in row.items()}
    known = cases_by_name()
    for row in rows.values():
        if row["bound"] and row["case"] in known:
            bound, reason = Bench.bound(known[row["case"]], row["method"])
            row |= {"bound": f"{bound:g}", "reason": reason}
    place = {c.name: i for i, c in enumerate(CASES)} | {"sequence": len(CASES)}
    return sorted((row for row in rows.values() if row["case"] in place and row["method"] in methods),
                  key=lambda row: (place[row["case"]], methods.index(row["method"])))


def unlike_table(bench, cases):
    """How docs/extremes.csv differs from the cases, and its bounds that are loose."""
    table = {key(row): row for row in read()}
    known = {row["method"] for row in table.values()}
    found = [loose_text(row) for row in table.values() if is_loose(row)]
    for case in cases:
        for method in set(bench.of(case)) & known:
            row = table.get((case.name, method, ""))
            bound, reason = bench.bound(case, method)
            if row is None or figure(row) is not None and (row["bound"], row["reason"]) != (
                    "" if bound is None else f"{bound:g}", reason):
                found.append(f"{case.name}, {method}: docs/extremes.csv has another bound, or none; make it again by "
                             f"tests/extremes/run.py --write --only {case.name}")
    return found


PAGE = """# Extremes

The test `extremes` renders scenes at their extremes (tiny, huge, far away, degenerate, blinding) by every method, and
compares each picture with its truth. [extremes.csv](extremes.csv) has {pictures} pictures of {cases} cases, and
{sequences} sequences. It and this page are made by

    tests/extremes/run.py --write --huge --sequences

Each case is rendered twice, with {sizes} pixels along a side, unless it says otherwise. `scripts/test` renders
most cases with {small} x {small} pixels, `scripts/test --long` all. The test fails if

- an error exceeds its bound,
- a frame is missing, or has a NaN or an infinity,
- a ray is refused or a value clamped, unless the case allows it, or
- a bound has no `reason` but is loose: more than three times the error in the table, and more than {floor} above it
  (processors differ by up to {floor}).

| column | meaning |
|---|---|
| `truth` | the same method's picture of another scene that must look the same, or `reference`'s picture of this one |
| {errors} | L1_8bit with so many pixels along a side |
| `bound` | largest error with which the test passes; empty: only measured |
| `reason` | why the bound is loose |
| `max_8bit` | largest difference of any channel |
| `refused` | rays that are not finite or reach beyond 1e18; they show the environment |
| `not_finite` | radiances that were NaN or infinite, and were taken as 0 |
| `clamped` | values too large for half floats: in the frame, the cube map and the images of impostors |

Rows called `sequence` are from `src/methods/reprojection/sequences_gl_test.cpp`. Their error is the largest of any
frame, over the reflective samples.

## The largest errors that have a bound

| case | method | L1_8bit | bound |
|---|---|---|---|
{worst}

## What causes errors at large distances

A scene whose centre is farther from 0 than 64 times its diameter gets an origin of its own, subtracted in double
precision. So moving a scene by 1e5 metres changes only the positions of lights, which are kept in single precision
(`box_far`: 0.004 m off). In `narrow_far` the camera is 230 km from the scene. At this distance positions are
rounded to 0.02 m, and reflected rays start 32 times as far off their surface. A triangle that a matrix collapses to a line may
give a sample without a position, whose ray is refused.
"""


def write(table):
    """Writes the table, and the page beside it."""
    with CSV.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
    bounded = sorted((row for row in table if row["bound"] and figure(row) is not None), key=figure, reverse=True)
    pictures = [row["case"] for row in table if row["case"] != "sequence"]
    worst = [f"| `{row['case']}` | {row['method']} | {figure(row):.2f} | {row['bound']} |" for row in bounded[:8]]
    CSV.with_suffix(".md").write_text(PAGE.format(
        pictures=len(pictures), cases=len(set(pictures)), sequences=len(table) - len(pictures), floor=FLOOR,
        sizes=" and ".join(map(str, SIZES)), small=SIZES[1], errors=", ".join(f"`L1_8bit_{size}`" for size in SIZES),
        worst="\n".join(worst)))


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Renders scenes at their extremes with every method and measures each against a picture that must
be the same; writes a table, and fails where a stated bound does not hold.

    tests/extremes/run.py [--build build/release] [--program FILE] [--size 128] [--write docs/extremes.md]
                          [--only PATTERN] [--methods NAME,...] [--work FOLDER] [--huge] [--sample] [--sequences]

A case (cases.py, implicit.py, impostors.py, lobes.py) is a scene and a camera, a truth, and bounds of the mean
difference in 8-bit steps. Every frame must be there and finite, with no refused ray and, but where
the case is about it, no clamped value. --huge adds the frames that take minutes. --sample leaves out the
cases of LEFT_OUT, each of which another case resembles; the test extremes does so. The errors of reprojection's
sequences come from its tests, where they are built; with --sequences from nowhere else, and the pictures'
table stays as it is in --write's file."""
import argparse
import concurrent.futures
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
# Methods that resample the scene: rounding may move a sample to another texel or level of detail,
# so that pictures of scenes that must look alike differ by a few pixels.
RESAMPLING = {"second_order": 1.0, "glossy_lod": 0.1}
# Options that make small frames cheap, and keep levels of detail from hiding what is measured; other
# methods run with those that their entry names for tests.
OPTIONS = {"environment_map": {"face_size": 128}, "reference": {"rays": 8},
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
        self.size = arguments.size
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(self.work / "cache"))
        known = json.loads(self.run("list", "methods", "--json").stdout)["methods"]
        names = [m["name"] for m in known]
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
        """L1_8bit that the picture stays below; None: it is only measured."""
        if method in case.bounds or "*" not in case.bounds:
            return case.bounds.get(method)
        return max(case.bounds["*"], RESAMPLING.get(method, 0))

    def render(self, case):
        """Renders a case by its methods; the run's exit code and messages when it failed."""
        folder = self.work / case.name
        folder.mkdir(parents=True)
        case.make(folder)
        scene = "scene.gltf" if (folder / "scene.gltf").exists() else "scene.json"
        image = {"width": self.size, "height": self.size, "samples": 2, **case.settings}
        methods = [{"method": m, **OPTIONS.get(m, self.small[m]), **case.options.get(m, {})}
                   for m in self.of(case)]
        for method in methods:
            if method["method"] == "reference":
                method["samples"] = image["samples"]
        config = {"scene": scene, "path": "path.json", "image": image, "methods": methods,
                  "preview": {"enabled": not case.huge}}
        (folder / "run.json").write_text(json.dumps(config))
        done = self.run("render", str(folder / "run.json"), "--out", str(folder / "out"), "-q")
        return "" if done.returncode == 0 else f"exit {done.returncode}: {done.stderr.strip()}"

    def folder(self, case, method):
        out = self.work / case.name / "out"
        return out / method if len(self.of(case)) > 1 else out

    def counters(self, case, method):
        record = (self.folder(case, method) / "frames.jsonl").read_text().splitlines()[0]
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
    parser.add_argument("--size", type=int, default=128, help="pixels along a side [128]")
    parser.add_argument("--write", help="file of the table")
    parser.add_argument("--only", default="*", help="cases whose name fits this pattern")
    parser.add_argument("--methods",
                        help="these methods and the reference only, with commas; --write then changes their rows alone")
    parser.add_argument("--work", help="folder that is cleared, for one that is kept [a temporary one]")
    parser.add_argument("--huge", action="store_true",
                        default=os.environ.get("CATOPTRIC_LONG") == "1",
                        help="also frames that take minutes; CATOPTRIC_LONG=1 does the same")
    parser.add_argument("--sample", action="store_true",
                        help="leave out what other cases resemble, unless CATOPTRIC_LONG=1")
    parser.add_argument("--sequences", action="store_true", help="the table of reprojection's sequences alone")
    parser.add_argument("--jobs", type=int, default=1, help="renders at a time [1]")
    arguments = parser.parse_args()
    temporary = None
    if arguments.work:
        arguments.work = work_folder.fresh(arguments.work)
    else:
        temporary = tempfile.TemporaryDirectory()
        arguments.work = temporary.name
    if arguments.sequences:
        before = pathlib.Path(arguments.write).read_text().split("\n" + SEQUENCES[:12])[0] if arguments.write else ""
        return put(arguments, before + "\n" + sequences(arguments))
    bench = Bench(arguments)
    assert LEFT_OUT < {c.name for c in CASES}
    left_out = LEFT_OUT if arguments.sample and os.environ.get("CATOPTRIC_LONG") != "1" else {}
    cases = [c for c in CASES if fnmatch.fnmatch(c.name, arguments.only) and c.name not in left_out
             and (arguments.huge or not c.huge) and bench.of(c)]
    bases = [b for b in BASES if any(c.truth == b.name for c in cases)]

    failures = []
    broken = set()
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for case, message in zip(bases + cases, pool.map(bench.render, bases + cases)):
            if message:
                broken.add(case.name)
                failures.append(f"{case.name}: {message}")

    # The truth of a case by a method: the same method's picture of another case, or another
    # method's of this one.
    by_name = {c.name: c for c in bases + cases}
    rows = {}
    for method in bench.methods:
        pairs = []
        for case in cases:
            truth_case = by_name[case.truth] if case.truth in by_name else case
            truth_method = "reference" if case.truth == "reference" else method
            if (case.truth is None or {case.name, truth_case.name} & broken
                    or (truth_case, truth_method) == (case, method)
                    or method not in bench.of(case) or truth_method not in bench.of(truth_case)):
                continue
            frame = "frames/frame.0001.exr"
            pairs.append((case.name, bench.folder(case, method) / frame,
                          bench.folder(truth_case, truth_method) / frame))
        errors = bench.errors(method, pairs) if pairs else {}
        for case in cases:
            if case.name in broken or method not in bench.of(case):
                continue
            row = {"counters": bench.counters(case, method), "error": errors.get(case.name),
                   "bound": bench.bound(case, method)}
            rows[case.name, method] = row
            failures += [f"{case.name}, {method}: {f}" for f in faults(case, row)]
    if arguments.write and arguments.methods:
        add(arguments.write, cases, bench, rows)
    else:
        text = table(cases, bench, rows)
        put(arguments, text + "\n" + sequences(arguments) if arguments.write else text)
    for failure in failures:
        print("FAILED " + failure, file=sys.stderr)
    print(f"{len(rows)} pictures of {len(cases)} cases, {len(failures)} failures", file=sys.stderr)
    return 1 if failures else 0


def put(arguments, text):
    if arguments.write:
        pathlib.Path(arguments.write).write_text(text)
    else:
        print(text)
    return 0


SEQUENCES = """## Sequences

The method reprojection keeps state over frames, so its extremes are sequences: the tests of
src/methods/reprojection/sequences_gl_test.cpp. In each of them every frame is finite, every reflective sample is
counted once, and what was traced anew has the bits of `traced`. *L1* is the largest mean difference from `traced`
over the reflective samples of any frame, in 8-bit steps per channel; *bound*: what the test holds it below.

| sequences hold | L1 | bound |
|---|---|---|
"""


def sequences(arguments):
    """The table of what reprojection's tests of sequences have measured."""
    test = pathlib.Path(arguments.build, "bin", "reprojection_gl_test")
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder, "out.json")
        subprocess.run([test, "--gtest_filter=ReprojectionSequences.*", f"--gtest_output=json:{out}"],
                       check=True, stdout=subprocess.DEVNULL)
        tests = json.loads(out.read_text())["testsuites"][0]["testsuite"]
    words = lambda name: re.sub("[A-Z]", lambda m: " " + m[0].lower(), name.removeprefix("Hold")).strip()  # noqa: E731
    return SEQUENCES + "".join(f"| {words(t['name'])} | {float(t['l1']):.3f} | {float(t['bound']):g} |\n"
                               for t in tests if "l1" in t)


def faults(case, row):
    """What a picture does not hold."""
    error, bound, counters = row["error"], row["bound"], row["counters"]
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


INTRODUCTION = """# Extremes

Made by `tests/extremes/run.py --huge --write docs/extremes.md`; do not edit. The program rendered every
picture below with {size} x {size} pixels, unless its case says otherwise. The test `extremes` renders most of the
cases with 48 x 48 pixels. It fails where an error exceeds its bound, where a frame is missing or has
a NaN or an infinity, where a ray is refused, and where a radiance is not finite or a value is clamped.
`scripts/test --long` adds the others and the huge frames.

The columns of the table mean:

- *truth*: the picture that a case is measured against. It is the same method's picture of another scene
  that must look the same (one that is not scaled, not moved, or has none of the odd triangles), or
  `reference`, that method's picture of the same case.
- *L1*: the mean difference in 8-bit steps per channel. *bound*: what L1 must stay below. *max*: the
  largest difference of any channel. The method environment_map has no bound against `reference`.
- *refused*: how many rays were not given to Embree, because they were not finite or reached beyond 1e18.
  Such rays see the environment.
- *not finite*: how many radiances were NaN or infinite, and were taken as 0.
- *clamped*: how many values were too large for half floats, in the frame, in the cube map and in the
  images of impostors. These three counts are 0 unless the case is about them.

A scene whose middle lies farther from 0 than 64 times its diameter gets an origin of its own, which is
subtracted in double precision. Moving a scene by 1e5 metres therefore costs nothing. What remains in
`box_far` are its lights: a description keeps their positions in single precision, which is off by up to
0.004 m there. From 230 km away positions are rounded to 0.02 m, and reflected rays start 0.9 m off their
surface, which is 32 such roundings: `narrow_far`. A triangle that a matrix has collapsed to a line may
give a sample without a place, whose ray is refused; that is allowed for eight rays of a picture.

"""


def cells(case, method, row):
    """A row of the table: the case's part, the rest."""
    error, counters = row["error"], row["counters"]
    return [f"`{case.name}`: {case.what} | {case.truth}", method, f"{error['L1_8bit']:.3f}" if error else "",
            f"{row['bound']:g}" if error and row["bound"] is not None else "",
            str(error["max_8bit"]) if error else "",
            str(counters.get("refused", 0)), str(counters.get("not_finite", 0)),
            str(sum(v for k, v in counters.items() if k.startswith("clamped")))]


def lines_of(rows):
    """`rows`: all cells of a case's methods."""
    return ["| " + " | ".join([row[0] if i == 0 else " | "] + row[1:]) + " |" for i, row in enumerate(rows)]


def table(cases, bench, rows):
    lines = ["| case | truth | method | L1 | bound | max | refused | not finite | clamped |",
             "|---|---|---|---|---|---|---|---|---|"]
    for case in cases:
        lines += lines_of([cells(case, method, rows[case.name, method]) for method in bench.methods
                           if (case.name, method) in rows])
    return INTRODUCTION.format(size=bench.size) + "\n".join(lines) + "\n"


def add(file, cases, bench, rows):
    """Puts the rows of some methods in the place of those in a file; its other rows stay."""
    before, rest = pathlib.Path(file).read_text().split("| case | ", 1)
    head, *old = ("| case | " + rest.split("\n\n")[0]).rstrip("\n").split("\n")
    after = rest.split("\n\n", 1)[1]
    kept, name = {}, ""
    for line in old[1:]:
        first, truth, *others = line[2:-2].split(" | ")
        name = (f"{first} | {truth}") if first.strip() else name
        kept.setdefault(name.split("`")[1], {})[others[0]] = [name, *others]
    order = [m["name"] for m in json.loads(bench.run("list", "methods", "--json").stdout)["methods"]]
    for case in cases:
        mine = kept.setdefault(case.name, {})
        for method in bench.methods:
            if (case.name, method) in rows:
                mine[method] = cells(case, method, rows[case.name, method])
    lines = [head, old[0]]
    for case in (c.name for c in CASES if c.name in kept):
        lines += lines_of([kept[case][m] for m in sorted(kept[case], key=order.index)])
    pathlib.Path(file).write_text(before + "\n".join(lines) + "\n\n" + after)


if __name__ == "__main__":
    sys.exit(main())

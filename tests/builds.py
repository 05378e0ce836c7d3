#!/usr/bin/env python3
"""Measures methods whose costs are known: tests/faulty_method spends so much CPU time before the first frame
(build_ms), in a frame that no frame beside it precedes (again_ms), and in every frame (frame_ms).

    tests/builds.py build/release/bin/catoptric_faulty WORK

The first frame, the steady frame and the mean must be as long as these say, on consecutive frames and on frames
that are far apart, and ratios of means must hold the truth in their intervals."""
import csv
import json
import pathlib
import subprocess
import sys

import work_folder

BUILD, AGAIN, FRAME, FRAMES = 400, 100, 30, 40
FIRST = BUILD + AGAIN + FRAME
OWN = 15  # ms that the method, the frame and the process take at most besides
DRIFT = 0.002  # of a time: what clocks differ by, the wall's is slewed
faults = []


def check(what, value, least, most):
    print(f"{what}: {value:.4g} ({least:.4g} to {most:.4g})")
    if not (1 - DRIFT) * least <= value <= most:
        faults.append(f"{what} is {value:.4g}, not {least:.4g} to {most:.4g}")


def times(row):
    return [1e3 * float(row[name + "_seconds"]) for name in ("first", "steady", "mean")]


def main():
    program, work = pathlib.Path(sys.argv[1]).resolve(), work_folder.fresh(sys.argv[2])
    ball = {"name": "ball", "shape": "sphere", "radius": 0.5, "material": {"base_color": [0.9, 0.9, 0.9], "s": 0.9, "g": 0}}
    (work / "scene.json").write_text(json.dumps({"objects": [ball]}))
    (work / "path.json").write_text(json.dumps({"frames": FRAMES, "orbit": {"center": [0, 0, 0], "radius": 3}}))
    (work / "run.json").write_text(json.dumps(
        {"scene": "scene.json", "path": "path.json", "image": {"width": 8, "height": 8}, "threads": 1,
         "methods": [{"method": "faulty", "name": "plain", "frame_ms": FRAME},
                     {"method": "faulty", "name": "builds", "build_ms": BUILD, "again_ms": AGAIN, "frame_ms": FRAME}]}))

    def run(*arguments):
        return subprocess.run([program, *arguments, "-q"], cwd=work, check=True, capture_output=True, text=True).stdout

    def sweep(frames, kind, repeats):
        run("sweep", "run.json", "--method", "plain,builds", "--against", "plain", "--frames", frames, "--clock", "cpu", "--time", kind,
            "--repeats", str(repeats), "--out", f"{frames}_{kind}")
        return list(csv.DictReader((work / f"{frames}_{kind}/points.csv").open()))

    mean = (FIRST + (FRAMES - 1) * FRAME) / FRAMES
    for frames in ("1-3", "1,20,40"):
        plain, builds = sweep(frames, "steady", 2)
        for name, value, truth in zip(("first", "steady", "mean"), times(builds), (FIRST, FRAME, mean)):
            check(f"frames {frames}, {name} frame", value, truth, truth + OWN)
        check(f"frames {frames}, first frame of plain", times(plain)[0], FRAME, FRAME + OWN)
    _, builds = sweep("1,20", "mean", 8)
    check("ratio of means", float(builds["ratio"]), 0.95 * mean / FRAME, 1.05 * mean / FRAME)
    check("least of it", float(builds["ratio_low"]), 1, mean / FRAME)
    check("most of it", float(builds["ratio_high"]), mean / (FRAME + 1), 99)

    # A run's table: frames one after the other, or frames apart, which it must say. Its clock is the wall's.
    for frames, apart in (("1-3", 0), ("1,20,40", AGAIN)):
        text = run("render", "run.json", "--method", "builds", "--frames", frames, "--out", f"run_{frames}", "--amortize", "100")
        rows = {row["step"]: 1e3 * float(row["mean"]) for row in csv.DictReader((work / f"run_{frames}/table.csv").open())}
        built = sum(1e3 * float(row["seconds"]) for row in csv.DictReader((work / f"run_{frames}/timings.csv").open())
                    if row["clock"] == "wall" and (row["frame"] == "1" or row["step"] in ("bvh", "prepare") and row["frame"] == "0"))
        check(f"run of {frames}, first frame", rows["first frame"], max(FIRST, built - 0.01), built + 0.01)
        check(f"run of {frames}, steady frame", rows["steady frame"], FRAME + apart, 1e9)
        mean = (rows["first frame"] + 99 * rows["steady frame"]) / 100
        check(f"run of {frames}, mean", rows["mean of 100 frames"], mean - 0.01, mean + 0.01)
        if ("not consecutive" in text) != (apart > 0):
            faults.append(f"run of {frames}: the table says the wrong thing of its frames:\n{text}")
    if faults:
        sys.exit("\n".join(faults))


main()

#!/usr/bin/env python3
"""scripts/compare_builds finds a build equal to itself, and one that draws other pixels or takes longer different; its
verdicts hold on made-up times of a machine that drifts.
Usage: compare_builds.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per fault."""

import json
import pathlib
import random
import subprocess
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "scripts"))
import paired_times  # noqa: E402
import work_folder  # noqa: E402

CONFIG = "configs/small.json"


def small_tree(root, folder):
    """A tree with one config of one method."""
    tree = folder / "tree"
    (tree / "configs").mkdir(parents=True)
    for part in ("scenes", "paths"):
        (tree / part).symlink_to(root / part)
    (tree / CONFIG).write_text(json.dumps({"scene": "../scenes/planar_mirror.json",
                                           "path": "../paths/planar_mirror.json", "methods": ["traced"]}))
    return tree


def drifting_pairs(slower, rounds=12, frames=8):
    """Ratios of a machine that drifts by 17 % with spikes in 8 % of the frames."""
    draw, pairs = random.Random(7), []
    for _ in range(rounds):
        drift = draw.uniform(0.83, 1.17)
        seconds = [[drift * draw.uniform(0.99, 1.01) * (2 if draw.random() < 0.08 else 1) for _ in range(frames)]
                   for _ in range(2)]
        pairs.append([slower * b / a for a, b in zip(*seconds)])
    return pairs


def main(root, program, work):
    folder = work_folder.fresh(work)
    tree = small_tree(pathlib.Path(root).resolve(), folder)
    faults = 0

    def expect(what, holds):
        nonlocal faults
        faults += not holds
        print(("" if holds else "FAULT: ") + what)

    def compare(*more):
        done = subprocess.run([pathlib.Path(root) / "scripts" / "compare_builds", program, program, "--old-tree", tree,
                               "--new-tree", tree, "--configs", CONFIG, "--size", "32", "--work", folder / "kept", *more],
                              capture_output=True, text=True)
        print(done.stdout, done.stderr)
        return done.returncode, done.stdout

    code, text = compare()
    expect("a build's frames equal its own", code == 0 and "2 of 2 frames equal" in text)
    code, text = compare("--new-set", "image.samples=1")
    expect("other pixels are found", code == 1 and "frame.0001.exr R: " in text)
    expected = folder / "expected.json"
    expected.write_text(json.dumps({f"{CONFIG}/*": "fewer samples"}))
    code, text = compare("--new-set", "image.samples=1", "--expected", expected)
    expect("expected differences are no faults", code == 0 and "0 unexpected" in text)
    expected.write_text(json.dumps({f"{CONFIG}/*:A": "only alpha"}))
    expect("other channels' are", compare("--new-set", "image.samples=1", "--expected", expected)[0] == 1)
    code, text = compare("--no-pixels", "--rounds", "2", "--most-rounds", "2", "--new-set", "image.samples=8")
    expect("16 times the samples take longer", code == 1 and "| rendering |" in text and "| fails |" in text)

    for slower, wanted in ((1.0, "holds"), (1.08, "fails"), (1.03, "undecided")):
        _, low, high = paired_times.interval(drifting_pairs(slower))
        expect(f"{slower} times as slow: {low:.3f} to {high:.3f}, {wanted}", paired_times.verdict(low, high) == wanted)
    print(f"{faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))

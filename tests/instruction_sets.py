#!/usr/bin/env python3
"""What other processors would draw: a small frame of every scene family (tests/golden/families.json) by every method,
with Embree's instruction sets, the program's own vector levels, llvmpipe's vectors of 128 and 256 bits, and 1 and 3
threads, beside the frames of this machine's defaults.

    instruction_sets.py PROGRAM WORK_FOLDER [--all] [--families NAME...]

Without --all (or CATOPTRIC_LONG=1) four families are drawn in two settings: an old processor's, in everything at once,
and 3 threads. The sample leaves the other families out, and does not tell which part of the old processor errs.
Settings that this processor lacks are named and left out. The light is baked with one instruction set everywhere; only
the settings `bake NAME` take another one. Prints the largest difference of each method in each setting. Exit 1 where a
frame is farther off than LIMITS says, or not the same to the bit where only threads or vector levels differ."""

import argparse
import importlib.machinery
import importlib.util
import os
import pathlib
import shutil
import sys

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parent.parent
loader = importlib.machinery.SourceFileLoader("golden", str(ROOT / "tests" / "golden_frames.py"))
golden = importlib.util.module_from_spec(importlib.util.spec_from_loader("golden", loader))
loader.exec_module(golden)

# Of a frame: mean difference of display values (0..255), and percentage of the pixels that differ by more than the
# golden frames' limit of a pixel.
LIMITS = {"L1_8bit": 0.05, "percent": 0.5}
OLD = {"CATOPTRIC_EMBREE_ISA": "sse4.2", "CATOPTRIC_VECTOR_LEVEL": "base", "LP_NATIVE_VECTOR_WIDTH": "128"}
SAME_BITS = ("CATOPTRIC_VECTOR_LEVEL",)
SAMPLE = ["planar_mirror", "moving", "deforming", "teapots"]  # baked light, textures, curved and rough reflectors


def settings(every):
    """{name: (environment, threads)}"""
    if not every:
        return {"old processor": (OLD, 1), "3 threads": ({}, 3)}
    found = {}
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        flags = set(next((line for line in file if line.startswith("flags")), "").split())
    for isa, needs in (("sse4.2", "sse4_2"), ("avx", "avx"), ("avx2", "avx2"), ("avx512", "avx512vl")):
        if needs not in flags:
            print(f"this processor has no {isa}: left out")
            continue
        found[f"Embree {isa}"] = ({"CATOPTRIC_EMBREE_ISA": isa}, 2)
        found[f"bake {isa}"] = ({"CATOPTRIC_BAKE_ISA": isa}, 2)
    for level in ("base", "v2", "v3"):
        found[f"vectors {level}"] = ({"CATOPTRIC_VECTOR_LEVEL": level}, 2)
    for bits in ("128", "256"):
        found[f"llvmpipe {bits}"] = ({"LP_NATIVE_VECTOR_WIDTH": bits}, 2)
    for threads in (1, 3):
        found[f"{threads} threads"] = ({}, threads)
    found["old processor"] = (OLD, 1)
    return found


def frames(arguments, name, setting, threads):
    """A golden.Golden and {"FAMILY.METHOD": the frame's path}"""
    test = golden.Golden(arguments.program, arguments.work / name.replace(" ", "_"))
    os.environ.update(setting)
    try:
        found = test.frames([n for family in arguments.families or test.families["families"]
                             for n in test.names([f"{family}.*"])], ["--threads", str(threads)])
    finally:
        for variable in setting:
            del os.environ[variable]
    for name, frame in found.items():
        if isinstance(frame, str):
            raise SystemExit(f"{name}, {setting}: {frame}")
    return test, found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--all", action="store_true", help="every setting by itself")
    parser.add_argument("--families", nargs="*", metavar="NAME")
    arguments = parser.parse_args()
    every = arguments.all or os.environ.get("CATOPTRIC_LONG") == "1"
    arguments.families = arguments.families or (None if every else SAMPLE)
    shutil.rmtree(arguments.work, ignore_errors=True)
    _, usual = frames(arguments, "usual", {}, 2)
    faults, table = 0, {}
    for name, (setting, threads) in settings(every).items():
        exact = set(setting) <= set(SAME_BITS)
        test, found = frames(arguments, name, setting, threads)
        for frame, errors in test.compare(found, usual)[1].items():
            family, method = frame.split(".")
            l1, percent = errors["L1_8bit"], errors["over_percent"]
            worst = table.setdefault(method, {}).setdefault(name, (-1.0, 0.0, ""))
            if l1 > worst[0] or (l1 == worst[0] and percent > worst[1]):
                table[method][name] = (l1, percent, family)
            same = found[frame].read_bytes() == usual[frame].read_bytes()
            if l1 > LIMITS["L1_8bit"] or percent > LIMITS["percent"] or (exact and not same):
                faults += 1
                print(f"{family} by {method}, {name}: L1_8bit {l1:.3f}, {percent:.2f} % of the pixels differ"
                      + (", which should be the same to the bit" if exact else ""))
    names = list(next(iter(table.values())))
    print("\nlargest L1_8bit (with the percentage of pixels there)")
    print("| method | " + " | ".join(names) + " |\n|" + "---|" * (len(names) + 1))
    for method, row in table.items():
        print(f"| {method} | " + " | ".join(f"{row[n][0]:.3f} ({row[n][1]:.2f} %)" for n in names) + " |")
    print(f"\n{len(usual)} frames in {len(names)} settings, {faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

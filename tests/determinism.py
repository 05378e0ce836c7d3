#!/usr/bin/env python3
"""Renders one config several times - again, with one thread, on the other GL device - and expects
the same bytes of every frame of every method.
Usage: determinism.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per difference."""

import os
import pathlib
import shutil
import subprocess
import sys

# Device, threads of the program (baked light is made anew for each number), threads of llvmpipe
# (0: none but the caller).
VARIANTS = {
    "first": ("surfaceless", 2, 2),
    "again": ("surfaceless", 2, 2),
    "one_thread": ("surfaceless", 1, 0),
    "osmesa": ("osmesa", 2, 1),
}
METHODS = 4  # at least: those of configs/cornell_box.json


def main(root: str, program: str, work: str) -> int:
    folder = pathlib.Path(work)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    frames = {}
    for name, (device, threads, driver_threads) in VARIANTS.items():
        environment = dict(os.environ, XDG_CACHE_HOME=str(folder / f"cache_{threads}"),
                           LP_NUM_THREADS=str(driver_threads))
        command = [program, "render", "configs/cornell_box.json", "--set", "image.width=64",
                   "--set", "image.height=64", "--frames", "1,7", "--threads", str(threads),
                   "--device", device, "--out", str(folder / name / "out")]
        done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
        if done.returncode != 0:
            print(f"{name}: exit {done.returncode}\n{done.stderr}")
            return 1
        out = folder / name / "out"
        frames[name] = {str(p.relative_to(out)): p.read_bytes() for p in out.rglob("frame.*.exr")}

    differences = 0
    first = frames["first"]
    for name, others in frames.items():
        for path in sorted(set(first) | set(others)):
            if first.get(path) != others.get(path):
                differences += 1
                print(f"{name}: {path} differs from the first run's")
    print(f"{len(first)} frames of each of {len(frames)} runs compared, {differences} differ")
    return 1 if differences or len(first) < 2 * METHODS else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))

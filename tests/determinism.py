#!/usr/bin/env python3
"""Renders one config and two scenes several times - again, with one thread, on the other GL device - and a moving
scene in chunks, merged; expects the same bytes of every frame of every method.
Usage: determinism.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per difference."""

import os
import pathlib
import subprocess
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "scripts"))
import work_folder  # noqa: E402

# Device, threads of the program (baked light is made anew for each number), threads of llvmpipe
# (0: none but the caller).
VARIANTS = {
    "first": ("surfaceless", 2, 2),
    "again": ("surfaceless", 2, 2),
    "one_thread": ("surfaceless", 1, 0),
    "osmesa": ("osmesa", 2, 1),
}
PEELED = '{"method": "second_order", "name": "peeled", "depth_layers": 2}'
METHODS = 4  # at least: those of configs/cornell_box.json


def render(program, root, environment, config, out, *more):
    """Small frames by all methods of a config; whether that worked."""
    command = [program, "render", config, "--set", "image.width=64", "--set", "image.height=64",
               "--out", str(out), *more]
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        print(f"{out}: exit {done.returncode}\n{done.stderr}")
    return done.returncode == 0


def frames_of(out):
    return {str(p.relative_to(out)): p.read_bytes() for p in out.rglob("frame.*.exr")}


def chunks_differ(program, root, folder):
    """Frames of configs/moving.json that differ between the whole and merged chunks, the last first."""
    environment = dict(os.environ, XDG_CACHE_HOME=str(folder / "cache_2"))
    for name, more in {"whole": [], "b": ["--chunk", "2/2"], "a": ["--chunk", "1/2"]}.items():
        if not render(program, root, environment, "configs/moving.json", folder / "moving" / name,
                      "--set", f"methods.4={PEELED}",
                      "--frames", "1,8", *more):
            return 1
    moving = folder / "moving"
    for method in sorted(p.name for p in (moving / "whole").iterdir() if p.is_dir()):
        subprocess.run([program, "merge", moving / "b" / method, moving / "a" / method, "--out",
                        moving / "merged" / method], check=True, capture_output=True)
    whole, merged = frames_of(moving / "whole"), frames_of(moving / "merged")
    different = [p for p in sorted(set(whole) | set(merged)) if whole.get(p) != merged.get(p)]
    for path in different:
        print(f"chunks: {path} differs from the whole run's")
    print(f"{len(whole)} frames of a moving scene in chunks, {len(different)} differ")
    return len(different) + (len(whole) < 2 * METHODS)


def main(root: str, program: str, work: str) -> int:
    folder = work_folder.fresh(work)
    frames = {}
    for name, (device, threads, driver_threads) in VARIANTS.items():
        environment = dict(os.environ, XDG_CACHE_HOME=str(folder / f"cache_{threads}"),
                           LP_NUM_THREADS=str(driver_threads))
        out = folder / name / "out"
        if not render(program, root, environment, "configs/cornell_box.json", out, "--frames", "1,7",
                      "--threads", str(threads), "--device", device):
            return 1
        # Two bounces of perturbation: reflections in reflections, refraction
        for scene in ("vase_sphere", "lens"):
            if not render(program, root, environment, f"scenes/{scene}.json", out / scene, "--frames", "1",
                          "--method", "perturbation", "--set", "methods.perturbation.max_bounces=2",
                          "--set", "methods.perturbation.tessellation_error=2",
                          "--threads", str(threads), "--device", device):
                return 1
        frames[name] = frames_of(out)

    differences = 0
    first = frames["first"]
    for name, others in frames.items():
        for path in sorted(set(first) | set(others)):
            if first.get(path) != others.get(path):
                differences += 1
                print(f"{name}: {path} differs from the first run's")
    print(f"{len(first)} frames of each of {len(frames)} runs compared, {differences} differ")
    differences += chunks_differ(program, root, folder)
    return 1 if differences or len(first) < 2 * METHODS else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))

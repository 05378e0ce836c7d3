#!/usr/bin/env python3
"""Renders three scenes by every method several times - again, with one thread, on the other GL device - and a moving
scene in chunks, merged; expects the same bytes of every frame of every method.
By default a sample is rendered: one frame of the Cornell box instead of two, and no run again with the same threads and
device. It leaves out what differs by chance alone, between equal runs, and what a second frame of a still scene brings.
With CATOPTRIC_LONG=1 everything is rendered.
Usage: determinism.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per difference."""

import json
import os
import pathlib
import subprocess
import sys

sys.dont_write_bytecode = True
import method_list  # noqa: E402
import work_folder  # noqa: E402

# Device, threads of the program (baked light is made anew for each number), threads of llvmpipe
# (0: none but the caller).
VARIANTS = {
    "first": ("surfaceless", 2, 2),
    "again": ("surfaceless", 2, 2),
    "one_thread": ("surfaceless", 1, 0),
    "osmesa": ("osmesa", 2, 1),
}
LONG = os.environ.get("CATOPTRIC_LONG") == "1"
if not LONG:
    del VARIANTS["again"]


class Test:
    def __init__(self, root, program, work):
        self.root, self.program = pathlib.Path(root), program
        self.folder = work_folder.fresh(work)
        self.methods = method_list.Methods(program)

    def config(self, scene, frames, methods):
        """A run config of small frames."""
        file = self.folder / f"{scene}.json"
        file.write_text(json.dumps(
            {"scene": str(self.root / f"scenes/{scene}.json"), "path": str(self.root / f"paths/{scene}.json"),
             "frames": frames, "image": {"width": 64, "height": 64, "samples": 2, "layers": ["s"]},
             "methods": methods}))
        return file

    def render(self, environment, config, out, *more):
        """Whether that worked."""
        done = subprocess.run([self.program, "render", str(config), "--out", str(out), *more], env=environment,
                              capture_output=True, text=True)
        if done.returncode != 0:
            print(f"{out}: exit {done.returncode}\n{done.stderr}")
        return done.returncode == 0

    def chunks_differ(self):
        """Frames of a moving scene that differ between the whole and merged chunks, the last first."""
        environment = dict(os.environ, XDG_CACHE_HOME=str(self.folder / "cache_2"))
        methods = self.methods.configured() + self.methods.variants()
        config = self.config("moving", "7,8", methods)  # the second after the first, and alone
        moving = self.folder / "moving"
        for name, more in {"whole": [], "b": ["--chunk", "2/2"], "a": ["--chunk", "1/2"]}.items():
            if not self.render(environment, config, moving / name, *more):
                return 1
        for method in sorted(p.name for p in (moving / "whole").iterdir() if p.is_dir()):
            subprocess.run([self.program, "merge", moving / "b" / method, moving / "a" / method, "--out",
                            moving / "merged" / method], check=True, capture_output=True)
        whole, merged = frames_of(moving / "whole"), frames_of(moving / "merged")
        different = [p for p in sorted(set(whole) | set(merged)) if whole.get(p) != merged.get(p)]
        for path in different:
            print(f"chunks: {path} differs from the whole run's")
        print(f"{len(whole)} frames of a moving scene in chunks, {len(different)} differ")
        return len(different) + (len(whole) != 2 * len(methods))

    def variants_differ(self):
        """Frames that differ between devices, threads and repetitions."""
        # The smallest scene with everything; reflections in reflections; refraction
        refracting = self.methods.refracting()
        runs = {"cornell_box": ("1,7" if LONG else "7", self.methods.configured() + self.methods.variants()),
                "vase_sphere": ("1", refracting), "lens": ("1", refracting)}
        configs = {scene: self.config(scene, *run) for scene, run in runs.items()}
        frames = {}
        for name, (device, threads, driver_threads) in VARIANTS.items():
            environment = dict(os.environ, XDG_CACHE_HOME=str(self.folder / f"cache_{threads}"),
                               LP_NUM_THREADS=str(driver_threads))
            out = self.folder / name / "out"
            for scene, config in configs.items():
                if not self.render(environment, config, out / scene, "--threads", str(threads), "--device", device):
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
        expected = (2 if LONG else 1) * len(runs["cornell_box"][1]) + 2 * len(refracting)
        return differences + (len(first) != expected)


def frames_of(out):
    return {str(p.relative_to(out)): p.read_bytes() for p in out.rglob("frame.*.exr")}


def main(root: str, program: str, work: str) -> int:
    test = Test(root, program, work)
    differences = test.variants_differ()
    return 1 if test.chunks_differ() + differences else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))

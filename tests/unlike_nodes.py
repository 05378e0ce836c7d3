#!/usr/bin/env python3
"""Shares a path among nodes with unlike processors, and measures what shows where their chunks meet. Eight chunks are
rendered in turn with the best instruction sets of this processor, and with those of an old one, then merged. The light
must be baked once for all; merge must name both kinds of machines; and from frame to frame the picture must change no more
at the borders of chunks than it does there when one machine renders all frames.

Usage: unlike_nodes.py SOURCE_ROOT PROGRAM WORK_FOLDER [--config FILE] [--frames LIST] [--size N] [--methods LIST] [--own];
exit 1 and a line for each fault. --own: as a comparison each kind of node bakes for itself with its own instruction set,
and nothing is held."""
import argparse
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys

sys.dont_write_bytecode = True
import work_folder  # noqa: E402

CHUNKS = 8
KINDS = [{}, {"CATOPTRIC_EMBREE_ISA": "sse4.2", "CATOPTRIC_VECTOR_LEVEL": "base", "LP_NATIVE_VECTOR_WIDTH": "128"}]
OWN_BAKES = ["avx2", "sse4.2"]
# By how much the mean change at borders may exceed that of one machine between the same frames, in L1_8bit: half of what
# bakes by two instruction sets show in the living room (docs/benchmarks.md).
MOST_EXCESS = 0.001


class Test:
    def __init__(self, arguments):
        self.program, self.folder = arguments.program, work_folder.fresh(arguments.work)
        root = pathlib.Path(arguments.root)
        self.run_words = [arguments.config or self.slow_path(root), "--method", arguments.methods, "--frames",
                          arguments.frames]
        for setting in ("width", "height"):
            self.run_words += ["--set", f"image.{setting}={arguments.size}"]
        self.run_words += ["--set", "errors.against=[]"]
        self.faults = 0

    def slow_path(self, root):
        """A run config of a small scene and a camera that moves a hundredth of a metre a frame: what pops would show."""
        sides = [{"position": [x, 1, 3], "target": [0, 0.85, 0]} for x in (-0.12, 0.12)]
        path = {"frames": 24, "fps": 30, "fov": 40, "constant_speed": True, "keyframes": sides}
        (self.folder / "path.json").write_text(json.dumps(path))
        config = {"scene": str(root.resolve() / "scenes/cornell_box.json"), "path": "path.json", "image": {"samples": 2}}
        (self.folder / "run.json").write_text(json.dumps(config))
        return self.folder / "run.json"

    def expect(self, condition, what):
        if not condition:
            self.faults += 1
            print(f"FAILED: {what}")

    def call(self, *words, **more):
        environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache"), **more}
        done = subprocess.run([str(word) for word in words], env=environment, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{words}: exit {done.returncode}\n{done.stdout}{done.stderr}")
        return done

    def share(self, own):
        """The merged run. `own`: each kind of node with a cache of its own."""
        shared = self.folder / "shared"
        self.call(self.program, "submit", *self.run_words, "--chunks", CHUNKS, "--to", "script", "--out", shared)
        for chunk in range(1, CHUNKS + 1):
            kind = chunk % len(KINDS)
            if own:
                cache = {"CATOPTRIC_CACHE": str(self.folder / f"cache_{kind}"), "CATOPTRIC_BAKE_ISA": OWN_BAKES[kind]}
                self.call(self.program, "render", *self.run_words, "--chunk", f"{chunk}/{CHUNKS}", "--no-tables", "--out",
                          shared / f"parts/{chunk}", **cache, **KINDS[kind])
            else:
                self.call(shared / "chunk.sh", chunk, **KINDS[kind])
        self.call(shared / "merge.sh")
        return shared

    def check_shared(self, shared):
        bakes = list((shared / "cache").glob("bake-*.bin"))
        self.expect(len(bakes) == 1, f"{len(bakes)} bakes in the folder of the run, not 1")
        self.expect(not list((shared / "cache").glob("*.lock")), "a lock is left")
        said = (shared / "logs/merge.log").read_text()
        self.expect("2 kinds of machines" in said, f"merge says nothing of unlike machines: {said}")
        self.expect("bakes" not in said, f"merge speaks of several bakes: {said}")

    def check_machines(self, merged):
        machines = json.loads((merged / "summary.json").read_text())["machines"]
        kinds = {(machine["instructions"], machine["renderer"]) for machine in machines}
        self.expect(len(kinds) == len(KINDS), f"{merged}: summary.json names {kinds}")
        self.expect(all(machine["processor"] for machine in machines), f"{merged}: no processor")

    def differences(self, test, reference):
        """L1_8bit of each frame."""
        found = json.loads(self.call(self.program, "compare", test, reference, "--json").stdout)
        return [row["L1_8bit"] for row in found[0]["frames"]]

    def changes(self, run):
        """L1_8bit between each frame and the one before it."""
        frames = sorted((run / "frames").glob("*.exr"))
        before, after = (self.folder / name for name in ("before", "after"))
        for folder, ones in ((before, frames[:-1]), (after, frames[1:])):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            for number, frame in enumerate(ones, 2):
                os.link(frame, folder / f"frame.{number:04}.exr")
        return self.differences(after, before)

    def whole(self, shared):
        """The run of one machine, in the light of the shared one."""
        self.call(self.program, "render", *self.run_words, "--no-tables", "--out", self.folder / "whole",
                  CATOPTRIC_CACHE=str(shared / "cache"))
        return self.folder / "whole"

    def report(self, method, merged, whole, held):
        changes, alone = self.changes(merged), self.changes(whole)
        excess = [change - other for change, other in zip(changes, alone)]
        size = (len(changes) + 1) // CHUNKS
        borders = [i for i in range(len(changes)) if (i + 1) % size == 0]
        inside = [i for i in range(len(changes)) if i not in borders]

        def text(values, places):
            return f"mean {statistics.mean(values[i] for i in places):.4f}, largest {max(values[i] for i in places):.4f}"

        off = self.differences(merged / "frames", whole / "frames")
        print(f"{method}, L1_8bit\n  change from frame to frame at borders: {text(changes, borders)}; within chunks: "
              f"{text(changes, inside)}\n  more than one machine's at borders: {text(excess, borders)}; within chunks: "
              f"{text(excess, inside)}\n  frames beside one machine's: {text(off, range(len(off)))}", flush=True)
        more = statistics.mean(excess[i] for i in borders)
        self.expect(not held or more <= MOST_EXCESS, f"{method}: borders show, by {more:.4f} in the mean")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("root")
    parser.add_argument("program")
    parser.add_argument("work")
    parser.add_argument("--config", default="")
    parser.add_argument("--frames", default="1-24")
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--methods", default="traced,second_order,glossy_lod")
    parser.add_argument("--own", action="store_true")
    arguments = parser.parse_args()
    test = Test(arguments)
    shared = test.share(arguments.own)
    if not arguments.own:
        test.check_shared(shared)
    whole = test.whole(shared)
    for summary in sorted((shared / "merged").glob("**/summary.json")):
        method = summary.parent.relative_to(shared / "merged")
        test.check_machines(summary.parent)
        test.report(str(method), summary.parent, whole / method, not arguments.own)
    return 1 if test.faults else 0


if __name__ == "__main__":
    sys.exit(main())

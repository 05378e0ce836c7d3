#!/usr/bin/env python3
"""Frames of reprojection, which keeps what earlier frames traced, and its table of key frames have the same bytes whole,
in chunks whatever their order, of a list of frames, by one thread, and where a run was killed and resumed.
Usage: kept_frames.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per difference."""

import json
import os
import pathlib
import signal
import subprocess
import sys
import time

sys.dont_write_bytecode = True
import work_folder  # noqa: E402

FRAMES = 14
# At this size half of the frames after the first few would be key frames without the higher threshold.
METHODS = [{"method": "reprojection", "restart_every": 6, "keyframe_threshold": 0.6},
           {"method": "reprojection", "name": "grid", "mapping": "grid", "restart_every": 6, "keyframe_threshold": 0.9},
           {"method": "image_warp", "restart_every": 6, "keyframe_threshold": 0.6}]


def frames_of(out):
    """By file: a frame's bytes, and the lines of the table keyframes by their frames."""
    frames = {str(p.relative_to(out)): p.read_bytes() for p in out.rglob("frame.*.exr")}
    for table in out.rglob("keyframes.csv"):
        for line in table.read_text().splitlines()[1:]:
            frames[f"{table.relative_to(out)}:{line.split(',')[0]}"] = line
    return frames


class Test:
    def __init__(self, root, program, work):
        self.program = program
        self.folder = work_folder.fresh(work)
        self.config = self.folder / "run.json"
        root = pathlib.Path(root).resolve()
        self.config.write_text(json.dumps(
            {"scene": str(root / "scenes/moving.json"), "path": str(root / "paths/moving_temporal.json"),
             "frames": f"1-{FRAMES}", "image": {"width": 64, "height": 64, "layers": ["s"], "masks": True, "half": False},
             "preview": {"enabled": False}, "methods": METHODS}))
        self.failed = 0

    def command(self, out, *more):
        return [self.program, "render", self.config, "--out", self.folder / out, "-q", *more]

    def render(self, out, *more):
        subprocess.run(self.command(out, *more), check=True, capture_output=True)
        return frames_of(self.folder / out)

    def expect(self, what, frames, whole, count):
        different = [p for p in frames if frames[p] != whole.get(p)]
        expected = 2 * count * len(METHODS)
        if different or len(frames) != expected:
            self.failed += 1
            print(f"{what}: {len(frames)} frames and lines, expected {expected}; other bytes: {', '.join(sorted(different)) or 'none'}")

    def merged(self, parts):
        """Chunks, rendered in this order and merged."""
        for part in parts:
            self.render(f"part_{part}", "--chunk", f"{part}/3")
        for method in (m.get("name", m["method"]) for m in METHODS):
            subprocess.run([self.program, "merge", *(self.folder / f"part_{p}" / method for p in parts), "--out",
                            self.folder / "merged" / method], check=True, capture_output=True)
        return frames_of(self.folder / "merged")

    def killed(self):
        """A run that is killed again and again, each time later, and resumed."""
        kills = 0
        for delay in (0.3, 0.6, 1.0, 1.5):
            run = subprocess.Popen(self.command("killed", "--existing", "resume"), stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
            time.sleep(delay)
            if run.poll() is None:
                run.send_signal(signal.SIGKILL)
                kills += 1
            run.wait()
        return self.render("killed", "--existing", "resume"), kills

    def run(self):
        whole = self.render("whole")
        self.expect("whole", whole, whole, FRAMES)
        counters = [json.loads(line)["counters"] for line in (self.folder / "whole/reprojection/frames.jsonl").read_text().splitlines()]
        keys = sum(c["key_frame"] for c in counters)
        if not 3 <= keys <= FRAMES // 2:
            self.failed += 1
            print(f"{keys} key frames: too many or too few to tell anything")
        self.expect("chunks, the last first", self.merged([3, 1, 2]), whole, FRAMES)
        self.expect("a list of frames", self.render("list", "--frames", "5,11,12"), whole, 3)
        self.expect("one thread", self.render("one", "--threads", "1"), whole, FRAMES)
        frames, kills = self.killed()
        self.expect("killed and resumed", frames, whole, FRAMES)
        print(f"{len(whole) // 2} frames, {kills} kills, {self.failed} cases failed")
        return self.failed


if __name__ == "__main__":
    os.environ.setdefault("XDG_CACHE_HOME", str(pathlib.Path(sys.argv[3]) / "cache"))
    sys.exit(1 if Test(*sys.argv[1:4]).run() else 0)

#!/usr/bin/env python3
"""Gives a run to a real Slurm of two nodes on this host (slurm_cluster.py): loses a node while its task
runs, and runs a task twice; damages a frame and deletes one, and gives what failed to Slurm again. All frames must be
there, and equal bit for bit to those of one process. The same run again by a shell script; and a sweep.

A lost node's tasks would wait two minutes in the queue; the test lets them start at once.

Usage: slurm.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per fault."""

import fcntl
import json
import os
import pathlib
import subprocess
import sys

sys.dont_write_bytecode = True
import slurm_cluster  # noqa: E402
import work_folder  # noqa: E402

FRAMES = 8
SCENE = {"objects": [
    {"name": "floor", "shape": "plane", "size": [4, 4], "material": {"base_color": [0.6, 0.5, 0.4]}},
    {"name": "ball", "shape": "sphere", "radius": 0.5, "translate": [0, 0.5, 0],
     "material": {"base_color": [0.9, 0.9, 0.9], "s": 0.9, "g": 0}}],
    "environment": {"type": "gradient", "zenith": [0.2, 0.4, 0.9], "horizon": [1, 1, 1], "ground": [0.2, 0.2, 0.2]}}
PATH = {"frames": FRAMES, "orbit": {"center": [0, 0.5, 0], "radius": 3, "height": 0.8}}
# Of a method with state and of one without, of which the task of each chunk takes a second
CONFIG = {"scene": "scene.json", "path": "path.json", "image": {"width": 24, "height": 16},
          "preview": {"enabled": False}, "errors": {"against": ["truth"]},
          "methods": [{"method": "reprojection", "restart_every": 4},
                      {"method": "reference", "max_standard_error": 0, "name": "truth", "samples": 8, "rays": 4}]}


class Test:
    def __init__(self, program, folder):
        self.program = program
        self.folder = folder
        self.faults = 0
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(folder / "cache"))

    def expect(self, condition, what):
        if not condition:
            self.faults += 1
            print(f"FAILED: {what}", flush=True)

    def run(self, *arguments, code=0):
        result = subprocess.run([self.program, *map(str, arguments)], cwd=self.folder, env=self.environment,
                                text=True, capture_output=True)
        self.expect(result.returncode == code,
                    f"{arguments}: exit code {result.returncode}, not {code}\n{result.stdout}{result.stderr}")
        return result.stdout

    def status(self, run, *more, code=0):
        return json.loads(self.run("status", run, "--json", *more, code=code) or "{}")

    def frames(self, run):
        return {str(path.relative_to(self.folder / run)): path.read_bytes()
                for path in (self.folder / run).glob("**/frames/*.exr")}

    def expect_whole(self, run):
        whole = self.frames("whole")
        merged = self.frames(run)
        self.expect(sorted(whole) == sorted(merged), f"{run}: frames {sorted(merged)}, not {sorted(whole)}")
        different = [name for name in whole if merged.get(name) != whole[name]]
        self.expect(not different, f"{run}: {different} differ from the frames of one process")

    def slurm(self, cluster):
        self.environment.update(cluster.environment)
        self.run("submit", "run.json", "--chunks", 4, "--out", "shared", "--max-parallel", 3)
        # A node is lost while it renders, and comes back
        node = cluster.lose_busy_node()
        self.expect(cluster.start_requeued() == 1, "not one task was requeued when its node was lost")
        # Chunk 1 once more, now that it is done or at work
        again = subprocess.run([self.folder / "shared/chunk.sh", "1"], env=self.environment)
        self.expect(again.returncode == 0, f"a chunk rendered twice: exit code {again.returncode}")
        cluster.start_node(node)
        state = self.status("shared", "--wait")
        self.expect(state["merged"] and state["finished"] == 2 * FRAMES, f"after a lost node: {state}")
        self.expect_whole("shared/merged")

        # What is missing or damaged is rendered again, and nothing else
        lost = sorted((self.folder / "shared/parts").glob("*/truth/frames/frame.0003.exr"))[0]
        lost.unlink()
        bad = sorted((self.folder / "shared/parts").glob("*/reprojection/frames/frame.0007.exr"))[0]
        bytes_of = bytearray(bad.read_bytes())
        bytes_of[len(bytes_of) // 2] ^= 1
        bad.unlink()  # merged/ has links to the same file
        bad.write_bytes(bytes_of)
        chunks = sorted({int(path.relative_to(self.folder / "shared/parts").parts[0]) for path in (lost, bad)})
        state = self.status("shared", "--verify", code=6)
        self.expect(state["chunks"]["failed"] == chunks, f"failed: {state['chunks']['failed']}, not {chunks}")
        before = {path: path.stat().st_mtime_ns for path in self.folder.glob("shared/parts/**/*.exr")}
        again = json.loads(self.run("retry", "shared", "--verify", "--json"))
        self.expect(again["chunks"] == chunks, f"retried: {again}")
        self.expect(self.status("shared", "--wait")["merged"], "not merged after the retry")
        changed = {path for path in self.folder.glob("shared/parts/**/*.exr")
                   if before.get(path) != path.stat().st_mtime_ns}
        self.expect(changed == {lost, bad}, f"rendered again: {sorted(changed)}")
        self.expect_whole("shared/merged")

        # What cannot work is said by status; cancelled tasks can be submitted again
        self.run("submit", "run.json", "--chunks", 4, "--out", "ended", "--sbatch=--hold")
        self.expect(self.status("ended", code=6)["chunks"]["held"] == [1, 2, 3, 4], "held tasks are not named")
        self.run("cancel", "ended")
        self.expect(self.status("ended", code=6)["chunks"]["failed"] == [1, 2, 3, 4], "cancelled tasks go on")
        # A sweep is one task, alone on its node
        self.run("submit", "run.json", "--frames", "1", "--out", "levels", "--", "sweep", "--repeats", 1, "--method",
                 "truth", "--against", "truth", "--vary", "methods.truth.rays=1,2")
        self.status("levels", "--wait")
        self.expect((self.folder / "levels/sweep/points.csv").exists(), "the sweep has no points")
        self.run("submit", "run.json", "--out", "none", "--", "sweep", "--vary", "methods.truth.rais=1,2", code=2)
        self.run("submit", "run.json", "--chunks", 2, "--out", "none", "--sbatch=--partition=nowhere", code=2)
        self.expect(not (self.folder / "none").exists(), "what Slurm refused leaves a folder")

    def waiting(self):
        """A task whose chunk another process writes waits for it."""
        part = self.folder / "by_script/parts/1/reprojection"
        with open(part / ".lock") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.run("render", "by_script/config.json", "--chunk", "1/3", "--existing", "resume", "--out",
                     "by_script/parts/1", code=5)
            task = subprocess.Popen([self.folder / "by_script/chunk.sh", "1"], env=self.environment)
            try:
                task.wait(1.5)
                self.expect(False, f"a task did not wait for another one: exit code {task.returncode}")
            except subprocess.TimeoutExpired:
                pass
        self.expect(task.wait() == 0, "a task that waited failed")

    def script(self):
        (self.folder / "run.json").rename(self.folder / "other.json")
        self.run("submit", "-", "--chunks", 3, "--out", "by_script", "--to", "script", code=2)
        (self.folder / "other.json").rename(self.folder / "run.json")
        self.run("submit", "run.json", "--chunks", 3, "--out", "by_script", "--to", "script")
        self.status("by_script", code=6)
        for share in (["2", "1/2"], ["1", "2/2"], []):
            ended = subprocess.run([self.folder / "by_script/run.sh", *share], env=self.environment)
            self.expect(ended.returncode == 0, f"run.sh {share}: exit code {ended.returncode}")
        state = self.status("by_script")
        self.expect(state["merged"] and not state["chunks"]["failed"], f"by a script: {state}")
        self.expect_whole("by_script/merged")
        for name in ("errors.md", "table.md", "contact_sheet.png"):
            self.expect((self.folder / "by_script/merged" / name).exists(), f"the merged run has no {name}")
        self.waiting()


def main(program, work):
    folder = work_folder.fresh(work)
    for name, value in {"scene": SCENE, "path": PATH, "run": CONFIG}.items():
        (folder / f"{name}.json").write_text(json.dumps(value))
    test = Test(program, folder)
    test.run("render", "run.json", "--out", "whole", "-q")
    test.expect(len(set(test.frames("whole").values())) == 2 * FRAMES, "some frames are the same")
    test.script()
    missing = slurm_cluster.missing()
    if missing:
        # scripts/setup installs them; CI must not pass without
        print(f"not installed: {', '.join(missing)}; run scripts/setup")
        return 1
    # Of at most two tasks an array: four chunks are two arrays
    with slurm_cluster.Cluster(folder / "slurm", nodes=2, slots=1, array=3) as cluster:
        test.slurm(cluster)
    print(f"{test.faults} faults")
    return 1 if test.faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[2], pathlib.Path(sys.argv[3])))

#!/usr/bin/env python3
"""Shares a run of tiny frames among two Slurm nodes on this host, a frame a chunk, while one node is lost and comes back
and one task runs twice; loses some frames, and submits what failed again. Compares all frames bit for bit with those of
one process, and prints what a chunk costs beside its frame.

Usage: tests/slurm_thousand.py [--program FILE] [--chunks N] [--slots N] [--work FOLDER]; exit 1 when a frame differs or
is not there. Takes about a second of processor time a chunk. With --script the chunks are rendered by run.sh, --slots at a
time, without Slurm and losses: what a chunk costs on a quiet machine."""
import argparse
import csv
import datetime
import json
import os
import pathlib
import random
import statistics
import subprocess
import sys
import time

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parent.parent
import slurm_cluster  # noqa: E402
import work_folder  # noqa: E402

SCENE = {"objects": [
    {"name": "floor", "shape": "plane", "size": [4, 4], "material": {"base_color": [0.6, 0.5, 0.4]}},
    {"name": "ball", "shape": "sphere", "radius": 0.5, "translate": [0, 0.5, 0],
     "material": {"base_color": [0.9, 0.9, 0.9], "s": 0.9, "g": 0}}],
    "environment": {"type": "gradient", "zenith": [0.2, 0.4, 0.9], "horizon": [1, 1, 1], "ground": [0.2, 0.2, 0.2]}}


# Short frames
OPTIONS = {"reference": {"bounces": 1, "max_standard_error": 0}}


def inputs(folder, chunks, method):
    path = {"frames": chunks, "orbit": {"center": [0, 0.5, 0], "radius": 3, "height": 0.8}}
    config = {"scene": "scene.json", "path": "path.json", "image": {"width": 16, "height": 16},
              "preview": {"enabled": False}, "methods": [{"method": method, **OPTIONS.get(method, {})}]}
    for name, value in {"scene": SCENE, "path": path, "run": config}.items():
        (folder / f"{name}.json").write_text(json.dumps(value))


def frames_of(folder):
    return {path.name: path.read_bytes() for path in (folder / "frames").glob("*.exr")}


def differing(whole, merged):
    return [name for name in whole if merged.get(name) != whole[name]] + sorted(set(merged) - set(whole))


def overheads(shared, numbers):
    """Seconds from the start of a chunk's last task to the file of its frame, without what the frame itself took."""
    found = []
    for number in numbers:
        line = [line for line in (shared / f"logs/{number}.log").read_text().splitlines()
                if line.startswith(f"chunk {number} on ")][-1]
        begun = datetime.datetime.fromisoformat(line.split(", ")[1][:26]).timestamp()
        with open(shared / f"parts/{number}/timings.csv", newline="") as file:
            frame = sum(float(row["seconds"]) for row in csv.DictReader(file) if row["frame"] != "0")
        written = (shared / f"parts/{number}/frames/frame.{number:04}.exr").stat().st_mtime
        if written > begun:  # not of a chunk whose frame was there when its last task began
            found.append(written - begun - frame)
    return found


def say_overheads(shared, chunks):
    found = overheads(shared, range(1, chunks + 1))
    print(f"from the start of a task to its first frame, without that frame: median {statistics.median(found):.2f} s, "
          f"longest {max(found):.2f} s")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default=ROOT / "build/release/bin/catoptric")
    parser.add_argument("--chunks", type=int, default=1000)
    parser.add_argument("--slots", type=int, default=2)
    parser.add_argument("--script", action="store_true")
    parser.add_argument("--method", default="reference")
    parser.add_argument("--work", default=ROOT / "out/slurm_thousand")
    arguments = parser.parse_args()
    folder = work_folder.fresh(arguments.work)
    inputs(folder, arguments.chunks, arguments.method)
    environment = dict(os.environ, XDG_CACHE_HOME=str(folder / "cache"))

    def run(*words):
        start = time.monotonic()
        ended = subprocess.run([arguments.program, *map(str, words)], cwd=folder, env=environment, text=True,
                               capture_output=True)
        if ended.returncode not in (0, 6):
            sys.exit(f"{words}: {ended.stderr}")
        return ended.stdout, time.monotonic() - start

    _, single = run("render", "run.json", "--out", "whole", "-q", "--no-tables")
    whole = frames_of(folder / "whole")
    print(f"one process: {len(whole)} frames in {single:.1f} s", flush=True)

    if arguments.script:
        run("submit", "run.json", "--chunks", arguments.chunks, "--out", "shared", "--to", "script")
        subprocess.run([folder / "shared/run.sh", str(arguments.slots)], env=environment, check=True,
                       stdout=subprocess.DEVNULL)
        faults = differing(whole, frames_of(folder / "shared/merged"))
        say_overheads(folder / "shared", arguments.chunks)
        print(f"{len(faults)} frames differ or are missing")
        return 1 if faults else 0

    with slurm_cluster.Cluster(folder / "slurm", slots=arguments.slots) as cluster:
        environment.update(cluster.environment)
        start = time.monotonic()
        _, seconds = run("submit", "run.json", "--chunks", arguments.chunks, "--out", "shared")
        print(f"submit: {seconds:.2f} s", flush=True)
        logs = folder / "shared/logs"
        begun = lambda share: sum(1 for _ in logs.glob("*.log")) > share * arguments.chunks  # noqa: E731
        cluster.wait_for(lambda: begun(0.2), "a fifth of the tasks", 3600)
        node = cluster.lose_busy_node()
        requeued = cluster.start_requeued()
        subprocess.run([folder / "shared/chunk.sh", "1"], env=environment, check=True)  # a task runs twice
        cluster.wait_for(lambda: begun(0.4), "two fifths of the tasks", 3600)
        cluster.start_node(node)
        run("status", "shared", "--wait")
        elapsed = time.monotonic() - start
        text, seconds = run("status", "shared", "--json")
        state = json.loads(text)
        print(f"Slurm: {state['finished']} of {state['frames']} frames in {elapsed:.1f} s, merged: {state['merged']}, "
              f"tasks requeued: {requeued}; status takes {seconds:.2f} s", flush=True)
        failed = len(state["chunks"]["failed"])
        faults = differing(whole, frames_of(folder / "shared/merged"))

        lost = random.Random(1).sample(range(1, arguments.chunks + 1), 10)
        for number in lost:
            (folder / f"shared/parts/{number}/frames/frame.{number:04}.exr").unlink()
        text, _ = run("retry", "shared", "--json")
        again = json.loads(text)["chunks"]
        run("status", "shared", "--wait")
        faults += differing(whole, frames_of(folder / "shared/merged"))
        print(f"10 frames lost: chunks {sorted(lost)}; submitted again: {again}")
        _, merging = run("merge", "shared", "--existing", "overwrite")

    say_overheads(folder / "shared", arguments.chunks)
    print(f"merge: {merging:.1f} s")
    print(f"{len(faults)} frames differ or are missing, {failed} chunks failed before any was lost")
    return 1 if faults or failed or sorted(lost) != again else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Renders 120 tiny frames of a scene in which things move, by every method and by every policy of Embree's structure, and
holds what the process keeps in memory: it must not grow with the frames. Then compares peaks with what `plan` says.
With CATOPTRIC_LONG=1 the frames are 300, and the peaks are those of all methods in 15 scenes. The sample of 120 notices
what grows by 0.4 MiB a frame, the whole test 0.12.
Usage: memory.py PROGRAM WORK_FOLDER [SCENES [METHODS]], names joined by commas, for peaks alone; exit 1 and a line per
run that grows or whose peak is far from its plan's."""

import json
import math
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import time

sys.dont_write_bytecode = True
import memory_scenes  # noqa: E402
import method_list  # noqa: E402
import work_folder  # noqa: E402

LONG = os.environ.get("CATOPTRIC_LONG") == "1"
FRAMES = 300 if LONG else 120
SETTLED = FRAMES // 2 if FRAMES < 200 else 100  # frames after which everything has its size
# MiB over the other frames, at most. Leaving Embree's lists of this scene's 26,000 triangles behind in each of 200 frames
# took 180, a cube map of 4 MiB in each of them 800 (glibc 2.36 cannot always use aligned blocks again); records of frames and the
# allocators' own scatter take up to 10.
GROWTH = 24

# The peak, as a share of what `plan` says: requireMemory() and memoryWarning() of src/run/folder/memory.cpp rely on it.
LEAST_SHARE, LARGEST_SHARE = 0.5, 1.2
# These keep images until their memory is needed: their peaks are those of frames from the whole path
KEEPS = ["billboards", "depth_impostors"]
# Of the short test
SAMPLE = [("cornell_box", None), ("textures", ["traced"]), ("balls_900", ["reprojection", "reference"])]
# Otherwise a refusal, and minutes of rays that change no memory
OPTIONS = {"perturbation": {"unsupported": "environment_map"}, "planar": {"unsupported": "environment_map"},
           "reference": {"samples": 1, "rays": 1, "bounces": 1, "max_standard_error": 0}}

POLICIES = ["static", "refit", "rebuild_low", "rebuild_medium"]

SCENE = {
    "objects": [
        {"name": "floor", "shape": "plane", "size": [4, 4], "material": {"base_color": [0.5, 0.4, 0.3]}},
        {"name": "mirror", "shape": "plane", "size": [3, 2], "rotate": [90, 0, 0], "translate": [0, 1, -1.5],
         "material": {"s": 0.9, "g": 0}, "reflective": True},
        {"name": "chrome", "shape": "sphere", "radius": 0.4, "segments": [128, 64], "translate": [-0.6, 0.5, 0],
         "material": {"s": 0.9, "g": 0}, "reflective": True},
        {"name": "ball", "shape": "sphere", "radius": 0.3, "segments": [96, 48], "translate": [0.6, 0.5, 0.3],
         "material": {"base_color": [0.8, 0.2, 0.1]}}],
    "animation": [{"object": name, "channel": "translate", "keys": [[0, x, 0.5, 0], [5, x, 0.9, 0], [10, x, 0.5, 0]]}
                  for name, x in [("chrome", -0.6), ("ball", 0.6)]],
    "environment": {"type": "constant", "color": [0.6, 0.7, 0.8]},
}
PATH = {"frames": FRAMES, "fps": 30, "fov": 50, "orbit": {"center": [0, 0.5, 0], "radius": 3, "height": 1, "turns": 0.1}}


def resident(pid):
    """Bytes of a process that are in memory."""
    try:
        pages = int(pathlib.Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return None
    return pages * 4096


def growth(program, config, out):
    """MiB from frame SETTLED to the most after it, or the exit code and the messages of a run that failed."""
    process = subprocess.Popen([program, "render", str(config), "--out", str(out), "-q"], text=True,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    done = out / "frames.jsonl"
    settled = last = None
    while process.poll() is None:
        frames = done.read_bytes().count(b"\n") if done.exists() else 0
        now = resident(process.pid)
        if now and SETTLED <= frames < FRAMES:  # its tables are made afterwards
            settled = settled if settled is not None else now
            last = max(last or 0, now)
        time.sleep(0.02)
    errors = process.stderr.read()
    if process.returncode != 0 or settled is None or frames < FRAMES - SETTLED // 2:
        return f"exit {process.returncode}, {frames} frames were seen\n{errors}"
    return (last - settled) / 2**20


def growths(program, folder):
    """The number of runs whose memory grows."""
    methods = method_list.Methods(program)
    (folder / "scene.json").write_text(json.dumps(SCENE))
    (folder / "path.json").write_text(json.dumps(PATH))
    runs = {m["method"]: m for m in methods.configured()}
    runs |= {f"traced, {policy}": {"method": "traced", "bvh": policy} for policy in POLICIES}
    faults = 0
    for name, method in runs.items():
        config = folder / "config.json"
        config.write_text(json.dumps({
            "scene": "scene.json", "path": "path.json", "preview": {"enabled": False}, "methods": [method],
            "image": {"width": 24, "height": 24, "samples": 1}}))
        grown = growth(program, config, folder / name.replace(", ", "_"))
        fault = isinstance(grown, str) or grown > GROWTH
        faults += fault
        print(f"{name}: {grown if isinstance(grown, str) else f'{grown:.1f} MiB'}{' FAULT' if fault else ''}")
    return faults


def peak(program, config, out):
    """The most bytes of a run that were in memory, or the exit code and the messages of one that failed."""
    with open(out.with_suffix(".txt"), "w+") as errors:
        process = subprocess.Popen([program, "render", str(config), "--out", str(out), "--no-tables", "-q"],
                                   stdout=subprocess.DEVNULL, stderr=errors)
        _, status, usage = os.wait4(process.pid, 0)
        code = process.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        return usage.ru_maxrss * 1024 if code == 0 else f"exit {code}\n{errors.read()}"


def frames(path, method):
    count = json.loads(path.read_text())["frames"]
    return f"1-{count}x{math.ceil(count / 30)}" if method in KEEPS else "1-2"


def peaks(program, folder, scene, methods):
    """The number of methods whose peak in a scene is far from what `plan` says."""
    place, image = memory_scenes.SCENES[scene]
    (folder / scene).mkdir()
    file, path = place(folder / scene)
    faults = 0
    for name in methods:
        config = folder / scene / "config.json"
        config.write_text(json.dumps({"scene": str(file), "path": str(path), "frames": frames(path, name), "image": image,
                                      "methods": [{"method": name, **OPTIONS.get(name, {})}]}))
        done = subprocess.run([program, "plan", str(config), "--json", "-q"], check=True, capture_output=True)
        planned = json.loads(done.stdout)["methods"][0]["memory_bytes"]
        most = peak(program, config, folder / scene / name)
        share = most / planned if isinstance(most, int) else math.nan
        fault = not LEAST_SHARE <= share <= LARGEST_SHARE
        faults += fault
        print(f"{scene:14} {name:16} planned {planned / 1e6:7.1f} MB, peak " +
              (f"{most / 1e6:7.1f} MB, {share:4.2f}" if isinstance(most, int) else most) + (" FAULT" if fault else ""),
              flush=True)
        shutil.rmtree(folder / scene / name, ignore_errors=True)
    return faults


def refusal(program, folder):
    """1 unless a run that cannot fit ends with exit code 8 before it begins, and names what to lower."""
    (folder / "scene.json").write_text(json.dumps(SCENE))
    (folder / "large.json").write_text(json.dumps({"scene": "scene.json", "image": {"width": 8192, "height": 8192},
                                                   "methods": ["traced"]}))
    limit = 2 << 30
    done = subprocess.run([program, "render", str(folder / "large.json"), "--out", str(folder / "large")], text=True,
                          capture_output=True, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
    refused = done.returncode == 8 and "image.samples" in done.stderr and not (folder / "large").exists()
    if not refused:
        print(f"a frame beyond the limit of memory: exit {done.returncode}, not 8 FAULT\n{done.stderr}")
    return 0 if refused else 1


def main(program, work, scenes=None, chosen=None):
    folder = work_folder.fresh(work)
    names = method_list.Methods(program).names
    if scenes:
        cases = [(scene, chosen and chosen.split(",")) for scene in scenes.split(",")]
    else:
        cases = [(scene, None) for scene in memory_scenes.SCENES] if LONG else SAMPLE
    faults = 0 if scenes else growths(program, folder) + refusal(program, folder)
    faults += sum(peaks(program, folder, scene, methods or names) for scene, methods in cases)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], pathlib.Path(sys.argv[2]), *sys.argv[3:]))

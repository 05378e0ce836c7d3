#!/usr/bin/env python3
"""Measures on this machine how far ratios of times can be trusted.

    tests/same_twice.py [--pairs 20] [--slower 0,2,5] [--load [SEED]] [--out out/same_twice]

Each pair is a `sweep` of one setting twice: two processes of the same program. Then every time of the second
one is made longer by a few percent, in the samples that were kept, and the sweep is evaluated again: what its
interval must hold is known. For each clock the last lines say how many of the 95 % intervals hold the truth,
how far the ratios are off (median), and how often the second setting was found to be slower, unclear, or
taken the wrong way.

--load runs another program beside it that comes and goes: a loop on one processor, for 0.2 to 4 seconds, then
nothing for as long, as SEED has it (1). Pairs stay in the folder --out: what was interrupted goes on there, and
pairs that are known are not measured again (name another folder for another program or load)."""
import argparse
import json
import os
import pathlib
import random
import shutil
import signal
import statistics
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
LOAD_SECONDS = (0.2, 4.0)


def come_and_go(seed, parent):
    """Until the process that started it has ended."""
    chance = random.Random(seed)
    while os.getppid() == parent:
        end = time.monotonic() + chance.uniform(*LOAD_SECONDS)
        while time.monotonic() < end:
            pass
        time.sleep(chance.uniform(*LOAD_SECONDS))


def measure_pair(arguments, pair, folder):
    methods = json.dumps([{"method": arguments.method, "name": name} for name in ("a", "b")])
    command = [arguments.program, "sweep", arguments.config, "--set", f"methods={methods}", "--set", "errors.against=[]",
               "--against", "a", "--set", f"image.width={arguments.size}", "--set", f"image.height={arguments.size}",
               "--frames", arguments.frames, "--time", arguments.time, "--seed", str(pair), "-q", "--method", "a,b", "--out", str(folder),
               "--existing", "resume"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return command


def evaluate(command, folder, percent):
    """Ratio and interval of the second setting by clock, once it has been made slower."""
    own = folder / "slower"
    shutil.rmtree(own, ignore_errors=True)
    shutil.copytree(folder, own)
    (samples,) = (own / "samples").glob("*.csv")
    header, *lines = samples.read_text().splitlines()
    rows = [line.split(",") for line in lines]
    second = json.loads((folder / "sweep.json").read_text())["points"][1]["key"]
    for row in rows:
        if row[2] == second:
            row[4:6] = (repr(float(time) * (1 + percent / 100)) for time in row[4:6])
    samples.write_text("\n".join([header, *(",".join(row) for row in rows)]) + "\n")
    measured = {}
    for clock in ("wall", "cpu"):
        subprocess.run([own if word == str(folder) else word for word in command] + ["--clock", clock], check=True,
                       capture_output=True, text=True)
        point = json.loads((own / "sweep.json").read_text())["points"][1]
        measured[clock] = (point["ratio"], *point["ratio_interval"])
    shutil.rmtree(own)
    return measured


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--slower", default="0,2,5", help="percent, with commas")
    parser.add_argument("--load", type=int, nargs="?", const=1, metavar="SEED",
                        help="beside another program that comes and goes as a random sequence from SEED (1) has it")
    parser.add_argument("--out", default="out/same_twice", type=pathlib.Path, help="where pairs are kept")
    parser.add_argument("--program", default=str(ROOT / "build/release/bin/catoptric"))
    parser.add_argument("--config", default=str(ROOT / "configs/cornell_box.json"))
    parser.add_argument("--method", default="second_order")
    parser.add_argument("--frames", default="1-8")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--time", default="steady", help="as for sweep: with first and mean, builds are included")
    arguments = parser.parse_args()
    slower = [float(percent) for percent in arguments.slower.split(",")]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))  # ends the sweep, too
    if arguments.load is not None and not (child := os.fork()):
        come_and_go(arguments.load, os.getppid())
        os._exit(0)
    commands = {}
    for pair in range(1, arguments.pairs + 1):
        start = time.monotonic()
        commands[pair] = measure_pair(arguments, pair, arguments.out / str(pair))
        print(f"pair {pair}: {time.monotonic() - start:.1f} s", flush=True)
    if arguments.load is not None:
        os.kill(child, 9)
    measured = {}
    for percent in slower:
        for pair, command in commands.items():
            for clock, found in evaluate(command, arguments.out / str(pair), percent).items():
                measured.setdefault((percent, clock), []).append(found)
                ratio, low, high = found
                print(f"{pair}: {percent:g} % slower, {clock}: {ratio:.4f} ({low:.4f} to {high:.4f})", flush=True)
    for (percent, clock), pairs in measured.items():
        truth = 1 + percent / 100
        holding = sum(low <= truth <= high for _, low, high in pairs)
        off = statistics.median(abs(ratio / truth - 1) for ratio, _, _ in pairs)
        found, wrong = sum(low > 1 for _, low, _ in pairs), sum(high < 1 for _, _, high in pairs)
        print(f"{percent:g} % slower, {clock} clock: {holding} of {len(pairs)} intervals hold the truth; off by {100 * off:.2f} % "
              f"(median); slower {found}, unclear {len(pairs) - found - wrong}, faster {wrong}")


if __name__ == "__main__":
    main()

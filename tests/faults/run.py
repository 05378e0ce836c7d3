#!/usr/bin/env python3
"""Lets calls of the program fail (preload.cpp) in every command, and prints a table: the exits of each command by each
fault. No fault may end in a signal, an exit that the table ALLOWED does not have, or no message.
A sample of the calls; with CATOPTRIC_LONG=1 many more.
Usage: run.py PROGRAM LIBRARY WORK_FOLDER [--only COMMAND]; exit 1 and a line for each wrong exit."""
import collections
import os
import pathlib
import random
import shutil
import struct
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

sys.dont_write_bytecode = True
sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
import small_project  # noqa: E402
import work_folder  # noqa: E402

LONG = os.environ.get("CATOPTRIC_LONG") == "1"
TIMEOUT = 120
PROCESSORS = 2  # as tests/CMakeLists.txt says
STATIC = 200  # allocations before main(), about

# Kinds of preload.cpp, in its order: which exits are allowed beside 0 (the program went on without), and whether all later
# calls fail, too. Frames that fail are exit 6, for want of memory 8; a night whose cases fail has crashes: 6.
Fault = collections.namedtuple("Fault", "name allowed lasting")
FAULTS = [
    Fault("allocation", {6, 8}, False),
    Fault("GL out of memory", {6, 8}, False),
    Fault("GL error", {6, 70}, False),  # 70: an invalid operation is a bug of ours
    Fault("write", {5, 6}, True),
    Fault("mkdir", {5, 6}, True),
    Fault("create a file", {5, 6}, True),
    Fault("fork", {6, 8}, True),
    Fault("SQLite busy", {5}, True),
]
ALSO = {("doctor", "fork"): {4}}
USUAL = {"status": 6}  # tasks that were not started; otherwise 0

COMMANDS = {
    "render": "render run.json --out new",
    "render --existing overwrite": "render run.json --out run --existing overwrite",
    "compare": "compare run/traced run/truth --out new",
    "sweep": "sweep run.json --method traced --vary threads=1,2 --frames 1 --repeats 1 --out new --progress none",
    "tune": "tune run.json --method truth --against truth --max-error L1_8bit<=9 --vary methods.truth.samples=1,2 --frames 1 "
            "--repeats 1 --out new --progress none",
    "tables": "tables t.suite.json --effort smoke --out new --progress none",
    "figure": "figure run/traced --frame 1 --out new.png",
    "layers": "layers run/traced --out new",
    "nightly": "nightly n.suite.json --history h/history.db --html page --progress none",
    "nightly accept": "nightly accept * --reason r --history h/history.db",
    "submit": "submit run.json --chunks 2 --to script --out new",
    "status": "status submitted",
    "merge": "merge part1 part2 --out new",
    "plan": "plan run.json",
    "info": "info scene.json",
    "list": "list",
    "doctor": "doctor",
}
BEFORE = ["render run.json --out run", "render run.json --chunk 1/2 --out part1", "render run.json --chunk 2/2 --out part2",
          "submit run.json --chunks 2 --to script --out submitted",
          "nightly n.suite.json --history h/history.db --progress none"]


class Counts:
    """The file that preload.cpp shares: kind, first and last call that fails; calls of each kind."""
    LAYOUT = f"3q{len(FAULTS)}q"

    def __init__(self, path):
        self.path = path
        path.write_bytes(struct.pack(self.LAYOUT, -1, 0, 0, *[0] * len(FAULTS)))

    def choose(self, kind, first, lasting):
        last = 2 ** 62 if lasting else first
        self.path.write_bytes(struct.pack(self.LAYOUT, kind, first, last, *[0] * len(FAULTS)))

    def calls(self):
        return struct.unpack(self.LAYOUT, self.path.read_bytes())[3:]


def run(program, folder, arguments, extra=()):
    environment = dict(os.environ, CATOPTRIC_CACHE=str(folder / "cache"), MESA_SHADER_CACHE_DISABLE="true", **dict(extra))
    try:
        return subprocess.run([program, *arguments.split()], cwd=folder, capture_output=True, text=True, timeout=TIMEOUT,
                              env=environment, errors="replace")
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(arguments, -999, "", "it did not end")


def prepare(program, folder):
    folder.mkdir()
    (folder / "cache").mkdir()
    small_project.write(folder, frames=2, night_frames="1", width=24)
    for command in BEFORE:
        done = run(program, folder, command)
        if done.returncode != 0:
            sys.exit(f"without faults `{command}` ended with {done.returncode}: {done.stderr}")


class Walk:
    def __init__(self, program, library, work):
        self.program, self.library, self.work = program, library, work
        self.base = work / "base"
        prepare(program, self.base)
        # Static objects and the list of methods: nobody catches what their making throws, and GCC 12 then frees what
        # it has not made yet.
        self.begin = self.one("begin", "list methods", None, 0)[1][0]
        self.exits = collections.defaultdict(collections.Counter)  # by command and fault
        self.wrong = []

    def one(self, number, command, kind, first):
        """The command in a copy of its folder; its exit, its messages, and how many calls there were."""
        folder = self.work / str(number)
        shutil.copytree(self.base, folder)
        counts = Counts(self.work / f"{number}.faults")
        if kind is not None:
            counts.choose(kind, first, FAULTS[kind].lasting)
        done = run(self.program, folder, COMMANDS.get(command, command),
                   {"LD_PRELOAD": self.library, "CATOPTRIC_FAULTS": str(counts.path)}.items())
        calls = counts.calls()
        shutil.rmtree(folder, ignore_errors=True)
        counts.path.unlink()
        return done, calls

    def places(self, command, calls):
        """(kind, number of the call) to try: first and last one, and others by chance."""
        chance = random.Random(command)
        for kind, fault in enumerate(FAULTS):
            count = calls[kind]
            if count == 0:
                continue
            begin = 1
            if fault.name == "allocation":
                begin = self.begin if count > self.begin else STATIC
            many = (200 if fault.name == "allocation" else 25) if LONG else 2
            if count - begin < many:
                chosen = set(range(begin, count + 1))
            elif LONG:
                chosen = {begin, count} | {chance.randrange(begin, count + 1) for _ in range(many)}
            else:
                chosen = {1 if fault.lasting else chance.randrange(begin, count + 1)}
            yield from ((kind, first) for first in sorted(chosen))

    def judge(self, command, kind, first, done):
        fault = FAULTS[kind]
        self.exits[command, fault.name][done.returncode] += 1
        allowed = {USUAL.get(command, 0)} | fault.allowed | ALSO.get((command, fault.name), set())
        said = done.stderr.strip().splitlines()
        if done.returncode in allowed and (done.returncode in (0, 4) or said):  # doctor's report is data
            return
        last = said[-1] if said else "(no message)"
        self.wrong.append(f"{command}: {fault.name}, call {first}: exit {done.returncode}: {last}")

    def table(self):
        """Markdown: a row for each command, a column for each fault."""
        lines = ["| command | " + " | ".join(fault.name for fault in FAULTS) + " |", "|---" * (len(FAULTS) + 1) + "|"]
        for command in COMMANDS:
            cells = []
            for fault in FAULTS:
                exits = self.exits[command, fault.name]
                cells.append(", ".join(f"{code} x {count}" for code, count in sorted(exits.items())) or "no call")
            lines.append(f"| `{command}` | " + " | ".join(cells) + " |")
        return "\n".join(lines)


def main():
    program, library, work = sys.argv[1:4]
    only = sys.argv[5] if len(sys.argv) > 5 else None
    commands = [command for command in COMMANDS if only in (None, command)]
    walk = Walk(str(pathlib.Path(program).resolve()), str(pathlib.Path(library).resolve()), work_folder.fresh(work))
    tasks = []
    with ThreadPoolExecutor(PROCESSORS) as pool:
        for number, (command, (done, calls)) in enumerate(zip(commands, pool.map(
                lambda item: walk.one(f"free{item[0]}", item[1], None, 0), enumerate(commands)))):
            if done.returncode != USUAL.get(command, 0):
                walk.wrong.append(f"{command}: exit {done.returncode} without a fault: {done.stderr}")
            tasks += [(command, kind, first) for kind, first in walk.places(command, calls)]
        results = pool.map(lambda item: walk.one(item[0], *item[1]), enumerate(tasks))
        for (command, kind, first), (done, _) in zip(tasks, results):
            walk.judge(command, kind, first, done)
    print(walk.table())
    print(f"{len(tasks)} faults, {len(walk.wrong)} wrong exits")
    print("\n".join(walk.wrong))
    sys.exit(1 if walk.wrong else 0)


if __name__ == "__main__":
    main()

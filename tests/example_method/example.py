#!/usr/bin/env python3
"""The example method, a folder and one line, is everywhere where methods are: list, the page of methods, the schema, a
run's folder with its table and layer; and its state gives the same pixels whatever frames are asked for.
Usage: example.py SOURCE_ROOT PROGRAM WORK_FOLDER; exit 1 and a line per fault."""

import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys

METHOD = "fading"


class Example:
    def __init__(self, root, program, work):
        self.root, self.program, self.work = root, program, pathlib.Path(work)
        shutil.rmtree(work, ignore_errors=True)
        self.work.mkdir(parents=True)
        self.faults = 0

    def run(self, *command):
        return subprocess.run([self.program, *command], cwd=self.root, capture_output=True, text=True,
                              env=dict(os.environ, XDG_CACHE_HOME=str(self.work / "cache")))

    def expect(self, what, found):
        if not found:
            self.faults += 1
            print(f"fault: {what}")

    def render(self, out, *more):
        done = self.run("render", "configs/moving.json", "--method", METHOD, "--set", "image.width=48",
                        "--set", "image.height=48", "--set", 'image.layers=["history"]', "--out",
                        str(self.work / out), *more)
        self.expect(f"{out}: exit {done.returncode}: {done.stderr}", done.returncode == 0)
        return done

    def frames(self, out):
        return {p.name: p.read_bytes() for p in (self.work / out / "frames").glob("*.exr")}

    def descriptions(self):
        listed = json.loads(self.run("list", "methods", "--json").stdout)["methods"]
        self.expect("list methods", METHOD in [m["name"] for m in listed])
        self.expect("list steps", "fading, frames" in self.run("list", "steps").stdout)
        self.expect("the page of methods", f"## {METHOD}\n" in self.run("list", "methods", "--markdown").stdout)
        self.expect("the schema", "restart_every" in self.run("list", "--schema", "run").stdout)
        self.expect("the page of options", "restart_every" in
                    self.run("list", "--schema", "run", "--markdown").stdout)

    def state(self):
        self.render("whole", "--frames", "1-12")
        whole = self.frames("whole")
        self.expect("12 frames", len(whole) == 12)
        rows = list(csv.reader((self.work / "whole/histories.csv").open()))
        self.expect("its table's columns", rows[0] == ["frame", "frames", "samples", "share"])
        self.expect("a history of four frames", max(int(r[1]) for r in rows[1:]) == 4)
        for out, more in {"single": ["--frames", "7"], "steps": ["--frames", "2-12x5"],
                          "second": ["--frames", "1-12", "--chunk", "2/2"],
                          "first": ["--frames", "1-12", "--chunk", "1/2"],
                          "one_thread": ["--frames", "6-8", "--threads", "1"]}.items():
            self.render(out, *more)
            made = self.frames(out)
            self.expect(f"{out}: frames", made)
            for name, data in made.items():
                self.expect(f"{out}: {name} is that of the whole run", data == whole[name])
        done = self.run("merge", str(self.work / "first"), str(self.work / "second"), "--out",
                        str(self.work / "merged"))
        self.expect(f"merge: {done.stderr}", done.returncode == 0 and self.frames("merged") == whole)
        self.expect("the merged table", (self.work / "merged/histories.csv").read_bytes() ==
                    (self.work / "whole/histories.csv").read_bytes())
        (self.work / "whole/frames/frame.0007.exr").unlink()
        done = self.render("whole", "--frames", "1-12", "--existing", "resume", "--json")
        run = json.loads(done.stdout)["methods"][0]
        self.expect(f"re-used frames stay counted: {run}", run["rendered"] == [7] and len(run["reused"]) == 11)
        self.expect("the resumed run", self.frames("whole") == whole)

    def plans(self):
        plan = json.loads(self.run("plan", "configs/moving.json", "--method", METHOD, "--frames", "7,8,12",
                                   "--json").stdout)
        self.expect("the plan's warm-up frames", plan["methods"][0]["warm_up_frames"] == 5)
        dry = self.run("render", "configs/moving.json", "--method", METHOD, "--frames", "7", "--out",
                       str(self.work / "dry"), "--dry-run").stdout
        self.expect(f"the dry run's warm-up frames: {dry}", "warm_up" in dry and "5-6" in dry)


def main(root, program, work):
    example = Example(root, program, work)
    example.descriptions()
    example.state()
    example.plans()
    print(f"{example.faults} faults")
    return 1 if example.faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))

#!/usr/bin/env python3
"""Makes the tables of every paper and of the atlas with `--effort smoke`: small frames, figures without meaning.

Usage: papers_smoke.py SOURCE_FOLDER PROGRAM WORK_FOLDER
What a suite of configs/papers/ names - configs, methods, options, counters - is checked for all of its runs and cells.
Then its tables are made, and made again from what is there without rendering. By default only the runs of SAMPLE are
rendered, and the tables have only the rows that need no other run: cheap runs of every suite, with times and without.
The sample leaves out that the other runs' frames succeed: their scenes, paths and options with real frames. With
CATOPTRIC_LONG=1 every run is rendered. Suites whose scenes have assets that were not prepared (scripts/prepare_assets)
are left out by name; where that is so this test counts as skipped (exit code 77), unless something failed."""

import json
import os
import pathlib
import re
import subprocess
import sys
import time

sys.dont_write_bytecode = True
import work_folder  # noqa: E402

SAMPLE = {"glossy_lod": ["filter"], "impostors": ["directions", "times_shader"], "perturbation": ["fig10"],
          "reprojection": ["bath_a"], "atlas": ["one_mirror"], "second_order": ["validation_cornell_box", "concave"]}


def sampled(suite, folder):
    """A suite of the sample's runs, and of the rows that need no other one."""
    wanted = json.loads(suite.read_text())
    names = SAMPLE[suite.name.removesuffix(".suite.json")]
    for settings in (*wanted["efforts"].values(), *(run.get("settings", {}) for run in wanted["runs"].values())):
        settings.update({name: str(suite.parent / settings[name]) for name in ("scene", "path") if name in settings})
    # Slopes are of figures, which join runs
    others = re.compile(rf"\b(?:{'|'.join(set(wanted['runs']) - set(names))})\.|\bslope\(")
    wanted["runs"] = {name: {**wanted["runs"][name], "config": str(suite.parent / wanted["runs"][name]["config"])}
                      for name in names}
    for table in wanted["tables"]:
        for part in ("rows", "each"):
            if part == "rows" and part in table:
                table[part] = [row for row in table[part] if not others.search(json.dumps(row))]
            elif part in table:
                table[part] = {run: title for run, title in table[part].items() if run in names}
    wanted["tables"] = [table for table in wanted["tables"] if table.get("rows") or table.get("each")]
    for name in ("figures", "pictures", "checks"):
        wanted.pop(name, None)
    file = folder / suite.name
    file.write_text(json.dumps(wanted))
    return file


def faults_of(suite, tables, out):
    """What is wrong with a suite's tables; None where its scenes' assets are missing."""
    made = tables(suite, "--out", out)
    if made.returncode != 0 and "scenes/assets" in made.stderr and not any(pathlib.Path("scenes/assets").glob("*")):
        return None
    if made.returncode != 0:
        return [f"exit code {made.returncode}\n{made.stdout[-500:]}{made.stderr[-1500:]}"]
    faults = []
    again = tables(suite, "--out", out, "--text-only")
    if again.returncode != 0 or again.stdout != made.stdout:
        faults.append(f"--text-only: exit code {again.returncode}\n{again.stderr[-1500:]}")
    for kind in ("md", "csv", "html", "tex"):
        if "nan" in (out / f"tables.{kind}").read_text().lower().replace("nanosecond", ""):
            faults.append(f"a cell of tables.{kind} is no number")
    return faults


def main(source: pathlib.Path, program: pathlib.Path, work: pathlib.Path) -> int:
    os.chdir(source)
    work = work_folder.fresh(work)

    def tables(suite, *more):
        return subprocess.run([program, "tables", suite, "--effort", "smoke", "--progress", "none", "--format",
                               "md,csv,html,tex", *more], capture_output=True, text=True, check=False)

    failed, missing = [], []
    suites = [*sorted((source / "configs" / "papers").glob("*.suite.json")), source / "configs" / "atlas.suite.json"]
    for suite in suites:
        name = suite.name.removesuffix(".suite.json")
        start = time.monotonic()
        # All names are looked up before the first run is missed
        names = tables(suite, "--out", work / f"{name}_names", "--text-only")
        if "has not been measured with the suite's present settings" not in names.stderr:
            failed.append(f"{name}: exit code {names.returncode}\n{names.stderr[-1500:]}")
            continue
        faults = faults_of(suite if os.environ.get("CATOPTRIC_LONG") == "1" else sampled(suite, work), tables, work / name)
        if faults is None:
            missing.append(name)
            continue
        failed += [f"{name}: {fault}" for fault in faults]
        print(f"{name}: {time.monotonic() - start:.1f} s", flush=True)
    print(*failed, sep="\n")
    for name in missing:
        print(f"{name}: left out, its scenes' assets are missing")
    return 1 if failed else 77 if missing else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(a).resolve() for a in sys.argv[1:4])))

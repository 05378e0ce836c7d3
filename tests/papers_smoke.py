#!/usr/bin/env python3
"""Makes the tables of every paper with `--effort smoke`: small frames, figures without meaning.

Usage: papers_smoke.py SOURCE_FOLDER PROGRAM WORK_FOLDER
Every suite of configs/papers/ must be made, and made again from what is there without rendering. Suites whose
scenes have assets that were not prepared (scripts/prepare_assets) are left out by name; where that is so
this test counts as skipped (exit code 77), unless something failed."""

import os
import pathlib
import subprocess
import sys
import time

sys.dont_write_bytecode = True


def main(source: pathlib.Path, program: pathlib.Path, work: pathlib.Path) -> int:
    sys.path.insert(0, str(source / "scripts"))
    import work_folder

    os.chdir(source)
    work = work_folder.fresh(work)
    failed, missing = [], []
    for suite in sorted((source / "configs" / "papers").glob("*.suite.json")):
        name = suite.name.removesuffix(".suite.json")
        command = [program, "tables", suite, "--effort", "smoke", "--out", work / name, "--progress", "none",
                   "--format", "md,csv,html,tex"]
        start = time.monotonic()
        made = subprocess.run(command, capture_output=True, text=True, check=False)
        if made.returncode != 0 and "scenes/assets" in made.stderr and not any((source / "scenes" / "assets").glob("*")):
            missing.append(name)
            continue
        if made.returncode != 0:
            failed.append(f"{name}: exit code {made.returncode}\n{made.stdout[-500:]}{made.stderr[-1500:]}")
            continue
        print(f"{name}: {time.monotonic() - start:.1f} s", flush=True)
        again = subprocess.run([*command, "--text-only"], capture_output=True, text=True, check=False)
        if again.returncode != 0 or again.stdout != made.stdout:
            failed.append(f"{name}: --text-only: exit code {again.returncode}\n{again.stderr[-1500:]}")
        for kind in ("md", "csv", "html", "tex"):
            if "nan" in (work / name / f"tables.{kind}").read_text().lower().replace("nanosecond", ""):
                failed.append(f"{name}: a cell of tables.{kind} is no number")
    print(*failed, sep="\n")
    for name in missing:
        print(f"{name}: left out, its scenes' assets are missing")
    return 1 if failed else 77 if missing else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(a).resolve() for a in sys.argv[1:4])))

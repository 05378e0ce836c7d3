#!/usr/bin/env python3
"""Makes the papers' pages again from the values that are kept beside them, without rendering.

Usage: papers_pages.py SOURCE_FOLDER PROGRAM WORK_FOLDER
Each docs/papers/NAME.md with a docs/papers/NAME.values.json must come out as it is. Where it does not, a suite in
configs/papers/ or the page was changed without `catoptric tables configs/papers/NAME.suite.json --effort full
--values docs/papers/NAME.values.json --into docs/papers/NAME.md`, which measures what is not known."""

import difflib
import os
import pathlib
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
import work_folder  # noqa: E402


def main(source: pathlib.Path, program: pathlib.Path, work: pathlib.Path) -> int:
    os.chdir(source)
    work = work_folder.fresh(work)
    failed = []
    kept = sorted((source / "docs" / "papers").glob("*.values.json"))
    for values in kept:
        name = values.name.removesuffix(".values.json")
        page = values.with_name(name + ".md")
        again = work / page.name
        shutil.copy(page, again)
        shutil.copy(values, work)  # the program writes it
        made = subprocess.run([program, "tables", source / "configs" / "papers" / f"{name}.suite.json", "--effort",
                               "full", "--values", work / values.name, "--text-only", "--into", again, "--out", work / name,
                               "--progress", "none"], capture_output=True, text=True, check=False)
        if made.returncode != 0:
            failed.append(f"{name}: exit code {made.returncode}\n{made.stderr[-1500:]}")
        elif again.read_text() != page.read_text():
            failed += difflib.unified_diff(page.read_text().splitlines(), again.read_text().splitlines(),
                                           str(page), "made again", lineterm="", n=0)
    if not kept:
        failed.append("no page has values")
    print(*failed, sep="\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(a).resolve() for a in sys.argv[1:4])))

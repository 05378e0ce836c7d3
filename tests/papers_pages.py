#!/usr/bin/env python3
"""Makes the papers' pages again from the values that are kept beside them, without rendering.

Usage: papers_pages.py SOURCE_FOLDER PROGRAM WORK_FOLDER
Each docs/papers/NAME.md with a docs/papers/NAME.values.json must come out as it is, and so must its curves. Where they do
not, a suite in configs/papers/ or the page was changed without `catoptric tables configs/papers/NAME.suite.json
--effort full --values docs/papers/NAME.values.json --into docs/papers/NAME.md --pictures docs/images/NAME`, which
measures what is not known.

docs/atlas.md is made likewise, from configs/atlas.suite.json. What its table takes follows from the errors and ratios
of docs/atlas.values.json by the rule on the page.

Each page of a paper ends with a table of the paper's claims: claim, where it is shown, verdict. Tests that it names exist in the
file that the link leads to."""

import difflib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
import work_folder  # noqa: E402


VERDICTS = ("holds", "partly", "does not", "not shown: ")


def faults_of_claims(page: pathlib.Path):
    rows = page.read_text().partition("\n## The paper's claims\n")[2].partition("\n---|---|---\n")[2].splitlines()
    if not rows:
        yield f"{page}: there is no table of claims"
    for row in rows:
        cells = [cell.strip() for cell in row.split("|")]
        if len(cells) != 3 or not cells[2].startswith(VERDICTS):
            yield f"{page}: no claim, place and verdict: {row}"
        elif not cells[1] and cells[2].startswith(("holds", "partly")):
            yield f"{page}: shown nowhere: {row}"
        for suite, test, file in re.findall(r"\[`(\w+)\.(\w+)`\]\(([^)]*)\)", row):
            file = page.parent / file
            if not file.is_file() or not re.search(rf"^TEST(_[FP])?\({suite}, {test}\)", file.read_text(), re.M):
                yield f"{page}: there is no {suite}.{test} in {file}"


def faults_of_choices(file: pathlib.Path):
    """The fastest setting within the bound, if its interval says that it is faster than `traced`."""
    values = json.loads(file.read_text())["values"]
    for cell, value in values.items():
        taken = re.fullmatch(r"take\((\w+)\.\*, ([\d.]+)\)", cell)
        if not taken:
            continue
        run, most = taken[1], float(taken[2])
        surely, perhaps = {"traced": 1.0}, {"traced": 1.0}
        for name, ratio in values.items():
            of = re.fullmatch(rf"ratio\({run}\.(.+), {run}\.traced\)", name)
            high = re.search(r" to ([\d.]+)\)", ratio["text"])
            if not of or not high or of[1] == "traced":
                continue
            error, flicker = (values[f"error({run}.{of[1]}, {measure})"].get("value", 0.0)
                              for measure in ("L1_8bit", "flicker"))
            if error > most or flicker > 4 * most or float(high[1]) > 1.0:
                continue
            perhaps[of[1]] = ratio["value"]
            if float(high[1]) < 1.0:  # 1.00 may be rounded
                surely[of[1]] = ratio["value"]
        name = value["text"].split(" ")[0]
        if perhaps.get(name, 9.0) > min(surely.values()):
            yield f"{file}: {cell} is {value['text']}, expected {min(surely, key=surely.get)}"


def main(source: pathlib.Path, program: pathlib.Path, work: pathlib.Path) -> int:
    os.chdir(source)
    work = work_folder.fresh(work)
    failed = []
    kept = sorted((source / "docs").glob("**/*.values.json"))
    for values in kept:
        name = values.name.removesuffix(".values.json")
        page = values.with_name(name + ".md")
        suite = source / "configs" / values.parent.relative_to(source / "docs") / f"{name}.suite.json"
        failed += faults_of_claims(page) if values.parent.name == "papers" else faults_of_choices(values)
        again, charts = work / page.name, work / f"{name}_charts"
        shutil.copy(page, again)
        shutil.copy(values, work)  # the program writes it
        made = subprocess.run([program, "tables", suite, "--effort", "full", "--values", work / values.name, "--text-only",
                               "--into", again, "--out", work / name, "--pictures", charts, "--progress", "none"],
                              capture_output=True, text=True, check=False)
        if made.returncode != 0:
            failed.append(f"{name}: exit code {made.returncode}\n{made.stderr[-1500:]}")
            continue
        if again.read_text() != page.read_text():
            failed += difflib.unified_diff(page.read_text().splitlines(), again.read_text().splitlines(),
                                           str(page), "made again", lineterm="", n=0)
        for chart in sorted(charts.glob("*.svg")):
            kept_chart = source / "docs/images" / name / chart.name
            if not kept_chart.is_file() or kept_chart.read_text() != chart.read_text():
                failed.append(f"{kept_chart}: is not what the values make; --pictures draws it")
    if not kept:
        failed.append("no page has values")
    print(*failed, sep="\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(a).resolve() for a in sys.argv[1:4])))

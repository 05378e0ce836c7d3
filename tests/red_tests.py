#!/usr/bin/env python3
"""tests/red_tests.py [--build build/release]   explains the tests that failed in ctest's last run, then prints ctest's summary.

For each failed test it prints the end of its output, the pictures that the output names, the folder with its files,
what docs/red_test.md says of it, and the command that runs it alone. It reads tests.xml (ctest --output-junit) in the
build folder, and the summary from the log that scripts/stage has written."""
import argparse
import fnmatch
import pathlib
import re
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = "docs/red_test.md"
MOST_LINES = 25  # of a test's output
PICTURE = re.compile(r"[\w./-]+\.(?:png|exr)\b")


def rows():
    """The rows of the page's table: names or patterns of tests, what red means, where to look."""
    for line in (ROOT / PAGE).read_text().splitlines():
        cells = line.strip().strip("|").split(" | ")
        if line.startswith("| `") and len(cells) == 3:
            yield re.findall(r"`([^`]+)`", cells[0]), *(cell.strip() for cell in cells[1:])


def row_of(name):
    """What the page says of a test: the row with its name, else with a pattern that fits; and the anchor."""
    plain = re.sub(r"\.(surfaceless|osmesa)$", "", name)
    for wanted, fits in ((plain, str.__eq__), (name, fnmatch.fnmatch), (plain, fnmatch.fnmatch)):
        for names, means, where in rows():
            if any(fits(wanted, known) for known in names):
                link = re.search(r"\]\((#[\w-]+)\)", means + where)
                return means, where, link[1] if link else "#what-each-family-means"
    return "", "", ""


def important(output):
    """The failures of a GoogleTest program, else the end of the output."""
    lines = output.rstrip().splitlines()
    failures = [i for i, line in enumerate(lines) if re.search(r":\d+: Failure$", line)]
    shown, end = [], 0
    for i in failures:
        end = next((j for j in range(i + 1, len(lines)) if lines[j].startswith("[") or j in failures), len(lines))
        shown += lines[i:end]
    return shown[:MOST_LINES] if failures else lines[-MOST_LINES:]


def explain(build, case):
    name = case.get("name")
    output = case.findtext("system-out") or ""
    means, where, anchor = row_of(name)
    print(f"\nRED {name} ({float(case.get('time', 0)):.0f} s)")
    print(*("    " + line[:400] for line in important(output)), sep="\n")
    pictures = sorted({p for p in PICTURE.findall(output) if (ROOT / p).is_file()})
    print(*(f"  picture: {picture}" for picture in pictures), sep="\n", end="\n" if pictures else "")
    if (work := build / "tests" / name).is_dir():
        print(f"  its files: {work}")
    if means:
        print(f"  red means: {means}\n  where to look: {where}")
    print(f"  page: {PAGE}{anchor}\n  alone: ctest --test-dir {build} --output-on-failure -R '^{name}$'")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default="build/release")
    parser.add_argument("--log", type=pathlib.Path, default="build/log/tests.log")
    arguments = parser.parse_args()
    build = arguments.build
    results = ROOT / build / "tests.xml"
    for case in xml.etree.ElementTree.parse(results).iter("testcase") if results.exists() else []:
        if case.get("status") == "fail":
            explain(build, case)
    log = (ROOT / arguments.log).read_text(errors="replace")
    summary = re.search(r"^\d+% tests passed.*", log, re.MULTILINE | re.DOTALL)
    print("", summary[0].rstrip() if summary else log[-3000:], sep="\n")


if __name__ == "__main__":
    main()

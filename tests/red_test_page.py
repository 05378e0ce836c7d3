#!/usr/bin/env python3
"""docs/red_test.md names every test that is no GoogleTest program, and only files that exist.

Usage: red_test_page.py SOURCE_ROOT; exit 1 and a line per fault."""

import pathlib
import re
import sys

FOLDERS = ("src/", "bench/", "tests/", "scripts/", "docs/", "cmake/")


def main(root: pathlib.Path) -> int:
    page = (root / "docs" / "red_test.md").read_text()
    faults = []
    tests = set()
    for lists in (*root.glob("src/**/CMakeLists.txt"), *root.glob("tests/**/CMakeLists.txt")):
        text = re.sub(r"#.*", "", lists.read_text())
        tests.update(re.findall(r"add_test\(NAME\s+([\w.]+)[\s)]", text))
    for name in sorted(tests):
        if not re.search(rf"\b{name}\b", page):
            faults.append(f"docs/red_test.md does not say what to do when the test {name} is red")
    for quoted in re.findall(r"`([^`\n]+)`", page):
        path = quoted.split()[0]
        if path.startswith(FOLDERS) and not re.search(r"[A-Z]{4}", path) and not (root / path).exists():
            faults.append(f"docs/red_test.md names {path}, which is not there")
    for fault in faults:
        print(fault)
    print(f"{len(tests)} tests looked for, {len(faults)} faults")
    return 1 if faults or len(tests) < 10 else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))

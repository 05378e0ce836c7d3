#!/usr/bin/env python3
"""Runs the commands that README.md, or another page, quotes in its ```sh blocks, in their order.

Usage: readme_commands.py SOURCE_ROOT PROGRAM WORK_FOLDER [PAGE]
`catoptric` stands for PROGRAM, `out/` for WORK_FOLDER. The two commands that install and build
(scripts/demo, scripts/test) are only checked to exist: this test runs inside the second one.
A command that fails, or a README without commands, fails the test.
"""

import pathlib
import re
import shlex
import subprocess
import sys

sys.dont_write_bytecode = True
import work_folder  # noqa: E402


def commands(readme: str):
    for block in re.findall(r"^```sh\n(.*?)^```", readme, re.M | re.S):
        joined = block.replace("\\\n", " ")
        for line in joined.splitlines():
            line = line.split("  #")[0].strip()
            if line and not line.startswith("#"):
                yield line


def main(root: pathlib.Path, program: str, work: pathlib.Path, page: str = "README.md") -> int:
    work = work_folder.fresh(work)
    ran = 0
    failed = 0
    for line in commands((root / page).read_text()):
        script = shlex.split(line)[0]
        if script in ("scripts/demo", "scripts/test"):
            if not (root / script).exists():
                print(f"FAILED: {script} does not exist")
                failed += 1
            continue
        if line.startswith(("export PATH", "sudo ", "cpack", "cmake --install")):
            continue
        command = re.sub(r"\bout/", f"{work}/", line)
        command = re.sub(r"^catoptric\b", shlex.quote(program), command)
        print("$", line, flush=True)
        result = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=root,
                                stdin=subprocess.DEVNULL, timeout=600)
        ran += 1
        if result.returncode != 0:
            print(f"FAILED with exit code {result.returncode}: {line}")
            failed += 1
    print(f"{ran - failed} passed, {failed} failed")
    return 1 if failed or ran == 0 else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]), sys.argv[2], pathlib.Path(sys.argv[3]), *sys.argv[4:]))

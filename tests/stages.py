#!/usr/bin/env python3
"""What a person sees of a test run: scripts/stage shows a line, keeps the output and prints what failed; tests/red_tests.py
explains a failed test; scripts/lint finds the sources that a changed header concerns.
Usage: stages.py SOURCE_ROOT WORK_FOLDER"""

import importlib.machinery
import importlib.util
import pathlib
import subprocess
import sys
import unittest

sys.dont_write_bytecode = True
ROOT, WORK = (pathlib.Path(a).resolve() for a in sys.argv[1:3])
import work_folder  # noqa: E402

RESULTS = """<testsuite><testcase name="golden" time="3" status="fail"><system-out>{lines}
wanted, see {picture}</system-out></testcase>
<testcase name="raster_test.osmesa" time="1" status="fail"><system-out>[ RUN      ] A.B
a_test.cpp:7: Failure
1 is not 2
[  FAILED  ] A.B</system-out></testcase>
<testcase name="core_test" time="1" status="run"/></testsuite>"""


def script(name):
    """A script without a suffix, as a module."""
    loader = importlib.machinery.SourceFileLoader(name, str(ROOT / "scripts" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


class Stage(unittest.TestCase):
    def run_stage(self, command, *options):
        return subprocess.run([ROOT / "scripts/stage", *options, "stage_of_test", "sh", "-c", command],
                              capture_output=True, text=True)

    def test_success_is_a_line(self):
        done = self.run_stage("echo '[1/2] a'; echo '[2/2] b'; echo 'all is well'")
        self.assertEqual(done.returncode, 0)
        self.assertEqual(done.stdout.splitlines()[-1], "stage_of_test: 0 s (all is well)")
        self.assertIn("[1/2] a", (ROOT / "build/log/stage_of_test.log").read_text())

    def test_failure_is_explained(self):
        done = self.run_stage("echo '[1/2] a'; echo 'x.cpp:3: error' >&2; exit 7")
        self.assertEqual(done.returncode, 7)
        self.assertIn("build/log/stage_of_test.log", done.stdout)
        self.assertEqual(done.stdout.splitlines()[-1], "x.cpp:3: error")
        self.assertNotIn("[1/2] a", done.stdout)
        self.assertNotIn("error", self.run_stage("echo error; exit 7", "--no-output").stdout)

    def test_what_is_left(self):
        stage = script("stage")
        line = stage.Line("build", {})
        line.terminal, line.start = True, line.start - 60
        shown = []
        line.show = lambda text, unfinished: shown.append(text)
        line.count(stage.COUNTED.match("[20/60] Building x"))
        line.costs, line.done = {"long": 60, "short": 20}, 0.0
        line.count(stage.COUNTED.match(" 1/2 Test  #5: long .....   Passed    9.00 sec"))
        self.assertEqual(shown, ["20 of 60, about 2 minutes left", "1 of 2, less than a minute left"])
        self.assertEqual([stage.words(s) for s in (7, 185, 3720)], ["7 s", "3 min 05 s", "1 h 02 min"])


class RedTests(unittest.TestCase):
    def test_a_failure_ends_with_its_page(self):
        build = work_folder.fresh(WORK / "red")
        picture = build / "difference.png"
        picture.write_bytes(b"")
        lines = "\n".join(f"line {i}" for i in range(100))
        (build / "tests.xml").write_text(RESULTS.format(lines=lines, picture=picture))
        (build / "tests.log").write_text("...\n33% tests passed, 2 tests failed out of 3\nend\n")
        said = subprocess.run([ROOT / "tests/red_tests.py", "--build", build, "--log", build / "tests.log"],
                              capture_output=True, text=True, check=True).stdout
        for text in ("RED golden", "line 99", f"picture: {picture}", "docs/red_test.md#a-golden-frame", "RED raster_test.osmesa",
                     "1 is not 2", "OpenGL draws something else", "docs/red_test.md#what-each-family-means"):
            self.assertIn(text, said)
        for text in ("line 9\n", "RUN", "core_test"):
            self.assertNotIn(text, said)
        self.assertTrue(said.endswith("33% tests passed, 2 tests failed out of 3\nend\n"))


class Lint(unittest.TestCase):
    def test_who_includes_a_header(self):
        lint = script("lint")
        header = lint.concerned(["src/report/table.h", "README.md"])
        self.assertTrue(header and set(header) < set(lint.sources()))
        self.assertIn("src/report/table.cpp", header)
        self.assertEqual(lint.concerned(["src/app/main.cpp"]), ["src/app/main.cpp"])
        self.assertEqual(lint.concerned(["docs/red_test.md"]), [])
        self.assertEqual(sorted(lint.concerned([".clang-tidy"])), sorted(lint.sources()))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])

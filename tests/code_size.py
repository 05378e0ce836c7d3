#!/usr/bin/env python3
"""scripts/code_size finds functions and counts their lines as clang-tidy does, whatever else has braces.
Usage: code_size.py SOURCE_ROOT; exit 1 and a line per fault."""

import pathlib
import runpy
import sys

SCRIPT = pathlib.Path(__file__).resolve().parent.parent / "scripts" / "code_size"
functions = runpy.run_path(str(SCRIPT))["functions"]

CPP = r'''
namespace a {
struct B : C<int> {
  B() : x_{1}, y_(2) {
    f();
  }
  int x_ = 0; bool operator()(int a) const { return a > 0; }
  std::vector<int> list{1, 2};
};
const std::vector<int> kTable = {
    1,
    [](int i) {
      return i;
    }(2)};
template <typename T>
auto long_one(T t, Options o = {}) -> int {
  const char* s = "{{{";  // }
  const char* r = R"({{
    not a brace)";
  char c = '{'; int million = 1'000'000;
#if defined(X)
  if (t) {
#else
  if (!t) {
#endif
    g();
  }
}
TEST(A, B) {
  x();
}
}  // namespace a
'''
EXPECTED = [(2, "B"), (0, "operator()"), (12, "long_one"), (2, "TEST(A, B)")]
PYTHON = "class A:\n  def f(self):\n    a = 1\n    return a\n\ndef g(): pass\n"


def main(root):
    faults = 0
    found = [(lines, name) for lines, name, _ in functions("a.cpp", CPP)]
    if found != EXPECTED:
        faults += 1
        print(f"C++: {found}, expected {EXPECTED}")
    found = sorted((lines, name) for lines, name, _ in functions("a.py", PYTHON))
    if found != [(0, "g"), (2, "f")]:
        faults += 1
        print(f"Python: {found}")
    # Of a real shader, whose functions have no classes around them
    shader = pathlib.Path(root, "src/raster/shaders/shading.glsl")
    if len(functions(str(shader), shader.read_text())) < 3:
        faults += 1
        print(f"{shader}: hardly any function is found")
    print(f"{faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))

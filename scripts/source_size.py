"""Functions and their lengths in C++, GLSL and Python, for scripts/code_size. Lines are counted as clang-tidy's
readability-function-size does: from the line of the opening brace to the line of the closing one."""
import ast
import re

SCOPE = re.compile(r"\bnamespace\b|\bextern\s*\"|\b(?:class|struct|union)\b[^()=]*$")
TYPE = re.compile(r"\b(?:class|struct|union)\b")
INITIALISERS = re.compile(r"\)\s*(?:noexcept\b[^:]*)?:(?!:)")
TOKENS = re.compile(r"""
    R"(?P<mark>[^()\s\\]*)\(.*?\)(?P=mark)" | //[^\n]* | /\*.*?\*/ | "(?:\\.|[^"\\\n])*"
    | (?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])+'""", re.S | re.X)


def blanked(text):
    """The text without what comments and literals say; every line stays where it is."""
    def blank(match):
        found = match.group()
        lines = "\n" * found.count("\n")
        return lines if found.startswith("/") else '""' + lines
    return TOKENS.sub(blank, text)


def head_kind(head):
    """What a brace opens whose statement so far is `head`, outside functions: scope, function, member or value."""
    head = re.sub(r"\btemplate\s*<[^{}]*?>(?=\s)", " ", " ".join(head.split()))
    plain = re.sub(r"\boperator\s*(?:\(\)|[^\s\w(]+)", "operator", head)
    if SCOPE.search(head) and not re.search(r"\)\s*(?:const|noexcept|override|->.*)?\s*$", plain):
        return "scope"
    outside = re.sub(r"\([^()]*\)", "()", plain)
    while outside != (inner := re.sub(r"\([^()]*\)", "", outside)):
        outside = inner
    if "(" not in head or re.search(r"(?<![=<>!])=(?!=)", outside) or re.match(r"enum\b", head):
        return "value"
    if INITIALISERS.search(plain) and re.search(r"[\w>]$", head):
        return "member"
    return "function"


def function_name(head):
    head = " ".join(head.split())
    test = re.search(r"\b(TEST\w*|TYPED_TEST\w*|BENCHMARK\w*)\s*\(([^)]*)\)", head)
    if test:
        return f"{test.group(1)}({test.group(2).strip()})"
    names = re.findall(r"((?:[\w~]+(?:<[^<>()]*>)?::)*(?:operator\s*(?:\(\)|[^\s\w(]+)|~?\w+))\s*\(", head)
    return names[0] if names else head[-40:]


class BraceScanner:
    """Finds functions by braces alone: no header is read, no macro expanded. The branches of #if are
    alternatives, so each starts at the depth at which the first did."""

    def __init__(self):
        self.found = []   # (lines, name, first line)
        self.stack = []   # per open brace: (kind, name, line)
        self.head = ""
        self.parens = 0
        self.opaque = 0   # braces inside parentheses, values and functions
        self.branches = []

    def state(self):
        return list(self.stack), self.head, self.parens, self.opaque

    def restore(self, state):
        self.stack, self.head, self.parens, self.opaque = list(state[0]), *state[1:]

    def directive(self, line):
        if re.match(r"\s*#\s*if", line):
            self.branches.append(self.state())
        elif re.match(r"\s*#\s*el", line) and self.branches:
            self.restore(self.branches[-1])
        elif re.match(r"\s*#\s*endif", line) and self.branches:
            self.branches.pop()

    def open(self, number):
        if self.opaque or self.parens:
            self.opaque += 1
            return
        kind = head_kind(self.head)
        if kind in ("value", "member"):
            self.opaque = 1
            self.stack.append((kind, "", number))
        elif kind == "function":
            self.opaque = 1
            self.stack.append((kind, function_name(self.head), number))
        else:
            self.stack.append((kind, "", number))
            self.head = ""

    def close(self, number):
        if self.opaque:
            self.opaque -= 1
            if self.opaque or self.parens:
                return
            kind, name, first = self.stack.pop()
            if kind == "function":
                self.found.append((number - first, name, first))
                self.head = ""
            else:
                self.head += "{}"
        elif self.stack:
            self.stack.pop()
            self.head = ""

    def character(self, c, number):
        if c == "{":
            self.open(number)
        elif c == "}":
            self.close(number)
        elif not self.opaque:
            if c == ";" and self.parens == 0:
                self.head = ""
                return
            self.parens += (c == "(") - (c == ")")
            self.head += c

    def scan(self, text):
        continued = False
        for number, line in enumerate(blanked(text).split("\n"), 1):
            directive = continued or re.match(r"\s*#", line)
            continued = bool(directive) and line.endswith("\\")
            if directive:
                self.directive(line)
                continue
            for c in line:
                self.character(c, number)
            if not self.opaque:
                self.head += " "
        return self.found


def python_functions(text):
    return [(node.end_lineno - node.lineno, node.name, node.lineno) for node in ast.walk(ast.parse(text))
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]


def functions(path, text):
    """(lines, name, first line) of every function of a file."""
    if path.endswith((".cpp", ".h", ".glsl", ".frag", ".vert", ".comp")):
        return BraceScanner().scan(text)
    return python_functions(text)

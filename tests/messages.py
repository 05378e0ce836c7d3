#!/usr/bin/env python3
"""Prints the errors, warnings and notes that a user can see, with their places: PLACE: KIND: TEXT, a line each.
Expressions stand in braces. With --parts also other texts of three words or more: parts of messages that a variable
holds, reasons of plans, notes of tables, lines of results. Helps are not among them: `catoptric COMMAND --help` and
docs/config.md show these.
Usage: messages.py SOURCE_ROOT [--parts]; with --check instead it prints what it does not find of texts that must be
there; exit 1 if any."""

import pathlib
import re
import sys

TOKEN = re.compile(r"""
  (?P<raw>R"(?P<delimiter>[^\s()\\]{0,16})\((?P<rawtext>.*?)\)(?P=delimiter)")
 |(?P<string>"(?:\\.|[^"\\\n])*")
 |(?P<other>'(?:\\.|[^'\\\n])+'|\d[\w.']*|[A-Za-z_]\w*|::|->|\+=|.)
""", re.X | re.S)
SKIPPED = re.compile(r"//[^\n]*|/\*.*?\*/|(?m:^[ \t]*\#(?:[^\n]*\\\n)*[^\n]*)", re.S)
STRING_OR_SKIPPED = re.compile(r"R\"([^\s()\\]{0,16})\(.*?\)\1\"|\"(?:\\.|[^\"\\\n])*\"|" + SKIPPED.pattern, re.S)

# The function or type that makes a message of its arguments, and what it makes
CALLS = dict.fromkeys("""UsageError OutputError SceneError Error DeviceError FrameError PlatformFailure fail failAt
    failKind failEmpty refuse MixtureProblem runtime_error""".split(), "error")
CALLS |= {"warn": "warning", "note": "note"}
LOG = {"error": "error", "warning": "warning", "info": "info", "debug": "detail"}
LISTS = re.compile(r"(notes|warnings|problems|messages|failures|reasons|errors)_?$")
# Calls around texts that are help, or that no user sees
NO_MESSAGE = set("""option flag field number boolean choice integer any object numbers text schema section group table
    exec execAndGet select static_assert assert program fullScreen formulaSurface""".split())
NO_MESSAGES_IN = re.compile(r"_test\.cpp$|/test_|/testing/|_benchmark\.cpp$|/reports\.cpp$|/schema\.cpp$|/html\.cpp$")
OPEN, CLOSE = "({[", ")}]"


def tokens(source):
    """(text, line, whether it is a string) of C++ without comments and directives."""
    def without(match):
        return match[0] if match[0][0] in 'R"' else "\n" * match[0].count("\n")
    result, line = [], 1
    for match in TOKEN.finditer(STRING_OR_SKIPPED.sub(without, source)):
        text = match["rawtext"] if match["raw"] else match[0][1:-1] if match["string"] else match[0]
        if match["other"] is None or not text.isspace():
            result.append((text, line, match["other"] is None))
        line += match[0].count("\n")
    return result


def end_of(ts, start):
    """The bracket that closes the one at `start`."""
    depth = 0
    for i in range(start, len(ts)):
        if not ts[i][2]:
            depth += (ts[i][0] in OPEN) - (ts[i][0] in CLOSE)
        if depth == 0:
            return i
    return len(ts) - 1


def rendered(ts):
    """Strings joined; what stands between them in braces."""
    parts, expression, depth = [], "", 0
    for text, _, is_string in [*ts, ("+", 0, False)]:
        if depth == 0 and (is_string or text in ("+", ",")):
            if expression not in ("", "std::string"):
                parts.append("{" + expression + "}")
            expression = ""
            parts += [text] if is_string else [" "] * (text == ",")
            continue
        if not is_string:
            depth += (text in OPEN) - (text in CLOSE)
        words = expression[-1:].isalnum() and text[:1].isalnum()
        expression += f'"{text}"' if is_string else " " * words + text
    return "".join(parts).strip()


def kind_of(ts, i):
    """What the call at `i` makes, or None."""
    before = [ts[j][0] if j >= 0 else "" for j in (i - 2, i - 1)]
    if ts[i][2] or i + 1 >= len(ts) or ts[i + 1][0] not in ("(", "{"):
        return None
    if before == ["log", "::"]:
        return LOG.get(ts[i][0])
    if ts[i][0] in ("push_back", "emplace_back", "insert") and before[1] == ".":
        return "note" if LISTS.search(before[0]) else None
    return None if before[1] in ("struct", "class") else CALLS.get(ts[i][0])


def messages(source, parts):
    """(line, kind, text) of a file."""
    ts = tokens(source)
    used, found, around = 0, [], []
    for i, (text, line, is_string) in enumerate(ts):
        if not is_string and text in OPEN:
            around.append(ts[i - 1][0] if i else "")
        elif not is_string and text in CLOSE and around:
            around.pop()
        if i < used:
            continue
        kind = kind_of(ts, i)
        if kind:
            end = end_of(ts, i + 1)
            inner = ts[i + 2:end]
            if any(t[2] and re.search(r"[A-Za-z]", t[0]) for t in inner):
                found.append((line, kind, rendered(inner)))
                used = end
        elif parts and is_string and not NO_MESSAGE & set(around):
            used = next((j for j in range(i, len(ts)) if not ts[j][2]), len(ts))
            prose = "".join(t[0] for t in ts[i:used])
            if len(re.findall(r"[A-Za-z]{2,}", prose)) >= 3 and " " in prose.strip() and not re.search("[<\n]", prose):
                found.append((line, "part", prose))
    return found


def all_messages(root, parts):
    for path in sorted([*root.glob("src/**/*.cpp"), *root.glob("src/**/*.h")]):
        place = path.relative_to(root).as_posix()
        if not NO_MESSAGES_IN.search(place):
            for line, kind, text in messages(path.read_text(), parts):
                yield f"{place}:{line}", kind, text


SAMPLE = r'''
#include "a b c.h"
// throw Error("in a comment of it");
void f() {
  if (x) throw UsageError(file + ": no frame " + std::to_string(n) +
                          "; it has " + joined(names, ", "));
  log::warning("first half "
               "second half");
  const std::string why = "kept in a variable";
  notes.push_back("a note " + why);
  option("--out", o.out, "DIR", "Folder of the results");
}
'''
EXPECTED = [(5, "error", '{file}: no frame {std::to_string(n)}; it has {joined(names,", ")}'),
            (7, "warning", "first half second half"), (9, "part", "kept in a variable"),
            (10, "note", "a note {why}")]
LEAST = {"app": 60, "config": 15, "image": 25, "nightly": 20, "run": 30, "scene": 200, "study": 50}  # messages


def check(root):
    faults = []
    if messages(SAMPLE, True) != EXPECTED:
        faults.append(f"{messages(SAMPLE, True)}, expected {EXPECTED}")
    places = [place for place, _, _ in all_messages(root, False)]
    for module, least in LEAST.items():
        count = sum(place.startswith(f"src/{module}/") for place in places)
        if count < least:
            faults.append(f"src/{module} has {count} messages, expected {least} or more")
    print("\n".join(faults) or f"{len(places)} messages")
    return 1 if faults else 0


def main(root, options):
    if "--check" in options:
        return check(root)
    for place, kind, text in all_messages(root, "--parts" in options):
        print(f"{place}: {kind}: {text}")
    return 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]), sys.argv[2:]))

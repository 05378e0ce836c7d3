#!/usr/bin/env python3
"""What pages refer to exists. Every [Key] that code, shaders, scripts and pages cite has an entry in
docs/references.bib; every entry is complete and cited. Every command, option and setting in the code of a page or of
the manual, which is the help, exists: the completion and the schema, which the program makes, list them.

Usage: references.py SOURCE_ROOT; exit 1 and a line for each fault. It first plants faults in a folder of its own and
must find them.
"""

import json
import pathlib
import re
import sys
import tempfile

FOLDERS = ("src", "bench", "docs", "tests", "scripts", "cmake")
KINDS = {".cpp", ".h", ".frag", ".vert", ".comp", ".glsl", ".py", ".md", ".txt", ".cmake", ""}
KEY = re.compile(r"\[([A-Z][A-Za-z]+(?:18|19|20)[0-9]{2}[a-z]?)\]")
# Where a work of each kind has appeared; all have an author, a title and a year.
APPEARED = {"article": "journal", "inproceedings": "booktitle", "incollection": "booktitle", "book": "publisher",
            "phdthesis": "school", "misc": "howpublished"}


def cited(root):
    """Every key that is cited, with the first file and line that do so."""
    places = {}
    files = [root / "README.md", root / "CONTRIBUTING.md"]
    for folder in FOLDERS:
        files += sorted((root / folder).rglob("*"))
    for file in files:
        if not file.is_file() or file.suffix not in KINDS or "__pycache__" in file.parts:
            continue
        if file.name == pathlib.Path(__file__).name:
            continue
        for number, line in enumerate(file.read_text(errors="replace").splitlines(), 1):
            for key in KEY.findall(line):
                places.setdefault(key, f"{file.relative_to(root)}:{number}")
    return places


def entries(text):
    """Of each key: the kind of work, and its fields."""
    found = {}
    for kind, key, body in re.findall(r"^@(\w+)\{(\w+),\n(.*?)^\}", text, re.M | re.S):
        fields = dict(re.findall(r"^\s*(\w+)\s*=\s*\{(.*)\},?$", body, re.M))
        found.setdefault(key, []).append((kind, fields))
    return found


def surname(author):
    """The first word of the first author's surname, in ASCII."""
    plain = re.sub(r"\{\\.\{?(\w)\}?\}", r"\1", author.split(" and ")[0].split(",")[0])
    return re.match(r"[A-Za-z]+", plain.replace("{", ""))[0]


def faults(root):
    text = (root / "docs/references.bib").read_text()
    known = entries(text)
    if sum(map(len, known.values())) != len(re.findall(r"^@", text, re.M)):
        yield "docs/references.bib: an entry is not written as the others are"
    places = cited(root)
    for key, place in sorted(places.items()):
        if key not in known:
            yield f"{place}: [{key}] has no entry in docs/references.bib"
    for key, works in sorted(known.items()):
        where = f"docs/references.bib: {key}"
        if len(works) > 1:
            yield f"{where} stands {len(works)} times"
        if key not in places:
            yield f"{where} is cited nowhere"
        for kind, fields in works:
            if kind not in APPEARED:
                yield f"{where}: @{kind}; known are {', '.join(APPEARED)}"
                continue
            missing = [name for name in ("author", "title", "year", APPEARED[kind]) if not fields.get(name)]
            if missing:
                yield f"{where} has no {', '.join(missing)}"
            elif not key.startswith(surname(fields["author"]) + fields["year"]):
                yield f"{where} should be called {surname(fields['author'])}{fields['year']}"


def codes(root):
    """The code in each page, and each line of the manual: (place, code)."""
    pages = [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").rglob("*.md")),
             *sorted((root / "src").rglob("*.md"))]
    for page in filter(pathlib.Path.is_file, pages):
        text = page.read_text()
        blocks = re.findall(r"^```.*?\n(.*?)^```", text, re.M | re.S)
        spans = re.findall(r"`([^`]+)`", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S))
        for code in blocks + spans:
            yield page.relative_to(root), re.sub(r"\\\n\s*", " ", code)
    manual = root / "docs/man/catoptric.1"
    for line in re.sub(r"\\e\n\s*", " ", manual.read_text().replace("\\-", "-")).splitlines():
        yield manual.relative_to(root), line


def unknown_names(root):
    """Commands, options and settings that do not exist."""
    completion = (root / "docs/completion/catoptric.bash").read_text()
    options = {command: set(names.split()) for command, names
               in re.findall(r'^    ([a-z]+)\) options="([^"]*)"', completion, re.M)}
    schema = json.loads((root / "configs/schema/run.schema.json").read_text())
    methods = {method["properties"]["method"]["enum"][0]: method["properties"]
               for method in schema["properties"]["methods"]["items"]["anyOf"] if "properties" in method}
    parts = {name: schema["$defs"].get(name, {}).get("properties", {}) for name in schema["properties"]}
    for place, code in codes(root):
        # What follows " -- " is a command again: catoptric submit CONFIG -- sweep --vary ...
        for line in re.findall(r"(?<![/\w])catoptric ([a-z]+\b[^|;&\n`]*)", code):
            for call in re.split(r" -- (?=[a-z])", line):
                command = call.split()[0]
                if command not in options:
                    yield f"{place}: there is no command {command}"
                for name in re.findall(r"(?<!\S)--[a-z][a-z-]*", call):
                    if name not in options.get(command, {name}):
                        yield f"{place}: {command} has no option {name}"
        for method, name in re.findall(r"\bmethods\.(\w+)\.(\w+)", code):
            if name not in methods.get(method, {name}):
                yield f"{place}: there is no methods.{method}.{name}"
        for part, name in re.findall(r"--(?:set|vary)[ =]'?(?!methods\.)(\w+)(?:\.(\w+))?=", code):
            if part not in parts or name and name not in parts[part]:
                yield f"{place}: there is no setting {part}{name and '.' + name}"


def plant():
    """Faults of every kind must be found."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "src").mkdir()
        (root / "docs").mkdir()
        (root / "src/a.frag").write_text("// [Cited1999] [Missing2001] [Nameless2002]\n")
        whole = "  title = {T},\n  journal = {J},\n  year = {1999}\n}\n"
        (root / "docs/references.bib").write_text(
            "@article{Cited1999,\n  author = {Cited, A. and Other, B.},\n" + whole
            + "@article{Forgotten1999,\n  author = {Forg{\\\"o}tten, A.},\n" + whole
            + "@article{Nameless2002,\n" + whole)
        found = list(faults(root))
        expected = ["src/a.frag:1: [Missing2001] has no entry in docs/references.bib",
                    "docs/references.bib: Forgotten1999 is cited nowhere",
                    "docs/references.bib: Nameless2002 has no author"]
        if found != expected:
            sys.exit(f"references.py: planted faults are not found: {found}")
        (root / "docs/man").mkdir()
        (root / "docs/completion").mkdir()
        (root / "configs/schema").mkdir(parents=True)
        (root / "docs/man/catoptric.1").write_text("catoptric render X \\-\\-vary methods.traced.ray=1\n")
        (root / "docs/completion/catoptric.bash").write_text('    render) options="--set --vary" ;;\n')
        traced = {"properties": {"method": {"enum": ["traced"]}, "rays": {}}}
        (root / "configs/schema/run.schema.json").write_text(json.dumps(
            {"properties": {"methods": {"items": {"anyOf": [{"enum": ["traced"]}, traced]}}, "image": {}},
             "$defs": {"image": {"properties": {"width": {}}}}}))
        (root / "README.md").write_text("`catoptric paint X`, `--set methods.traced.rays=1`\n```sh\n"
                                        "catoptric render X \\\n  --sett a --set image.widht=1\n```\n")
        found = list(unknown_names(root))
        expected = ["README.md: render has no option --sett", "README.md: there is no setting image.widht",
                    "README.md: there is no command paint", "docs/man/catoptric.1: there is no methods.traced.ray"]
        if found != expected:
            sys.exit(f"references.py: planted names are not found: {found}")


def main():
    plant()
    root = pathlib.Path(sys.argv[1])
    found = [*faults(root), *unknown_names(root)]
    print("\n".join(found) if found else f"{len(entries((root / 'docs/references.bib').read_text()))} works, all cited")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Installs the build into an empty prefix and runs what was installed, away from the source tree.

Usage: installed.py BUILD_FOLDER CMAKE WORK_FOLDER
Renders one frame of an installed config (the module that writes EXR must be found beside the
program), and asks for a scene whose assets are not installed: the error must say what to do.
"""

import os
import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True
SOURCE = pathlib.Path(__file__).resolve().parent.parent
import work_folder  # noqa: E402


def main(build: str, cmake: str, work: pathlib.Path) -> int:
    work = work_folder.fresh(work)
    prefix = work / "prefix"
    home = work / "home"
    home.mkdir(parents=True)
    subprocess.run([cmake, "--install", build, "--prefix", prefix], check=True,
                   stdout=subprocess.DEVNULL)
    share = prefix / "share" / "catoptric"
    environment = {**os.environ, "HOME": str(home), "XDG_CACHE_HOME": str(home / "cache")}
    failed = []

    def run(*arguments):
        return subprocess.run([prefix / "bin" / "catoptric", *arguments], cwd=home, text=True,
                              env=environment, capture_output=True, check=False)

    def expect(condition, what, result):
        if not condition:
            failed.append(what)
            print(f"FAILED: {what}; exit code {result.returncode}\n{result.stdout}{result.stderr}")

    listed = run("list")
    expect(listed.returncode == 0 and "traced" in listed.stdout, "list names the methods", listed)

    # Away from the source tree it lists what is installed, and what lies in the working folder.
    (home / "scenes").mkdir()
    (home / "scenes" / "mine.glb").touch()
    scenes = run("list", "scenes").stdout.splitlines()
    expect("scenes/mine.glb" in scenes and str(share / "scenes" / "cornell_box.json") in scenes,
           "list finds installed scenes", listed)
    configs = run("list", "configs", "--json")
    expect(str(share / "configs" / "papers" / "perturbation.json") in configs.stdout,
           "list finds the papers' configs", configs)

    documentation = prefix / "share" / "doc" / "catoptric"
    pages = sorted(documentation.rglob("*.md"))
    expect({"outputs.md", "config.md"} <= {p.name for p in pages} and
           any(p.match("src/methods/traced/README.md") for p in pages), "the docs are installed", listed)
    for page in pages:
        for link in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text()):
            if "://" not in link:
                # Sources are not installed: a link to one must lead somewhere in the source tree
                place = page.parent if link.endswith((".md", ".png")) else (
                    SOURCE / page.relative_to(documentation).parent)
                expect((place / link).exists(), f"{page}: the link {link} leads somewhere", listed)

    page = prefix / "share" / "man" / "man1" / "catoptric.1"
    expect(page.is_file() and ".SS render" in page.read_text(), "the manual page is installed", listed)
    for name in ("bash-completion/completions/catoptric", "zsh/vendor-completions/_catoptric"):
        place = prefix / "share" / name
        expect(place.is_file() and "complete -F _catoptric catoptric" in place.read_text(),
               f"{name} is installed", listed)

    # The prefix is read only for whoever runs a package's program.
    before = set(share.rglob("*"))
    rendered = run("render", str(share / "configs" / "cornell_box.json"), "--frames", "1",
                   "--method", "traced", "--set", "image.width=64", "--set", "image.height=64",
                   "--out", "box")
    frames = list((home / "box").rglob("*.exr"))
    expect(rendered.returncode == 0 and len(frames) == 1, "an installed config renders", rendered)
    strangers = sorted(set(share.rglob("*")) - before)
    expect(not strangers, f"nothing is written beside the installed data: {strangers}", rendered)

    expect((share / "scripts" / "prepare_assets").exists(), "prepare_assets is installed", rendered)
    expect(not (share / "scenes" / "assets").exists(), "assets are not installed", rendered)
    room = run("info", str(share / "scenes" / "living_room.json"))
    expect(room.returncode == 3 and str(share / "scripts" / "prepare_assets") in room.stderr,
           "a room without assets says what to do", room)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])))

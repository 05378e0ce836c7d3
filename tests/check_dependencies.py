#!/usr/bin/env python3
"""Holds the direction of dependencies between the folders of src, and keeps each third-party
library in one of them. Usage: check_dependencies.py SOURCE_ROOT; exit 1 and a line per breach."""

import pathlib
import re
import sys

# A folder may include itself and what stands here (transitive closure written out).
ALLOWED = {
    "core": set(),
    "config": {"core"},
    "image": {"config", "core"},
    "scene": {"image", "config", "core"},
    "frame": {"scene", "image", "config", "core"},
    "gl": {"config", "core"},
    "raster": {"gl", "frame", "scene", "image", "config", "core"},
    "trace": {"frame", "scene", "image", "config", "core"},
    "methods": {"raster", "trace", "gl", "frame", "scene", "image", "config", "core"},
    "run": {"methods", "raster", "trace", "gl", "frame", "scene", "image", "config", "core"},
    "report": {"methods", "raster", "trace", "gl", "frame", "scene", "image", "config", "core"},
    "app": {"run", "report", "methods", "raster", "trace", "gl", "frame", "scene", "image", "config", "core"},
}
# Folders of methods/ that are no method: every method may include them.
COMMON_OF_METHODS = {"contract", "shared", "testing"}
# Third-party headers and the one folder that may include them.
OWNERS = {
    r"nlohmann/": "config", r"embree": "trace", r"OpenImageIO/": "image", r"OpenColorIO/": "image",
    r"tiny_gltf": "scene", r"glad/": "gl", r"CLI/": "app", r"tbb/": "core", r"spdlog/": "core",
    r"glm/": "core", r"sqlite3": "report", r"png\.h": "image", r"jpeglib\.h": "image", r"EGL/": "gl",
    r"GL/": "gl",
}


def main(root: pathlib.Path) -> int:
    breaches = []
    sources = [p for p in root.joinpath("src").rglob("*") if p.suffix in (".cpp", ".h")]
    for path in sources:
        relative = path.relative_to(root / "src")
        folder = relative.parts[0]
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = re.match(r'\s*#\s*include\s*([<"])([^>"]+)[>"]', line)
            if not match:
                continue
            quoted, name = match.group(1) == '"', match.group(2)
            place = f"src/{relative}:{number}"
            target = name.split("/")[0]
            if quoted and target in ALLOWED and target != folder and target not in ALLOWED[folder]:
                breaches.append(f"{place}: {folder} must not include {name}")
            if quoted and folder == "methods" and target == "methods" and len(relative.parts) > 2:
                own = relative.parts[1]
                parts = name.split("/")
                if len(parts) > 2 and parts[1] != own and parts[1] not in COMMON_OF_METHODS:
                    breaches.append(f"{place}: method {own} must not include method {parts[1]}")
            for pattern, owner in OWNERS.items():
                if not quoted and re.match(pattern, name) and folder != owner:
                    breaches.append(f"{place}: <{name}> belongs to src/{owner} alone")
    for breach in breaches:
        print(breach)
    print(f"checked {len(sources)} files, {len(breaches)} breaches")
    return 1 if breaches or not sources else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))

#!/usr/bin/env python3
"""Holds the direction of dependencies between the folders of src, in #include lines and in the
modules' CMakeLists.txt, and keeps each third-party library in one folder.

Usage: check_dependencies.py SOURCE_ROOT; exit 1 and a line for each breach. It first plants breaches
in a folder of its own and must find them.
"""

import pathlib
import re
import sys
import tempfile

# A folder may include itself and what stands here (all of them written out, none is implied):
# app -> nightly -> study -> run, report -> methods -> raster, trace -> gl, frame -> scene -> config, image
# -> core; report -> measure -> image. Siblings on one level do not include each other.
ALLOWED = {
    "core": "",
    "config": "core",
    "image": "core",
    "scene": "image config core",
    "frame": "scene image config core",
    "gl": "config core",
    "raster": "gl frame scene image config core",
    "trace": "frame scene image config core",
    "methods": "raster trace gl frame scene image config core",
    "run": "methods raster trace gl frame scene image config core",
    "measure": "image core",
    "report": "measure frame image config core",  # of frame: the samples of step times
    "study": "run report measure methods frame scene image config core",
    "nightly": "study run report measure methods frame scene image config core",
    "cluster": "run scene config core",
    "app": "cluster nightly study run report measure methods gl frame scene image config core",
}
ALLOWED = {folder: set(others.split()) for folder, others in ALLOWED.items()}
# Folders of methods/ that are no method: every method may include them.
COMMON_OF_METHODS = {"contract", "shared", "testing"}
# Of the rooms in these modules, the headers that other modules may include; others are private.
PUBLIC_IN_ROOMS = {
    "scene": {"description/description.h", "implicit/gradient.h", "implicit/jet.h", "implicit/surface.h",
              "implicit/multiprecision_test.h", "implicit/test_surfaces.h", "paths/path.h", "shapes/shapes.h"},
    "trace": {"bake/bake.h", "embree/instructions.h", "embree/trace_scene.h", "lobes/environment_levels.h", "lobes/lobe_tracer.h",
              "lobes/point_lanes.h", "lobes/reflect.h",
              "lobes/sky.h"},
}
# Third-party headers and the one folder that may include them.
OWNERS = {
    r"nlohmann/": "config", r"embree": "trace", r"OpenEXR/": "image", r"OpenColorIO/": "image",
    r"tiny_gltf": "scene", r"draco/": "scene", r"glad/": "gl", r"CLI/": "app", r"tbb/": "core", r"spdlog/": "core",
    r"cairo": "report", r"glm/": "core", r"SQLiteCpp/": "nightly", r"sqlite3": "nightly",
    r"png\.h": "image", r"jpeglib\.h": "image", r"EGL/": "gl", r"GL/": "gl",
}


def breaches_of_includes(root: pathlib.Path, included: dict) -> list:
    """Breaches in the sources; `included` receives folder -> {folder: place}."""
    breaches = []
    for path in sources_of(root):
        relative = path.relative_to(root / "src")
        folder = relative.parts[0]
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = re.match(r'\s*#\s*include\s*([<"])([^>"]+)[>"]', line)
            if not match:
                continue
            quoted, name = match.group(1) == '"', match.group(2)
            place = f"src/{relative}:{number}"
            target = name.split("/")[0]
            if quoted and target in ALLOWED and target != folder:
                included.setdefault(folder, {}).setdefault(target, place)
                if target not in ALLOWED.get(folder, set()):
                    breaches.append(f"{place}: {folder} must not include {name}")
                parts = name.split("/", 1)
                public = PUBLIC_IN_ROOMS.get(target)
                if public is not None and "/" in parts[1] and parts[1] not in public:
                    breaches.append(f"{place}: {name} is private to {target}")
            if quoted and folder == "methods" and target == "methods" and len(relative.parts) > 2:
                own = relative.parts[1]
                parts = name.split("/")
                if len(parts) > 2 and parts[1] != own and parts[1] not in COMMON_OF_METHODS:
                    breaches.append(f"{place}: method {own} must not include method {parts[1]}")
            for pattern, owner in OWNERS.items():
                if not quoted and re.match(pattern, name) and folder != owner:
                    breaches.append(f"{place}: <{name}> belongs to src/{owner} alone")
    return breaches


def sources_of(root: pathlib.Path) -> list:
    return sorted(p for p in root.joinpath("src").rglob("*") if p.suffix in (".cpp", ".h"))


def linked(text: str) -> list:
    """(what, modules) of every module, test and program of a CMakeLists.txt."""
    text = re.sub(r"#.*", "", text)
    found = []
    for command, body in re.findall(r"\b(catoptric_(?:module|test))\(([^()]*)\)", text):
        words = body.split()
        depends = []
        keyword = ""
        for word in words[1:]:
            if re.fullmatch(r"[A-Z_]{3,}", word):
                keyword = word
            elif keyword == "DEPENDS":
                depends.append(word)
        found.append((f"{command}({words[0]})", depends))
    for body in re.findall(r"\btarget_link_libraries\(([^()]*)\)", text):
        words = body.split()
        found.append((words[0], re.findall(r"catoptric::(\w+)", body)))
    return found


def breaches_of_cmake(root: pathlib.Path, included: dict) -> list:
    """What is linked must be allowed, and what is included must be linked."""
    breaches = []
    direct = {}  # module -> what it links
    for path in sorted(root.joinpath("src").rglob("CMakeLists.txt")):
        relative = path.relative_to(root / "src")
        folder = relative.parts[0]
        for what, modules in linked(path.read_text()):
            for module in modules:
                if module in ALLOWED and module != folder and module not in ALLOWED.get(folder, set()):
                    breaches.append(f"src/{relative}: {what}: {folder} must not depend on {module}")
            if what in (f"catoptric_module({folder})", "catoptric", "catoptric_app"):
                direct.setdefault(folder, set()).update(m for m in modules if m in ALLOWED)

    def reached(folder, seen):
        for module in direct.get(folder, set()) - seen:
            seen.add(module)
            reached(module, seen)
        return seen

    for folder, targets in included.items():
        missing = set(targets) - reached(folder, set())
        for module in sorted(missing):
            breaches.append(f"{targets[module]}: includes {module}, which DEPENDS of src/{folder} does not name")
    return breaches


def breaches_of(root: pathlib.Path) -> list:
    included = {}
    return breaches_of_includes(root, included) + breaches_of_cmake(root, included)


def self_test() -> list:
    """Breaches that are planted and not found."""
    files = {
        "src/core/CMakeLists.txt": "catoptric_module(core\n  SOURCES a.cpp)",
        "src/core/a.cpp": '#include "image/a.h"\n',
        "src/image/CMakeLists.txt": "catoptric_module(image SOURCES a.cpp DEPENDS core config)",
        "src/image/a.h": "#include <spdlog/spdlog.h>\n",
        "src/measure/CMakeLists.txt": "catoptric_module(measure SOURCES a.cpp DEPENDS core)",
        "src/measure/a.cpp": '#include "image/a.h"\n#include "core/a.h"\n',
        "src/methods/one/one.cpp": '#include "methods/two/two.h"\n#include "methods/contract/method.h"\n',
        "src/raster/CMakeLists.txt": "catoptric_module(raster SOURCES a.cpp DEPENDS scene)",
        "src/raster/a.cpp": '#include "scene/gltf/reader.h"\n#include "scene/paths/path.h"\n',
        "src/report/CMakeLists.txt": "catoptric_test(report_test SOURCES a.cpp DEPENDS report run)",
    }
    expected = [
        "src/core/a.cpp:1: core must not include image/a.h",
        "src/core/a.cpp:1: includes image, which DEPENDS of src/core does not name",
        "src/image/CMakeLists.txt: catoptric_module(image): image must not depend on config",
        "src/image/a.h:1: <spdlog/spdlog.h> belongs to src/core alone",
        "src/measure/a.cpp:1: includes image, which DEPENDS of src/measure does not name",
        "src/methods/one/one.cpp:1: method one must not include method two",
        "src/raster/a.cpp:1: scene/gltf/reader.h is private to scene",
        "src/report/CMakeLists.txt: catoptric_test(report_test): report must not depend on run",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            path = pathlib.Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        found = sorted(breaches_of(pathlib.Path(folder)))
    return [] if found == sorted(expected) else [f"self-test: {sorted(set(found) ^ set(expected))}"]


def main(root: pathlib.Path) -> int:
    breaches = self_test() + breaches_of(root)
    for breach in breaches:
        print(breach)
    files = len(sources_of(root))
    print(f"checked {files} files, {len(breaches)} breaches")
    return 1 if breaches or not files else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))

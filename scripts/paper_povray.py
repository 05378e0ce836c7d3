"""Scenes of implicit surfaces for POV-Ray, for scripts/compare_povray and scripts/paper_tables."""
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import zlib

from paper_run import Frames

WIDTH, HEIGHT = 640, 480
VASE = (0.47, 3.90, -9.78, 5.80)  # r(t), t = y / 2
SHADES = {"checker": ((0.75, 0.7, 0.6), (0.35, 0.3, 0.26))}


def install():
    if shutil.which("povray"):
        return
    as_root = [] if os.getuid() == 0 else ["sudo"]
    subprocess.run([*as_root, "apt-get", "update", "-qq"], check=True)
    subprocess.run([*as_root, "apt-get", "install", "-y", "-qq", "--no-install-recommends",
                    "povray"], check=True, stdout=subprocess.DEVNULL)


def checker(file):
    """The texture of all that has one, 2 x 2 squares: both programs read the same PNG file."""
    side = 512
    byte = lambda v: round(255 * (1.055 * v ** (1 / 2.4) - 0.055))  # noqa: E731
    light, dark = (bytes(map(byte, c)) for c in SHADES["checker"])
    half = side // 2
    rows = b"".join(b"\0" + (a * half + b * half)
                    for a, b in ([(light, dark)] * half + [(dark, light)] * half))
    chunk = lambda kind, data: (struct.pack(">I", len(data)) + kind + data  # noqa: E731
                                + struct.pack(">I", zlib.crc32(kind + data)))
    file.write_bytes(b"\x89PNG\r\n\x1a\n"
                     + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def plain_scene(scene, folder, shadows):
    """The scene as both programs can show it, written to a folder: its lights with hard shadows (baked
    into our vertices; as there, what moves casts none) or without, light from everywhere alike instead
    of sky and interreflection, one file for textures of floors, no other textures. The sky is black with
    shadows: the bake would find it occluded, POV-Ray's ambient light is not."""
    plain = json.loads(pathlib.Path("scenes", scene + ".json").read_text())
    for light in plain["lights"]:
        if light["type"] != "directional":
            raise SystemExit(f"compare_povray: {scene}: light {light['name']}: only directional "
                             "lights are translated")
        light["baked"] = shadows
        light.pop("radius", None)
    light = [0.4 * v for v in plain["environment"]["horizon"]]
    if shadows:
        plain["bake"] = {"mode": "full", "rays": 1, "bounces": 0, "distance": 1e-4}
        plain["environment"] = {"type": "constant", "color": [0, 0, 0]}
        plain["ambient"] = light
    else:
        plain["bake"] = {"mode": "none"}
        plain["environment"] = {"type": "constant", "color": light}

    def without_texture(material, floor):
        if material.pop("texture", None):
            material.pop("uv_scale", None)
            if floor:
                material.update(texture="checker.png", uv_scale=0.7)
            else:
                material.setdefault("base_color", [0.4, 0.35, 0.3])
    for name, material in plain["materials"].items():
        without_texture(material, name == "floor")
    for o in objects(plain["objects"]):
        if isinstance(o.get("material"), dict):
            without_texture(o["material"], False)
        if o.get("shape") == "plane" and o.get("uv") != "metres":
            raise SystemExit(f"compare_povray: {scene}: {o['name']}: planes need \"uv\": \"metres\"")
    folder.mkdir(parents=True, exist_ok=True)
    checker(folder / "checker.png")
    file = folder / (scene + ".json")
    file.write_text(json.dumps(plain))
    return plain, file


def objects(tree):
    for o in tree:
        yield o
        yield from objects(o.get("children", []))


def vector(values):
    return "<" + ",".join(f"{v:.15g}" for v in values) + ">"


class Translator:
    """POV-Ray's text of a plain scene at time 0."""

    def __init__(self, plain, vase, bounces):
        self.plain, self.vase = plain, vase
        self.keys = {(a["object"], a["channel"]): a["keys"][0][1:]
                     for a in plain.get("animation", [])}
        self.bounces = bounces
        self.moving = {a["object"] for a in plain.get("animation", [])}

    def scene(self, camera, aspect):
        sky = self.plain["environment"]["color"]
        ambient = self.plain.get("ambient", sky)
        text = ["#version 3.7;", f"global_settings {{ assumed_gamma 1 max_trace_level {self.bounces + 1} "
                f"ambient_light rgb {vector(ambient)} }}", f"background {{ rgb {vector(sky)} }}",
                self.camera(camera, aspect)]
        for light in self.plain["lights"]:
            towards = [-v for v in light["direction"]]
            color = [light["intensity"] / math.pi * c for c in light.get("color", [1, 1, 1])]
            text.append(f"light_source {{ {vector([1e3 * v for v in towards])} rgb {vector(color)} "
                        f"parallel point_at <0,0,0> {'' if light['baked'] else 'shadowless'} }}")
        return "\n".join(text + [self.object(o) for o in self.plain["objects"]]) + "\n"

    def camera(self, camera, aspect):
        sub = lambda a, b: [x - y for x, y in zip(a, b)]  # noqa: E731
        cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],  # noqa: E731
                              a[0] * b[1] - a[1] * b[0]]
        unit = lambda a: [x / math.hypot(*a) for x in a]  # noqa: E731
        forward = unit(sub(camera["target"], camera["position"]))
        right = unit(cross(forward, [0, 1, 0]))
        up = cross(right, forward)
        high = 2 * math.tan(math.radians(camera["fov"]) / 2)
        return (f"camera {{ perspective location {vector(camera['position'])} "
                f"direction {vector(forward)} right {vector([aspect * high * v for v in right])} "
                f"up {vector([high * v for v in up])} }}")

    def object(self, o):
        parts = [self.shape(o)] if "shape" in o else []
        parts += [self.object(child) for child in o.get("children", [])]
        text = parts[0] if len(parts) == 1 else "union {\n" + "\n".join(parts) + "\n}"
        repeat = o.get("repeat", {"count": 1, "step": [0, 0, 0]})
        copies = []
        for i in range(repeat["count"]):
            step = [i * v for v in repeat["step"]]
            shadow = "no_shadow" if o.get("name") in self.moving else ""
            copies.append(f"object {{ {text} {self.transform(o)} translate {vector(step)} {shadow} }}")
        return "\n".join(copies)

    def transform(self, o):
        get = lambda channel, default: self.keys.get((o.get("name"), channel),  # noqa: E731
                                                     o.get(channel, default))
        scale, turn = get("scale", 1), get("rotate", [0, 0, 0])
        scale = scale if isinstance(scale, list) else [scale] * 3
        return (f"scale {vector(scale)} rotate {vector([0, 0, turn[2]])} rotate "
                f"{vector([turn[0], 0, 0])} rotate {vector([0, turn[1], 0])} "
                f"translate {vector(get('translate', [0, 0, 0]))}")

    def shape(self, o):
        look = self.material(o)
        kind, size = o["shape"], o.get("size")
        if kind == "plane":
            w, d = (v / 2 for v in size)
            corners = [[-w, 0, -d], [-w, 0, d], [w, 0, d], [w, 0, -d]]
            return f"polygon {{ 5, {', '.join(map(vector, corners + corners[:1]))} {look} }}"
        if kind == "box":
            return f"box {{ {vector([-v / 2 for v in size])} {vector([v / 2 for v in size])} {look} }}"
        if kind == "panel":
            t = o["thickness"]
            holes = " ".join(f"box {{ {vector([x, y, -2 * t])} {vector([x + w, y + h, t])} }}"
                             for x, y, w, h in o["openings"])
            return (f"difference {{ box {{ {vector([-size[0] / 2, 0, -t])} "
                    f"{vector([size[0] / 2, size[1], 0])} }} {holes} {look} }}")
        if kind == "polygons":
            triangles = " ".join(
                f"triangle {{ {', '.join(vector(o['vertices'][i]) for i in (f[0], f[k], f[k + 1]))} }}"
                for f in o["faces"] for k in range(1, len(f) - 1))
            return f"mesh {{ {triangles} {look} }}"
        if kind == "implicit" and o["surface"] == "sphere":
            return f"sphere {{ <0,0,0> {o['radius']} {look} }}"
        if kind == "implicit" and o["surface"] == "vase":
            return self.turned(look)
        raise SystemExit(f"compare_povray: {o['name']}: shape {kind} is not translated")

    def turned(self, look):
        c0, c1, c2, c3 = VASE
        if self.vase == "lathe":  # two Bezier pieces: one would have a control point of radius < 0
            radius = lambda t: c0 + t * (c1 + t * (c2 + t * c3))  # noqa: E731
            slope = lambda t: c1 + t * (2 * c2 + t * 3 * c3)  # noqa: E731
            points = []
            for t in (0, 0.5):
                points += [(radius(t), t), (radius(t) + slope(t) / 6, t + 1 / 6),
                           (radius(t + 0.5) - slope(t + 0.5) / 6, t + 1 / 3),
                           (radius(t + 0.5), t + 0.5)]
            text = ", ".join(f"<{r:.15g},{2 * t:.15g}>" for r, t in points)
            return f"lathe {{ bezier_spline {len(points)}, {text} {look} }}"
        # |gradient| is at most hypot(1, r') and |r'| at most 1.95, at y = 0
        radius = f"({c0} + (y/2)*({c1} + (y/2)*({c2} + (y/2)*{c3})))"
        return (f"isosurface {{ function {{ sqrt(x*x + z*z) - {radius} }} contained_by {{ box {{ "
                f"<-1,0,-1>, <1,2,1> }} }} open accuracy 1e-5 max_gradient 2.2 {look} }}")

    def material(self, o):
        m = o.get("material", {})
        m = self.plain["materials"][m] if isinstance(m, str) else m
        s, color = m.get("s", 0), m.get("base_color", [1, 1, 1])
        reflection = (f"reflection {{ rgb {vector([s * t for t in m.get('tint', [1, 1, 1])])} }}"
                      if s else "")
        # ambient and diffuse are factors of the pigment; (1 - s) of a reflector's own
        finish = f"finish {{ ambient {1 - s:.6g} diffuse {1 - s:.6g} {reflection} }}"
        if "texture" in m:  # image_map lies in x, y from 0 to 1; ours along x and z in metres
            w, d = (v / 2 for v in o["size"])
            return (f"texture {{ pigment {{ image_map {{ png \"checker.png\" gamma srgb }} "
                    f"rotate -90*x scale {1 / m['uv_scale']:.9g} translate {vector([-w, 0, -d])} }} "
                    f"{finish} }}")
        return f"texture {{ pigment {{ rgb {vector(color)} }} {finish} }}"


def render(plain, folder, name, vase, width, height, bounces):
    """Renders with POV-Ray to folder/name.exr: one ray a pixel, two threads. The least seconds of
    tracing of three runs, without parsing and writing."""
    text = Translator(plain, vase, bounces).scene(plain["cameras"][0], width / height)
    (folder / f"{name}.pov").write_text(text)
    times = []
    for _ in range(3):
        done = subprocess.run(["povray", f"+I{name}.pov", f"+O{name}.exr", "+FE", f"+W{width}",
                               f"+H{height}", "+WT2", "-D", "-A"], cwd=folder,
                              capture_output=True, text=True)
        seconds = re.findall(r"Trace Time:.*\(([0-9.]+) seconds\)", done.stderr)
        if done.returncode != 0 or not seconds:
            raise SystemExit(f"compare_povray: povray: exit {done.returncode}: "
                             f"{done.stderr[-2000:]}")
        times.append(float(seconds[0]))
    return min(times)


class Comparison:
    """One scene by POV-Ray (the vase as a lathe and as an isosurface), `traced` and `perturbation`:
    the picture of time 0, one ray a pixel, and times with one and 2 x 2 samples a pixel."""

    def __init__(self, bench, scene, bounces, moved, shadows):
        folder = bench.work / ("povray_shadows" if shadows else "povray")
        plain, file = plain_scene(scene, folder, shadows)
        size = WIDTH, HEIGHT
        self.times = {}  # by samples: seconds of lathe and isosurface, Frames of both methods
        for samples in (2, 1):
            times = [render(plain, folder, f"{scene}_{vase}", vase, samples * size[0],
                            samples * size[1], bounces) for vase in ("lathe", "isosurface")]
            config = folder / f"{scene}_run.json"
            config.write_text(json.dumps({
                "scene": str(file.resolve()), "path": str(pathlib.Path("paths", scene + ".json").resolve()),
                "image": {"width": size[0], "height": size[1], "samples": samples,
                          "compression": "none"},
                "preview": {"enabled": False}, "errors": {"against": []},
                "methods": [{"method": "traced", "bvh": "refit", "bounces": bounces},
                            {"method": "perturbation", "max_bounces": bounces}]}))
            out = folder / f"{scene}_run"
            shutil.rmtree(out, ignore_errors=True)
            bench.catoptric("render", config, "--frames", f"1-{1 + moved}", "--out", out, "-q")
            runs = {}
            for method in ("traced", "perturbation"):
                runs[method] = Frames()
                runs[method].add(out / method, [1])
            self.times[samples] = (*times, runs)
        self.pictures = {"POV-Ray": folder / f"{scene}_lathe.exr",
                         "isosurface": folder / f"{scene}_isosurface.exr"}
        for method in ("traced", "perturbation"):
            self.pictures[method], = (out / method / "frames").glob("*0001.exr")
        self.errors = {
            name: json.loads(bench.catoptric("compare", picture, self.pictures["POV-Ray"],
                                             "--json"))[0]["pooled"]["L1_8bit"]
            for name, picture in self.pictures.items() if name != "POV-Ray"}

    def picture(self, file):
        """POV-Ray, perturbation, and four times their difference, side by side."""
        parts = [file.with_name(f"{name}.part.png") for name in ("POV-Ray", "perturbation", "4x")]
        for part in parts[:2]:
            subprocess.run(["oiiotool", self.pictures[part.name.split(".")[0]], "--ch", "R,G,B",
                            "--colorconvert", "linear", "sRGB", "-d", "uint8", "-o", part],
                           check=True)
        subprocess.run(["oiiotool", *parts[:2], "--absdiff", "--mulc", "4", "-o", parts[2]],
                       check=True)
        subprocess.run(["oiiotool", *parts, "--mosaic", "3x1", "-o", file], check=True)
        for part in parts:
            part.unlink()

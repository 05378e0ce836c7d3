"""Triangles as lists of corners (position, normal or None, uv): transform, clean, normals,
clustering. Positions and normals are tuples of three floats. Standard library only."""

import itertools
import math


def linear_from_srgb(value):
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def hex_colour(text):
    return [linear_from_srgb(int(text[i : i + 2], 16) / 255.0) for i in (1, 3, 5)]


def unit(x, y, z):
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length) if length > 1e-20 else None


def to_corners(primitive, rotation):
    """Triangles as lists of corners (position, normal or None, uv), rotated by the catalogue."""
    m = primitive["matrix"]
    r = rotation

    def transform(v, w):
        x = m[0] * v[0] + m[4] * v[1] + m[8] * v[2] + m[12] * w
        y = m[1] * v[0] + m[5] * v[1] + m[9] * v[2] + m[13] * w
        z = m[2] * v[0] + m[6] * v[1] + m[10] * v[2] + m[14] * w
        return (r[0] * x + r[1] * y + r[2] * z, r[3] * x + r[4] * y + r[5] * z, r[6] * x + r[7] * y + r[8] * z)

    p, n, t = primitive["positions"], primitive["normals"], primitive["uvs"]
    positions = [transform(p[i : i + 3], 1.0) for i in range(0, len(p), 3)]
    normals = None
    if n is not None:
        normals = []
        for i in range(0, len(n), 3):
            v = transform(n[i : i + 3], 0.0)
            normals.append(unit(*v) if all(math.isfinite(c) for c in v) else None)
    uvs = None
    if t is not None:
        uvs = [(t[i], t[i + 1]) if math.isfinite(t[i] + t[i + 1]) else (0.0, 0.0) for i in range(0, len(t), 2)]
    index = primitive["indices"]
    corners = [(positions[i], normals[i] if normals else None, uvs[i] if uvs else (0.0, 0.0)) for i in index]
    return [corners[i : i + 3] for i in range(0, len(corners) - 2, 3)]


def face_normal(triangle):
    (a, _, _), (b, _, _), (c, _, _) = triangle
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)


def clean(triangles, smallest):
    """Drops triangles without area and repeated ones (models draw both sides; we see both)."""
    seen, kept = set(), []
    for triangle in triangles:
        normal = face_normal(triangle)
        if math.sqrt(sum(c * c for c in normal)) <= smallest:
            continue
        key = tuple(sorted(corner[0] for corner in triangle))
        if key in seen:
            continue
        seen.add(key)
        kept.append(triangle)
    return kept


def with_normals(triangles, crease_degrees, force):
    """Fills missing normals: area-weighted over the faces of a corner within the crease angle."""
    if not force and all(corner[1] is not None for t in triangles for corner in t):
        return triangles
    limit = math.cos(math.radians(crease_degrees))
    faces = []
    around = {}
    for i, triangle in enumerate(triangles):
        normal = face_normal(triangle)
        faces.append((normal, unit(*normal)))
        for corner in triangle:
            around.setdefault(corner[0], []).append(i)
    result = []
    for i, triangle in enumerate(triangles):
        corners = []
        for position, normal, uv in triangle:
            if normal is None or force:
                x = y = z = 0.0
                mine = faces[i][1]
                for j in around[position]:
                    other = faces[j][1]
                    dot = mine[0] * other[0] + mine[1] * other[1] + mine[2] * other[2]
                    if dot >= limit:
                        x, y, z = x + faces[j][0][0], y + faces[j][0][1], z + faces[j][0][2]
                normal = unit(x, y, z) or mine
            corners.append((position, normal, uv))
        result.append(corners)
    return result


def clustered(triangles, cell, thin):
    """Vertex clustering on a grid of `cell` metres, apart for each dominant direction of the
    normal, so that edges stay: fewer triangles for models that are finer than any view shows. `thin`:
    the two sides of cloth in one cell stay apart."""
    groups = {}

    def key_of(corner):
        p, n, _ = corner
        axis = max(range(3), key=lambda k: abs(n[k]))
        return tuple(math.floor(c / cell) for c in p), axis, n[axis] > 0

    for triangle in triangles:
        for corner in triangle:
            groups.setdefault(key_of(corner), {})[corner] = None
    mean = {}
    for key, corners in groups.items():
        count = len(corners)
        position = tuple(sum(c[0][k] for c in corners) / count for k in range(3))
        normal = unit(*(sum(c[1][k] for c in corners) for k in range(3)))
        nearest = min(corners, key=lambda c: sum((c[0][k] - position[k]) ** 2 for k in range(3)))
        mean[key] = (position, normal or nearest[1], nearest[2])
    # Corners of one grid cell that point to different sides still meet in one point.
    together = {}
    for key, corner in mean.items():
        together.setdefault(key[0], []).append(corner)
    merged = {}
    for key, corner in mean.items():
        points = [
            other[0]
            for other in together[key[0]]
            if not thin or sum(other[1][k] * corner[1][k] for k in range(3)) > -0.3
        ]
        position = tuple(sum(p[k] for p in points) / len(points) for k in range(3))
        merged[key] = (position, corner[1], corner[2])
    result = []
    for triangle in triangles:
        keys = [key_of(corner) for corner in triangle]
        if len({key[0] for key in keys}) == 3:
            result.append([merged[key] for key in keys])
    return result


def sheets_of(triangles):
    """Number of the connected sheet of each triangle: triangles that share a position."""
    parent = {}

    def root(p):
        while parent.setdefault(p, p) != p:
            parent[p] = parent[parent[p]]
            p = parent[p]
        return p

    for triangle in triangles:
        first = root(triangle[0][0])
        for corner in triangle[1:]:
            parent[root(corner[0])] = first
    numbers = {}
    return [numbers.setdefault(root(t[0][0]), len(numbers)) for t in triangles]


def smooth_sheets(triangles, bend_degrees):
    """Lists of triangle numbers, largest first: triangles that share an edge and bend less there."""
    limit = math.cos(math.radians(bend_degrees))
    normals = [unit(*face_normal(triangle)) or (0.0, 0.0, 0.0) for triangle in triangles]
    along = {}
    for i, ((a, _, _), (b, _, _), (c, _, _)) in enumerate(triangles):
        for edge in ((a, b), (b, c), (c, a)):
            along.setdefault(frozenset(edge), []).append(i)
    beside = [[] for _ in triangles]
    for i, j in (pair for users in along.values() for pair in itertools.combinations(users, 2)):
        if sum(normals[i][k] * normals[j][k] for k in range(3)) > limit:
            beside[i].append(j)
            beside[j].append(i)
    sheets, seen = [], set()
    for start in range(len(triangles)):
        if start in seen:
            continue
        seen.add(start)
        sheet = [start]
        for i in sheet:  # grows while it is walked
            for j in beside[i]:
                if j not in seen:
                    seen.add(j)
                    sheet.append(j)
        sheets.append(sheet)
    return sorted(sheets, key=len, reverse=True)


# Points of a triangle at which `covered` looks for another one: barycentric, inside the edges.
INSIDE = [(a / 12, b / 12, (12 - a - b) / 12) for a in range(1, 11, 3) for b in range(1, 12 - a, 3)]


def covered(triangles, gap, last):
    """Numbers of the triangles that lie within `gap` metres of others all over: layers drawn twice,
    where a ray tracer and a rasterizer see different ones. Small sheets go before large ones, so
    that whole layers go; triangles whose number is in `last` are tried last."""
    areas, planes, grid = [], [], {}
    extent = max(c[0][k] for t in triangles for c in t for k in range(3))
    cell = max(0.02, extent / 40)

    def cells(points):
        low = [math.floor((min(p[k] for p in points) - gap) / cell) for k in range(3)]
        high = [math.floor((max(p[k] for p in points) + gap) / cell) for k in range(3)]
        return [
            (x, y, z)
            for x in range(low[0], high[0] + 1)
            for y in range(low[1], high[1] + 1)
            for z in range(low[2], high[2] + 1)
        ]

    for i, triangle in enumerate(triangles):
        normal = face_normal(triangle)
        areas.append(math.sqrt(sum(c * c for c in normal)) / 2)
        planes.append(unit(*normal))
        for place in cells([corner[0] for corner in triangle]):
            grid.setdefault(place, []).append(i)

    def lies_on(point, normal, other):
        n = planes[other]
        if n is None or abs(sum(n[k] * normal[k] for k in range(3))) < 0.9:
            return False
        corners = [corner[0] for corner in triangles[other]]
        if abs(sum(n[k] * (point[k] - corners[0][k]) for k in range(3))) > gap:
            return False
        for a, b in ((0, 1), (1, 2), (2, 0)):
            p, q = corners[a], corners[b]
            u = [q[k] - p[k] for k in range(3)]
            w = [point[k] - p[k] for k in range(3)]
            side = (
                n[0] * (u[1] * w[2] - u[2] * w[1])
                + n[1] * (u[2] * w[0] - u[0] * w[2])
                + n[2] * (u[0] * w[1] - u[1] * w[0])
            )
            if side < -gap * math.sqrt(sum(c * c for c in u)):
                return False
        return True

    sheets = sheets_of(triangles)
    sizes = {}
    for i, sheet in enumerate(sheets):
        sizes[sheet] = sizes.get(sheet, 0) + areas[i]
    order = sorted(range(len(triangles)), key=lambda i: (i in last, round(sizes[sheets[i]], 4), sheets[i], areas[i]))
    gone = set()
    for i in order:
        if planes[i] is None:
            continue
        points = [
            tuple(sum(w * triangles[i][c][0][k] for c, w in enumerate(weights)) for k in range(3))
            for weights in INSIDE
        ]
        if all(
            any(
                j != i and j not in gone and lies_on(point, planes[i], j)
                for j in grid.get(tuple(math.floor(c / cell) for c in point), ())
            )
            for point in points
        ):
            gone.add(i)
    return gone

"""Meshes that the scenes need and the repository does not hold: made in a folder, as OBJ files."""

import functools
from pathlib import Path

import numpy

ASSETS = Path(__file__).resolve().parents[2] / "assets"

# How often the faces of an icosahedron are divided: 20 * 4^n triangles.
BALL_DIVISIONS = 5
SHELL_DIVISIONS = 4
# Inner radius of the hollow ball, outer radius 1.
SHELL_RADIUS = 0.9
# Where the water in the tumbler ends, and the indices on both sides of its wall.
WATER_LEVEL = 0.75
GROUND = -0.002


def write(path, points, normals, triangles, coordinates=None):
    """An OBJ file; `normals` one a point or None, `triangles` from 0, `coordinates` (u, v) one a point or None."""
    lines = ["v %.9g %.9g %.9g" % tuple(p) for p in points]
    lines += ["vt %.9g %.9g" % tuple(c) for c in (coordinates if coordinates is not None else ())]
    lines += ["vn %.9g %.9g %.9g" % tuple(n) for n in (normals if normals is not None else ())]
    texture = "{0}" if coordinates is not None else ""
    corner = "{0}/" + texture + "/{0}" if normals is not None else "{0}/" + texture if texture else "{0}"
    lines += ["f " + " ".join(corner.format(i + 1) for i in triangle) for triangle in triangles]
    path.write_text("\n".join(lines) + "\n")


def read(path):
    """Points, normals and triangles, as pairs (point, normal) a corner, of an OBJ file with normals."""
    points, normals, triangles = [], [], []
    for line in path.read_text().splitlines():
        kind, *words = line.split() or [""]
        if kind in ("v", "vn"):
            (points if kind == "v" else normals).append([float(w) for w in words])
        elif kind == "f":
            triangles.append([(int(w.split("/")[0]) - 1, int(w.split("/")[2]) - 1) for w in words])
    return numpy.array(points), numpy.array(normals), triangles


@functools.cache
def icosphere(divisions):
    """Points of the unit sphere, and triangles that are counter-clockwise from outside."""
    golden = (1 + 5**0.5) / 2
    points = [(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0), (0, -1, golden), (0, 1, golden)]
    points += [(0, -1, -golden), (0, 1, -golden), (golden, 0, -1), (golden, 0, 1), (-golden, 0, -1), (-golden, 0, 1)]
    points = [numpy.array(p) / numpy.linalg.norm(p) for p in points]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    triangles += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11)]
    triangles += [(6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(divisions):
        middles = {}

        def middle(a, b):
            key = min(a, b), max(a, b)
            if key not in middles:
                middles[key] = len(points)
                points.append((points[a] + points[b]) / numpy.linalg.norm(points[a] + points[b]))
            return middles[key]

        divided = []
        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            divided += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = divided
    return numpy.array(points), triangles


def ball(path):
    points, triangles = icosphere(BALL_DIVISIONS)
    write(path, points, points, triangles)


def hollow_ball(path):
    points, triangles = icosphere(SHELL_DIVISIONS)
    inner = [(c + len(points), b + len(points), a + len(points)) for a, b, c in triangles]
    write(path, numpy.vstack([points, SHELL_RADIUS * points]), numpy.vstack([points, -points]), triangles + inner)


def rectangle(path, corner, edge, other):
    """A rectangle that shows its front where `edge` turns counter-clockwise into `other`; (u, v) along them."""
    corner, edge, other = map(numpy.array, (corner, edge, other))
    corners = [corner, corner + edge, corner + edge + other, corner + other]
    write(path, corners, None, [(0, 1, 2), (0, 2, 3)], [(0, 0), (1, 0), (1, 1), (0, 1)])


def is_inner_wall(points, normals, corners):
    """Does this triangle of the tumbler face its axis, or lie on the floor inside, below the rim?"""
    middle = numpy.mean([points[p] for p, _ in corners], axis=0)
    normal = numpy.mean([normals[n] for _, n in corners], axis=0)
    return 0.079 < middle[1] < 1.0 and (normal[0] * middle[0] + normal[2] * middle[2] < 0 or middle[1] < 0.081)


def tumbler_and_water(dry, wet, surface):
    """The surfaces that light meets in a tumbler of water, each once: glass to air, glass to water, water to air.

    The wall is cut where the water ends; the water's surface reaches to that cut and no further.
    """
    points, normals, triangles = read(ASSETS / "meshes/cup_tumbler.obj")
    sides = {dry: [], wet: []}
    rim = []
    for corners in triangles:
        if not is_inner_wall(points, normals, corners):
            sides[dry].append([(points[p], normals[n]) for p, n in corners])
            continue
        polygon = [(points[p], normals[n]) for p, n in corners]
        for path, sign in ((dry, 1), (wet, -1)):
            kept = []
            for (p, n), (q, m) in zip(polygon, polygon[1:] + polygon[:1]):
                here, there = sign * (p[1] - WATER_LEVEL), sign * (q[1] - WATER_LEVEL)
                if here >= 0:
                    kept.append((p, n))
                if here * there < 0:
                    # From the upper end, so that both triangles of an edge compute the same point.
                    (a, an), (b, bn) = ((p, n), (q, m)) if p[1] > q[1] else ((q, m), (p, n))
                    t = (a[1] - WATER_LEVEL) / (a[1] - b[1])
                    cut = a + t * (b - a)
                    cut[1] = WATER_LEVEL
                    kept.append((cut, an + t * (bn - an)))
                    rim.append(cut)
            sides[path] += [[kept[0], kept[i], kept[i + 1]] for i in range(1, len(kept) - 1)]
    for path, faces in sides.items():
        corners = [corner for face in faces for corner in face]
        triangles = numpy.arange(len(corners)).reshape(-1, 3)
        write(path, [p for p, _ in corners], [n for _, n in corners], triangles)
    rim = numpy.unique(numpy.round(rim, 9), axis=0)
    rim = rim[numpy.argsort(-numpy.arctan2(rim[:, 2], rim[:, 0]))]
    count = len(rim)
    fan = [(count, i, (i + 1) % count) for i in range(count)]
    write(surface, numpy.vstack([rim, [[0, WATER_LEVEL, 0]]]), None, fan)


def make(folder):
    """Every mesh of the scenes that is made; the path of each by its name, those of the repository included."""
    paths = {path.stem: path for path in (ASSETS / "meshes").glob("*.obj")}
    made = "ball hollow_ball table small_table pane lamp tumbler_dry tumbler_wet water_surface".split()
    paths |= {name: folder / f"{name}.obj" for name in made}
    ball(paths["ball"])
    hollow_ball(paths["hollow_ball"])
    rectangle(paths["table"], (-4, GROUND, 4), (8, 0, 0), (0, 0, -8))
    rectangle(paths["small_table"], (-2, -1, 2), (4, 0, 0), (0, 0, -4))
    rectangle(paths["pane"], (-0.6, -0.8, 1.5), (1.4, 0, 0), (0, 1.6, -0.3))
    rectangle(paths["lamp"], (-1.5, -0.5, -2), (3, 0, 0), (0, 1.5, 0))
    tumbler_and_water(paths["tumbler_dry"], paths["tumbler_wet"], paths["water_surface"])
    return paths

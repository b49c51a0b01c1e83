"""Writes the meshes in meshes/, and those in assets/validation with the image checker.png: python3 meshes.py, with Python's standard library alone."""

import math
import struct
import zlib
from pathlib import Path

FOLDER = Path(__file__).parent
VALIDATION = FOLDER.parent.parent / "assets" / "validation"


def icosphere(level, radius=1.0):
    """Positions on a sphere, triangles counter-clockwise from outside."""
    t = (1 + math.sqrt(5)) / 2
    corners = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t),
               (0, -1, -t), (0, 1, -t), (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2),
             (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5),
             (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    unit = lambda p: tuple(x / math.hypot(*p) for x in p)
    points = [unit(p) for p in corners]
    for _ in range(level):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                points.append(unit(tuple((x + y) / 2 for x, y in zip(points[a], points[b]))))
            return middles[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return [tuple(radius * x for x in p) for p in points], points, faces


def write(name, what, shells, smooth=True, folder=FOLDER / "meshes"):
    """`shells`: positions, normals, triangles each."""
    lines, first = [f"# {what}"], 1
    for positions, normals, faces in shells:
        lines += ["v %.7g %.7g %.7g" % p for p in positions]
        if smooth:
            lines += ["vn %.6g %.6g %.6g" % n for n in normals]
        corner = (lambda i: f"{i + first}//{i + first}") if smooth else (lambda i: f"{i + first}")
        lines += ["f " + " ".join(corner(i) for i in face) for face in faces]
        first += len(positions)
    (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")


def inwards(shell):
    positions, normals, faces = shell
    return positions, [tuple(-x for x in n) for n in normals], [(a, c, b) for a, b, c in faces]


def box(low, high):
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, [], [(a, b, c) for a, b, c, _ in sides] + [(a, c, d) for a, _, c, d in sides]


def checker(side, fields):
    row = lambda y: b"\0" + b"".join(
        (b"\xe0\x40\x30" if (x * fields // side + y * fields // side) % 2 else b"\x30\x60\xd0") for x in range(side))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    data = zlib.compress(b"".join(map(row, range(side))), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


(FOLDER / "meshes").mkdir(exist_ok=True)
write("ball", "a ball of radius 1", [icosphere(3)])
write("hollow", "a hollow ball of radii 1 and 0.9", [icosphere(3), inwards(icosphere(3, 0.9))])
write("cubes", "two cubes that touch in a face", [box((-1, -0.5, -0.5), (0, 0.5, 0.5)), box((0, -0.5, -0.5), (1, 0.5, 0.5))], smooth=False)
write("sheet", "a pane of 2 x 2 x 0.0001", [box((-1, -1, -5e-5), (1, 1, 5e-5))], smooth=False)
(VALIDATION / "floor.obj").write_text(
    "# a floor of 8 x 8 with texture coordinates\nv -4 0 -4\nv -4 0 4\nv 4 0 4\nv 4 0 -4\n"
    "vt 0 0\nvt 0 4\nvt 4 4\nvt 4 0\nf 1/1 2/2 3/3 4/4\n")
(VALIDATION / "lamp.obj").write_text(
    "# a square of 1 x 1 that looks down\nv -0.5 0 -0.5\nv 0.5 0 -0.5\nv 0.5 0 0.5\nv -0.5 0 0.5\nf 1 2 3 4\n")
(VALIDATION / "checker.png").write_bytes(checker(64, 8))
write("ball", "a ball of radius 1", [icosphere(2)], folder=VALIDATION)

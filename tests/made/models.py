"""Models written as OBJ text: a kit as artists publish them, one with an unwrapped image, and hard cases."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image

Point = tuple[float, float, float]
Face = list[Point]
PALETTE = 8  # cells a side, 16 texels each
COLORS = {"wood": 3, "stone": 12, "leaf": 30, "roof": 41, "glass": 55}


def lathe(profile: Iterable[tuple[float, float]], sides: int, at: Point = (0.0, 0.0, 0.0)) -> Iterator[Face]:
    """The quads of a profile (radius, height), lowest first, turned about the vertical; n-gons close it."""
    angles = 2 * np.pi * np.arange(sides) / sides
    turned = [(float(x), float(z)) for x, z in zip(np.cos(angles), -np.sin(angles), strict=True)]
    rings = [[(at[0] + r * x, at[1] + y, at[2] + r * z) for x, z in turned] for r, y in profile]
    for low, high in itertools.pairwise(rings):
        for i in range(sides):
            k = (i + 1) % sides
            yield [low[i], low[k], high[k], high[i]]
    yield rings[0][::-1]
    yield rings[-1]


def block(low: Point, high: Point) -> Iterator[Face]:
    """The six quads of a box."""
    (a, b, c), (d, e, f) = low, high
    yield [(a, b, f), (d, b, f), (d, e, f), (a, e, f)]
    yield [(d, b, c), (a, b, c), (a, e, c), (d, e, c)]
    yield [(a, b, c), (a, b, f), (a, e, f), (a, e, c)]
    yield [(d, b, f), (d, b, c), (d, e, c), (d, e, f)]
    yield [(a, e, f), (d, e, f), (d, e, c), (a, e, c)]
    yield [(a, b, c), (d, b, c), (d, b, f), (a, b, f)]


def as_obj(parts: dict[str, list[Face]], *, normals: bool = True, shades: bool = False) -> str:
    """OBJ text, a group for each part. All corners of a part stand on the palette's cell of its colour: their
    images have no area. normals: with flat ones. shades: with vertex colours."""
    lines = ["# made", "mtllib kit.mtl", "o model"]
    numbers: dict[str, int] = {}
    for part, (name, faces) in enumerate(parts.items(), 1):
        u, v = (COLORS[name] % PALETTE + 0.5) / PALETTE, 1 - (COLORS[name] // PALETTE + 0.5) / PALETTE
        lines += [f"g {name}", "usemtl palette", f"s {part}", f"vt {u:.6f} {v:.6f}"]
        shade = f" 0.{5 + part} 0.5 0.25" if shades else ""
        for face in faces:
            corners = []
            for x, y, z in face:
                line = f"v {x:.6f} {y:.6f} {z:.6f}{shade}"
                if line not in numbers:
                    numbers[line] = len(numbers) + 1
                    lines.append(line)
                corners.append(f"{numbers[line]}/{part}{'/-1' if normals else ''}")
            if normals:
                x, y, z = _normal(face)
                lines.append(f"vn {x:.6f} {y:.6f} {z:.6f}")
            lines.append(f"f {' '.join(corners)}")
    return "\n".join(lines) + "\n"


def _normal(face: Face) -> Point:
    """Of a polygon, by Newell's sum."""
    x = y = z = 0.0
    for (a, b, c), (d, e, f) in zip(face, face[1:] + face[:1], strict=True):
        x, y, z = x + b * f - c * e, y + c * d - a * f, z + a * e - b * d
    length = float(np.hypot(np.hypot(x, y), z))
    return (x / length, y / length, z / length)


def _wave(steps: int, radius: float, height: float, depth: float) -> list[tuple[float, float]]:
    """A profile whose radius swells and shrinks."""
    t = np.arange(steps + 1) / steps
    return list(zip(radius + depth * np.sin(7 * t) * (1 - t), height * t, strict=True))


def kit() -> dict[str, str]:
    """Name and OBJ text of each model. They share kit.mtl and the palette."""
    planks = [face for i in range(9) for face in block((-0.9, 0.7, i * 0.24), (0.9, 0.78, i * 0.24 + 0.2))]
    poles = [
        face for x in (-0.8, 0.8) for z in (0.1, 1.9) for face in lathe([(0.1, 0), (0.08, 1)], 8, (x, 0, z))
    ]
    crowns = [(0.02, 1.0), (0.9, 1.1), (0.5, 1.7), (0.65, 1.75), (0.3, 2.3), (0.4, 2.35), (0.01, 3.0)]
    walls = [*block((-1, 0, -1), (1, 1.2, 1)), *block((0.4, 1.2, 0.4), (0.7, 2.4, 0.7))]
    roof: list[Face] = [
        [(-1.2, 1.2, 1.2), (1.2, 1.2, 1.2), (1.2, 2.1, 0), (-1.2, 2.1, 0)],
        [(1.2, 1.2, -1.2), (-1.2, 1.2, -1.2), (-1.2, 2.1, 0), (1.2, 2.1, 0)],
        [(1.2, 1.2, 1.2), (1.2, 1.2, -1.2), (1.2, 2.1, 0)],
        [(-1.2, 1.2, -1.2), (-1.2, 1.2, 1.2), (-1.2, 2.1, 0)],
    ]
    tower = [*lathe(_wave(20, 1.0, 6.0, 0.25), 24)]
    lamp = [*lathe([(0.5, 6.0), (0.7, 6.3), (0.7, 6.9), (0.2, 7.4)], 12)]
    return {
        "barrel": as_obj({"wood": [*lathe(_wave(8, 0.5, 1.2, 0.2), 16)]}),
        "house": as_obj({"stone": walls, "roof": roof}),
        "jetty": as_obj({"wood": planks + poles}, normals=False),
        "tower": as_obj({"stone": tower, "glass": lamp}),
        "tree": as_obj({"wood": [*lathe([(0.2, 0), (0.15, 1.1)], 7)], "leaf": [*lathe(crowns, 11)]}),
        "urn": as_obj({"stone": [*lathe(_wave(12, 0.6, 1.5, 0.4), 20)]}, shades=True),
    }


def write_kit(folder: Path) -> None:
    folder.mkdir(parents=True)
    models = kit()
    for name, text in models.items():
        (folder / f"{name}.obj").write_text(text)
    plain = models["tree"].replace("usemtl palette", "usemtl Brown", 1)
    plain = plain.replace("usemtl palette", "usemtl Green")
    (folder / "plain.obj").write_text(plain.replace("kit.mtl", "plain.mtl"))
    (folder / "plain.mtl").write_text("newmtl Brown\nKd 0.3 0.2 0.1\n\nnewmtl Green\nKd 0.07 0.25 0.05\n")
    (folder / "kit.mtl").write_text("newmtl palette\nKd 1 1 1\nmap_Kd palette.png\n")
    cells = np.random.default_rng(3).integers(30, 226, (PALETTE, PALETTE, 3)).astype(np.uint8)
    Image.fromarray(cells.repeat(16, axis=0).repeat(16, axis=1)).save(folder / "palette.png")


def unwrapped(rings: int = 24, columns: int = 32) -> str:
    """A vase whose image goes once round it, mirrored at half its way: smooth normals, one seam."""
    lines = []
    t = np.arange(rings + 1) / rings
    radius = 1 + 0.3 * np.sin(6 * t)
    lean = -np.gradient(radius, 3 * t)
    for j in range(rings + 1):
        for i in range(columns + 1):
            angle = 2 * np.pi * i / columns
            across = np.array([np.cos(angle), 0, -np.sin(angle)])
            normal = across + np.array([0, lean[j], 0])
            normal /= np.linalg.norm(normal)
            place = radius[j] * across + np.array([0, 3 * t[j], 0])
            lines.append("v {:.7f} {:.7f} {:.7f}".format(*place))
            lines.append(f"vt {abs(2 * i / columns - 1):.7f} {t[j]:.7f}")
            lines.append("vn {:.7f} {:.7f} {:.7f}".format(*normal))
    for j in range(rings):
        for i in range(columns):
            a = j * (columns + 1) + i + 1
            corners = (a, a + 1, a + columns + 2, a + columns + 1)
            lines.append("f " + " ".join(f"{k}/{k}/{k}" for k in corners))
    return "\n".join(lines) + "\n"


def write_tangent(folder: Path) -> None:
    folder.mkdir(parents=True)
    (folder / "vase.obj").write_text(unwrapped())


SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
# Models as other exporters write them, and as none should; each by the one odd thing in it.
NASTY: dict[str, bytes] = {
    name: text.encode() if isinstance(text, str) else text
    for name, text in {
        "triangle": SQUARE + "f 1 2 3\n",
        "quad": SQUARE + "f 1 2 3 4\n",
        "concave n-gon": "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nf 1 2 3 4 5\n",
        "negative indices": SQUARE + "f -4 -3 -2\nf -4 -2 -1\n",
        "index 0": SQUARE + "f 0 1 2\n",
        "index beyond": SQUARE + "f 1 2 9\n",
        "negative beyond": SQUARE + "f -1 -2 -9\n",
        "image index beyond": SQUARE + "vt 0 0\nf 1/1 2/1 3/5\n",
        "faces first": "f 1 2 3\n" + SQUARE,
        "no final newline": SQUARE + "f 1 2 3",
        "crlf": (SQUARE + "f 1 2 3 4\n").replace("\n", "\r\n"),
        "cr": (SQUARE + "f 1 2 3 4\n").replace("\n", "\r"),
        "tabs": (SQUARE + "f 1 2 3 4\n").replace(" ", "\t"),
        "blanks": "  " + SQUARE.replace("\n", "  \n\n  ") + "f   1  2 3 \n",
        "continued line": SQUARE + "f 1 2 \\\n 3 4\n",
        "byte order mark": b"\xef\xbb\xbf" + (SQUARE + "f 1 2 3\n").encode(),
        "utf-16": (SQUARE + "f 1 2 3\n").encode("utf-16"),
        "latin-1 names": SQUARE.encode() + b"g b\xe9ton\nusemtl \xfcber\nf 1 2 3\n",
        "comments": "# first\n" + SQUARE.replace("\n", " # here\n") + "f 1 2 3 # and here\n",
        "unknown words": SQUARE + "curv 0 1 2\nbevel on\nf 1 2 3\n",
        "with w": SQUARE.replace(" 0\n", " 0 1.0\n") + "f 1 2 3\n",
        "vertex colours": SQUARE.replace(" 0\n", " 0 0.5 0.25 1\n") + "f 1 2 3\n",
        "scientific": "v 0e0 0E-3 0\nv 1e+0 0 0\nv 10e-1 .1e1 -0\nf 1 2 3\n",
        "three-part vt": SQUARE + "vt 0 0 0\nvt 1 0 0\nvt 1 1 0\nf 1/1 2/2 3/3\n",
        "image on some faces": SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\nf 1 3 4\n",
        "normals on some faces": SQUARE + "vn 0 0 1\nf 1//1 2//1 3//1\nf 1 3 4\n",
        "zero normal": SQUARE + "vn 0 0 0\nf 1//1 2//1 3//1\n",
        "not a number": SQUARE.replace("1 1 0", "nan 1 0") + "f 1 2 3\n",
        "infinite": SQUARE.replace("1 1 0", "1 inf 0") + "f 1 2 3\n",
        "beyond float32": SQUARE.replace("1 1 0", "1e39 1 0") + "f 1 2 3\n",
        "no words": "v a b c\nf 1 2 3\n",
        "two coordinates": "v 0 0\nv 1 0\nv 1 1\nf 1 2 3\n",
        "face of two": SQUARE + "f 1 2\nf 1 2 3\n",
        "face of one corner thrice": SQUARE + "f 1 1 1\nf 1 2 3\n",
        "no area": "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
        "doubled face": SQUARE + "f 1 2 3\nf 1 2 3\nf 3 1 2\n",
        "both sides": SQUARE + "f 1 2 3\nf 3 2 1\n",
        "three faces at an edge": SQUARE + "v 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n",
        "points and lines": SQUARE + "p 1\nl 1 2 3\n",
        "lines and a face": SQUARE + "l 1 2 3\nf 1 2 3\n",
        "no faces": SQUARE,
        "empty": "",
        "far away": SQUARE.replace("v ", "v 1000000") + "f 1 2 3\n",
        "huge": SQUARE.replace("1", "1e18") + "f 1 2 3\n",
        "tiny": SQUARE.replace("1", "1e-18") + "f 1 2 3\n",
        "no such library": "mtllib nowhere.mtl\nusemtl none\n" + SQUARE + "f 1 2 3\n",
        "two libraries": "mtllib one.mtl two.mtl\nmtllib three.mtl\n" + SQUARE + "usemtl a\nf 1 2 3\n",
        "long line": SQUARE + "f" + " 1 2 3 4" * 5000 + "\n",
        "zero bytes": b"v 0 0 0\0\nf 1 2 3\n",
    }.items()
}


def write_nasty(folder: Path) -> None:
    folder.mkdir(parents=True)
    for name, data in NASTY.items():
        (folder / f"{name}.obj").write_bytes(data)

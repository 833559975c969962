"""Models palms: a ringed, bent trunk, a crown of fronds, a cluster of coconuts.

Usage: python palm.py RAW_ASSETS
Local axes, metres: the foot is at the origin, Y is up, the trunk bends towards +Z.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import palm_paint as paint_atlas
from objfile import Model, grid_triangles, smooth_normals, write_mtl
from paint import rand
from picture import write_image

Floats = NDArray[np.float64]

SPREAD = 1.55  # geometry of a frond is this much wider than the painted one


@dataclass(frozen=True)
class Palm:
    """A kind of palm. `length` of the trunk and `bent`, `lean` of its axis: metres, degrees; `fronds` in the
    crown, `frond` their length relative to the first palm's; `nuts` under it; `seed` of what varies. `sides`
    and `rings` of the trunk, `segments` along a frond: fewer for palms that are seen from afar. Their nuts
    have the material of the trunk, because each material is a draw call.
    """

    length: float
    lean: float
    bent: float
    fronds: int
    frond: float
    nuts: int
    seed: int
    sides: int
    rings: int  # odd, because the two bark textures share one ring of vertices
    segments: int
    nut_material: str


# The one on the beach, and three of the grove: an old one that stands over the others, one that leans out of
# it for light, and a young one.
FINE = {"sides": 9, "rings": 37, "segments": 12, "nut_material": "nuts"}
COARSE = {"sides": 8, "rings": 13, "segments": 6, "nut_material": "trunk"}
PALMS = {
    "palm": Palm(length=8.6, lean=16.0, bent=37.0, fronds=16, frond=1.0, nuts=6, seed=0, **FINE),
    "tall": Palm(length=10.5, lean=5.0, bent=13.0, fronds=15, frond=0.92, nuts=2, seed=1, **COARSE),
    "leaning": Palm(length=8.8, lean=11.0, bent=30.0, fronds=13, frond=0.9, nuts=2, seed=3, **COARSE),
    "young": Palm(length=4.2, lean=9.0, bent=16.0, fronds=12, frond=0.86, nuts=0, seed=2, **COARSE),
}


@dataclass(frozen=True)
class Leaf:
    """One frond: `azimuth` around the crown, `rise` of its base above the horizontal, `droop` towards its
    tip.

    Angles in radians, lengths in metres.
    """

    pattern: int
    azimuth: float
    rise: float
    droop: float
    length: float
    twist: float
    fold: float  # angle of the two halves below the plane of the midrib, rad


def norm(v: Floats) -> Floats:
    return v / np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


def trunk_axis(palm: Palm, s: float) -> tuple[Floats, Floats]:
    """Points and directions of the trunk's axis at s in 0..1: first leaning, then rising."""
    point, steps = np.zeros(3), 200
    direction = np.zeros(3)
    for k in range(steps + 1):
        t = k / steps
        lean = math.radians(palm.lean + palm.bent * math.sin(math.pi * min(1.0, t * 1.05) ** 0.72) - 8.0 * t)
        sway = math.radians(7.0 * math.sin(2.6 * math.pi * t))
        direction = norm(np.array([math.sin(sway), math.cos(lean), math.sin(lean)]))
        if t >= s - 1e-9:
            break
        point = point + direction * (palm.length / steps)
    return point, direction


def add_trunk(model: Model, palm: Palm) -> None:
    """Adds the trunk: a tapering, ringed tube in two parts, closed by a tip under the crown."""
    rings, centers = [], []
    for i in range(palm.rings):
        s = i / (palm.rings - 1)
        center, along = trunk_axis(palm, s)
        if i == 0:
            center = center - along * 0.5  # below the sand, so that the end never shows on a slope
        side = norm(np.cross(np.array([0.0, 0.0, 1.0]), along))
        front = np.cross(along, side)
        radius = 0.155 - 0.060 * s + 0.15 * (1.0 - min(1.0, s / 0.11)) ** 2
        radius += 0.055 * max(0.0, 1.0 - abs(s - 0.975) / 0.05)
        radius *= 1.045 if i % 2 else 0.965
        if i == 0:
            radius = 0.60  # the foot spreads into the sand
        if i == palm.rings - 1:
            radius = 0.03
        turn = np.arange(palm.sides + 1) % palm.sides * (2.0 * math.pi / palm.sides)
        uneven = (0.55, 0.16, 0.10)[i] if i < 3 else 0.07  # most where the roots begin
        lump = np.array(
            [
                1.0 + uneven * (rand(i * 16 + int(k) % palm.sides, 5 + 100 * palm.seed) - 0.5)
                for k in range(palm.sides + 1)
            ]
        )
        c, w = np.cos(turn) * lump, np.sin(turn) * lump
        rings.append(center + radius * (c[:, None] * side + w[:, None] * front))
        centers.append(center)
    middle = palm.rings // 2
    points = np.array(rings)
    flat = points.reshape(-1, 3)
    normals = smooth_normals(flat, grid_triangles(palm.rings, palm.sides + 1))
    for part, (first, last) in enumerate(((0, middle), (middle, palm.rings - 1))):
        rows = range(first, last + 1)
        pixels = np.array(
            [
                [
                    paint_atlas.BARK_X[part] + paint_atlas.BARK_WIDTH * k / palm.sides,
                    paint_atlas.BARK_Y + paint_atlas.BARK_HEIGHT * (1.0 - (i - first) / (last - first)),
                ]
                for i in rows
                for k in range(palm.sides + 1)
            ]
        )
        start, stop = first * (palm.sides + 1), (last + 1) * (palm.sides + 1)
        local = grid_triangles(last - first + 1, palm.sides + 1)
        model.add("trunk", "trunk", flat[start:stop], pixels, local, normals[start:stop])


def leaves(palm: Palm) -> list[Leaf]:
    """The fronds of the crown: young ones upright in the centre, grown ones arched, old ones hanging."""
    crown = []
    count = palm.fronds
    golden = math.pi * (3.0 - math.sqrt(5.0))
    for k in range(count):
        age = k / (count - 1)
        r = [rand(k * 8 + i, 71 + 100 * palm.seed) - 0.5 for i in range(6)]
        pattern = 0 if age < 0.45 else 1 if age < 0.87 else 2
        crown.append(
            Leaf(
                pattern=pattern,
                azimuth=k * golden + 0.35 * r[0],
                rise=math.radians(76.0 - 92.0 * age + 14.0 * r[1]),
                droop=math.radians(72.0 + 42.0 * math.sin(math.pi * age) - 26.0 * age + 22.0 * r[2]),
                length=palm.frond
                * (2.7 + 1.25 * math.sin(math.pi * min(1.0, 0.18 + age * 0.75)))
                * (1.0 + 0.16 * r[3]),
                twist=0.9 * r[4],
                fold=math.radians(18.0 + 34.0 * age + 16.0 * r[5]),
            )
        )
    return crown


def add_leaf(model: Model, palm: Palm, leaf: Leaf, foot: Floats) -> None:
    """Adds a frond: an arched and twisted strip, five vertices wide, that hangs on both sides of the
    midrib."""
    out = np.array([math.cos(leaf.azimuth), 0.0, math.sin(leaf.azimuth)])
    up = np.array([0.0, 1.0, 0.0])
    side = np.array([-math.sin(leaf.azimuth), 0.0, math.cos(leaf.azimuth)])
    metres = SPREAD * leaf.length / paint_atlas.FROND_HEIGHT  # per atlas pixel, across
    spine = foot.copy()
    rows, pixels = [], []
    sub = 6
    for i in range(palm.segments + 1):
        s = i / palm.segments
        pitch = leaf.rise - leaf.droop * s**1.35
        over = up * math.cos(pitch) - out * math.sin(pitch)
        roll = leaf.twist * s
        right = side * math.cos(roll) + over * math.sin(roll)
        over = over * math.cos(roll) - side * math.sin(roll)
        half = paint_atlas.frond_half_width(s)
        inner, outer = 0.42 * half * metres, 0.58 * half * metres
        lift = math.radians(24.0) * (1.0 - 0.5 * s) - 0.35 * leaf.fold
        hang = leaf.fold * (0.55 + 0.6 * s)
        row = []
        for sign in (-1.0, 1.0):
            first = spine + right * (sign * inner * math.cos(lift)) + over * (inner * math.sin(lift))
            second = first + right * (sign * outer * math.cos(hang)) - over * (outer * math.sin(hang))
            row.append((first, second))
        rows += [row[0][1], row[0][0], spine, row[1][0], row[1][1]]
        x = paint_atlas.FROND_X[leaf.pattern] + paint_atlas.FROND_WIDTH / 2.0
        y = paint_atlas.FROND_Y + paint_atlas.FROND_HEIGHT * (1.0 - s)
        pixels += [(x + half * a, y) for a in (-1.0, -0.42, 0.0, 0.42, 1.0)]
        for k in range(sub):
            t = (i + (k + 0.5) / sub) / palm.segments
            p = leaf.rise - leaf.droop * t**1.35
            spine = spine + (out * math.cos(p) + up * math.sin(p)) * (leaf.length / palm.segments / sub)
    model.add("leaves", "leaves", np.array(rows), np.array(pixels), grid_triangles(palm.segments + 1, 5))


def icosphere() -> tuple[Floats, NDArray[np.int64]]:
    """An icosphere with a vertex at each pole: 42 vertices, 80 triangles.

    Ten vertices lie on the equator, so that it divides into two halves.
    """
    points = [np.array([0.0, 1.0, 0.0])]
    height, radius = 1.0 / math.sqrt(5.0), 2.0 / math.sqrt(5.0)
    for sign, shift in ((1.0, 0.0), (-1.0, 0.5)):
        for k in range(5):
            turn = (k + shift) * 2.0 * math.pi / 5.0
            points.append(np.array([radius * math.cos(turn), sign * height, radius * math.sin(turn)]))
    points.append(np.array([0.0, -1.0, 0.0]))
    faces = []
    for k in range(5):
        n = (k + 1) % 5
        faces += [(0, 1 + n, 1 + k), (1 + k, 1 + n, 6 + k), (1 + n, 6 + n, 6 + k), (11, 6 + k, 6 + n)]
    middle: dict[tuple[int, int], int] = {}

    def between(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in middle:
            middle[key] = len(points)
            points.append(norm(points[a] + points[b]))
        return middle[key]

    small = []
    for a, b, c in faces:
        ab, bc, ca = between(a, b), between(b, c), between(c, a)
        small += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.array(points), np.array(small, dtype=np.int64)


def add_nuts(model: Model, palm: Palm, crown: Floats) -> None:
    """Adds coconuts under the crown. Each half is textured by a disc of the atlas."""
    sphere, faces = icosphere()
    up_half = sphere[faces][:, :, 1].mean(axis=1) > 0.0
    for k in range(palm.nuts):
        r = [rand(k * 8 + i, 91 + 100 * palm.seed) - 0.5 for i in range(5)]
        turn = k * 2.0 * math.pi / palm.nuts + 0.5 * r[0]
        axis = norm(np.array([math.cos(turn) * 0.55, 0.9, math.sin(turn) * 0.55]))
        side = norm(np.cross(axis, np.array([math.sin(turn), 0.0, -math.cos(turn)])))
        front = np.cross(side, axis)
        reach, size = 0.22 + 0.05 * r[1], 0.125 + 0.03 * r[2]
        center = crown + np.array([math.cos(turn) * reach, -0.24 + 0.14 * r[3], math.sin(turn) * reach])
        placed = center + size * (sphere[:, :1] * side + 1.22 * sphere[:, 1:2] * axis + sphere[:, 2:] * front)
        normals = sphere[:, :1] * side + sphere[:, 1:2] / 1.22 * axis + sphere[:, 2:] * front
        normals = normals / np.sqrt((normals**2).sum(axis=1))[:, None]
        kind = (0, 1, 0, 2, 1, 0)[k]
        for half, upper in ((0, True), (1, False)):
            polar = np.arccos(np.clip(np.abs(sphere[:, 1]), 0.0, 1.0)) / (math.pi / 2.0)
            flat = np.sqrt(sphere[:, 0] ** 2 + sphere[:, 2] ** 2)
            scale = paint_atlas.NUT_RADIUS * polar / np.maximum(flat, 1e-9)
            mirror = 1.0 if upper else -1.0
            pixels = np.stack(
                [
                    paint_atlas.NUT_X[2 * kind + half] + mirror * scale * sphere[:, 0],
                    paint_atlas.NUT_Y + scale * sphere[:, 2],
                ],
                axis=1,
            )
            chosen = faces[up_half == upper]
            used, local = np.unique(chosen, return_inverse=True)
            model.add(
                "nuts", palm.nut_material, placed[used], pixels[used], local.reshape(-1, 3), normals[used]
            )


def build(palm: Palm) -> Model:
    """The palm as a model."""
    model = Model(paint_atlas.SIZE, paint_atlas.SIZE)
    add_trunk(model, palm)
    top, along = trunk_axis(palm, 1.0)
    for k, leaf in enumerate(leaves(palm)):
        age = k / (palm.fronds - 1)
        foot = top - along * (0.02 + 0.24 * age)
        out = np.array([math.cos(leaf.azimuth), 0.0, math.sin(leaf.azimuth)])
        add_leaf(model, palm, leaf, foot + out * (0.03 + 0.05 * age))
    add_nuts(model, palm, top)
    return model


def write_model(out: Path) -> None:
    """Writes the palms, and palm.mtl, which they share, under out/palm."""
    (out / "palm").mkdir(parents=True, exist_ok=True)
    note = "A coconut palm, made by raw_assets/make/palm.py; metres, Y up"
    for name, palm in PALMS.items():
        build(palm).write(out / f"palm/{name}.obj", "palm.mtl", note)
    plain = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0.04 0.04 0.04", "Ns 20", "d 1", "illum 2", "map_Kd palm.ppm"]
    glossy = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0.30 0.30 0.30", "Ns 60", "d 1", "illum 2", "map_Kd palm.ppm"]
    leaves_too = [*glossy, "map_d palm_alpha.pgm"]
    write_mtl(out / "palm/palm.mtl", note, {"trunk": plain, "leaves": leaves_too, "nuts": plain})


def make(out: Path) -> None:
    """Writes the palms, palm.mtl, palm.ppm (colour) and palm_alpha.pgm (opacity) under out/palm."""
    write_model(out)
    color, alpha = paint_atlas.atlas()
    write_image(out / "palm/palm.ppm", color, "uint8")
    write_image(out / "palm/palm_alpha.pgm", alpha, "uint8")


if __name__ == "__main__":
    make(Path(sys.argv[1]))

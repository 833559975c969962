"""The nodes of a terrain's tree, and its tables in scene.json (formats/FORMAT.md, "Terrain tiles")."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from decimal import ROUND_CEILING, Context

from paradize.metrics.terrain import TerrainError
from paradize.stages.terrain_tree import Corners, Point
from paradize.visibility.query import Runs, Sphere

_UP = Context(prec=6, rounding=ROUND_CEILING)


@dataclass(eq=False)
class Patch:
    """A node of the tree. made_by: the diamond whose split shows it; None: a root. error: measured. at,
    sizes: where its mesh lies in the spool: byte, vertices, triangles. first_s: when a view first shows
    it."""

    corners: Corners
    level: int
    made_by: Diamond | None = field(repr=False)  # as all that leads round in a circle
    sphere: Sphere
    error: TerrainError | None = None
    at: int = 0
    sizes: tuple[int, int] = (0, 0)
    area_px: float = 0.0
    first_s: float = 0.0
    diamond: Diamond | None = field(default=None, repr=False)

    @property
    def reported_error_m(self) -> float:
        """The measured error, six digits, rounded up."""
        return rounded_up(error_of(self))


@dataclass(eq=False)
class Diamond:
    """patches: the one or two that share its hypotenuse. made: those that its split shows, once it is split.
    runs: in which something below it may be asked for, where that is known. kept: whether it is part of the
    result; then error_m and sphere hold those of all below. first_s: the second that first asks for it."""

    key: Point
    level: int
    patches: list[Patch] = field(default_factory=list, repr=False)
    made: list[Patch] = field(default_factory=list, repr=False)
    split: bool = False
    runs: Runs | None = None
    kept: bool = False
    error_m: float = 0.0
    sphere: Sphere = field(default_factory=lambda: Sphere((0.0, 0.0, 0.0), 0.0))
    first_s: float = math.inf


@dataclass(frozen=True)
class Tree:
    """patches, diamonds: those that are kept; coarse levels first, within a level those needed first.
    left_out: number of the other patches of the whole tree; left_out_bytes: their estimated size.
    needed_s: when the flight first needs the finest level; None if that is the roots'."""

    patches: list[Patch] = field(repr=False)
    diamonds: list[Diamond] = field(repr=False)
    left_out: int
    left_out_bytes: int
    needed_s: float | None


def error_of(patch: Patch) -> float:
    assert patch.error is not None
    return patch.error.max_m


def area_of(polygon: list[tuple[float, float]]) -> float:
    pairs = zip(polygon, [*polygon[1:], *polygon[:1]], strict=True)
    return 0.5 * abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in pairs))


def around(center: tuple[float, float, float], inner: Iterable[Sphere]) -> Sphere:
    """Returns the smallest sphere around `center` that contains all of these, slightly enlarged for
    rounding."""
    radius = 0.0
    for sphere in inner:
        x, y, z = (a - b for a, b in zip(center, sphere.center, strict=True))
        radius = max(radius, math.sqrt(x * x + y * y + z * z) + sphere.radius_m)
    return Sphere(center, radius * (1.0 + 1e-6))


def box_middle(inner: list[Sphere]) -> tuple[float, float, float]:
    low, high = (
        [pick(s.center[k] + sign * s.radius_m for s in inner) for k in range(3)]
        for pick, sign in ((min, -1.0), (max, 1.0))
    )
    x, y, z = (0.5 * (a + b) for a, b in zip(low, high, strict=True))
    return x, y, z


def _spheres(spheres: list[Sphere]) -> dict[str, list[object]]:
    return {
        "center": [[_f32(x) for x in sphere.center] for sphere in spheres],
        "radius_m": [rounded_up(sphere.radius_m) for sphere in spheres],
    }


def columns_of(tree: Tree, tile: list[int], node: list[int]) -> dict[str, dict[str, list[object]]]:
    """The tables `patches` and `diamonds` of scene.json (see FORMAT.md)."""
    index = {id(diamond): i for i, diamond in enumerate(tree.diamonds)}

    def row_of(diamond: Diamond | None) -> int:
        return -1 if diamond is None else index[id(diamond)]

    return {
        "patches": {
            "tile": list(tile),
            "node": list(node),
            "level": [p.level for p in tree.patches],
            "made_by": [row_of(p.made_by) for p in tree.patches],
            "diamond": [row_of(p.diamond) for p in tree.patches],
            **_spheres([p.sphere for p in tree.patches]),
            "error_m": [p.reported_error_m for p in tree.patches],
            "first_needed_s": [_f32(p.first_s) for p in tree.patches],
        },
        "diamonds": {
            "level": [d.level for d in tree.diamonds],
            "error_m": [rounded_up(d.error_m) for d in tree.diamonds],
            **_spheres([d.sphere for d in tree.diamonds]),
        },
    }


def _f32(value: float) -> float:
    """Rounds to seven digits, as a float32 holds."""
    return float(f"{value:.7g}")


def rounded_up(value: float) -> float:
    """Rounds up to six digits. Monotonic: a larger value never gives a smaller result."""
    return float(_UP.create_decimal_from_float(value))

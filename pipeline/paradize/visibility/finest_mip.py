"""The finest mip of a texture and the finest level of a mesh that a flight ever needs.

Texture: the fewest texels of level 0 that one pixel covers along the shorter axis of its footprint (or 1/16
of the longer axis if that is more: no filter takes more samples), anywhere on its surfaces, in any view, at
any moment. Found by branch and bound (A. Land, A. Doig, "An Automatic Method of Solving Discrete Programming
Problems", 1960): boxes of triangles, the one with the lowest bound is split first, each with only those runs
of the flight that may still lower the best value. All bounds are lower bounds, so no pixel needs a mip that
is missing. Mesh: the player's own rule at the smallest distance of any view that draws it.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh
from paradize.placement import UNMOVED, largest_scale, to_world
from paradize.vectors import cross_2d, dot, lengths, squared_lengths
from paradize.visibility.query import Runs, Sphere
from paradize.visibility.texel_footprint import Views

F64 = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
# sqrt(2), half a level: OpenGL 3.3 (3.8.11) allows a device to be finer than the formula by this factor.
SLACK = 1.4142135623730951
MAX_SAMPLES = 16.0  # of anisotropic filtering, along the longer axis, in the player's finest quality
_RESOLVED = 1.0 / 256.0  # of a texel: resolution of samplers
_MAX_BOXES = 6000  # after this number of boxes the lowest bound is the result


@dataclass(frozen=True)
class Surface:
    """Triangles with a texture. corners: (n, 3, 3) metres in object space. density: (n,) smallest number of
    texels of level 0 per metre along the surface."""

    corners: F64
    density: F64


@dataclass(frozen=True)
class Placement:
    """The transform of a surface. instance: position, rotation and scale, as in scene.json. from_m: it is not
    drawn at smaller distances (a coarser level of a mesh)."""

    instance: Mapping[str, Any] = field(default_factory=lambda: UNMOVED)
    from_m: float = 0.0

    @cached_property
    def scale(self) -> float:
        """How many times as long as in object space a distance may be in world space."""
        return largest_scale(self.instance)

    def at(self, point: Sequence[float]) -> tuple[float, float, float]:
        """A point of object space in world space."""
        return to_world(point, self.instance)


@dataclass(frozen=True)
class FinestMip:
    """texels: fewest texels of level 0 that a pixel covers; infinite where no view shows the surface.
    second_s: when; None for the free camera and the light. view: which view."""

    texels: float
    second_s: float | None
    view: str | None

    def level(self) -> int:
        """The finest mip that is ever sampled. A pixel of 2^k to 2^(k + 1) texels samples mips k and k +
        1."""
        level = 0
        while level < 31 and self.texels >= SLACK * float(2 << level):
            level += 1
        return level


def flat_triangles(mesh: Mesh, uvs: npt.NDArray[np.float32], width: int, height: int) -> Bools:
    """(m,) bool: whether a triangle's texture coordinates lie on a line or in a point of a texture of width x
    height texels, so that it shows no area of it."""
    texels = uvs.astype(np.float64)[mesh.triangles] * [width, height]
    p, q = texels[:, 1] - texels[:, 0], texels[:, 2] - texels[:, 0]
    square = np.maximum.reduce([(edge * edge).sum(axis=1) for edge in (p, q, q - p)])
    area = np.abs(cross_2d(p, q))
    return np.asarray(area <= _RESOLVED * np.sqrt(square), np.bool_)


def surface_of(
    mesh: Mesh, uvs: npt.NDArray[np.float32], width: int, height: int, *, flat: bool = True
) -> Surface:
    """The triangles of a mesh with a texture of width x height texels. Triangles without area are left out,
    because they are never drawn.

    The density is the smaller singular value of the map from metres to texels (0 for `flat_triangles`), but
    at least the larger one divided by MAX_SAMPLES (and by SLACK, the tolerance of OpenGL's formula). flat:
    False leaves out `flat_triangles`.
    """
    corners = mesh.absolute_positions[mesh.triangles]
    texels = uvs.astype(np.float64)[mesh.triangles] * [width, height]
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p, q = texels[:, 1] - texels[:, 0], texels[:, 2] - texels[:, 0]
    length = lengths(e)
    safe = np.where(length > 0.0, length, 1.0)
    along = dot(e, f) / safe
    across = np.sqrt(np.maximum(0.0, squared_lengths(f) - along * along))
    drawn = (length > 0.0) & (across > 0.0)
    across = np.where(drawn, across, 1.0)
    # Columns of the map: texels per metre along the first edge and across it.
    u = p / safe[:, None]
    v = (q - u * along[:, None]) / across[:, None]
    a = u[:, 0] * u[:, 0] + u[:, 1] * u[:, 1]
    c = v[:, 0] * v[:, 0] + v[:, 1] * v[:, 1]
    b = u[:, 0] * v[:, 0] + u[:, 1] * v[:, 1]
    half = 0.5 * (a - c)
    largest = np.sqrt(0.5 * (a + c) + np.sqrt(half * half + b * b))
    area = np.abs(cross_2d(u, v))
    lines = flat_triangles(mesh, uvs, width, height)
    smaller = np.where(lines, 0.0, area / np.where(largest > 0.0, largest, 1.0))
    densities = np.maximum(smaller, largest / (MAX_SAMPLES * SLACK))
    drawn &= flat | ~lines
    return Surface(corners[drawn], densities[drawn])


def split_triangles(corners: F64) -> list[tuple[F64, Runs]]:
    """Splits triangles (n, 3, 3) into two halves, and a single triangle into four. With each part the rows of
    the source triangles."""
    if len(corners) == 1:  # four triangles between the midpoints of the sides
        a, b, c = corners[0]
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        return [(np.array([part]), np.zeros(1, np.intp)) for part in parts]
    middles = corners.sum(axis=1)
    axis = int(np.argmax(middles.max(axis=0) - middles.min(axis=0)))
    order = np.argsort(middles[:, axis], kind="stable")
    split = len(order) // 2
    return [(corners[part], part) for part in (order[:split], order[split:])]


def sphere_around(corners: F64) -> tuple[F64, float]:
    """Centre and radius of a sphere around triangles (n, 3, 3), slightly enlarged for rounding."""
    middle = 0.5 * (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1)))
    gap = corners - middle
    return middle, float(lengths(gap).max()) * (1.0 + 1e-6)


@dataclass(frozen=True)
class _Box:
    corners: F64
    density: F64
    place: Placement
    runs: Runs

    def sphere(self) -> Sphere:
        middle, radius = sphere_around(self.corners)
        return Sphere(self.place.at([float(value) for value in middle]), radius * self.place.scale)

    def split_triangles(self) -> list[tuple[F64, F64]]:
        return [(corners, self.density[rows]) for corners, rows in split_triangles(self.corners)]


class _Search:
    """The remaining boxes, lowest bound first, and the best value found so far."""

    def __init__(self, views: Views, spread: float) -> None:
        self.views, self.spread = views, spread
        self.heap: list[tuple[float, int, int, str, _Box]] = []
        self.count = 0
        self.best = FinestMip(float("inf"), None, None)

    def texels(self, covered_m: float, density: float) -> float:
        return max(0.0, covered_m * density - self.spread)

    def add(self, corners: F64, density: F64, place: Placement, runs: Runs) -> None:
        self.count += 1
        box = _Box(corners, density, place, runs)
        density_min = float(density.min()) / place.scale
        from_m = place.from_m * self.views.pixel * self.views.query.corner * self.views.query.corner
        rows = self.views.covered(box.sphere(), runs)
        bound, run, name = float("inf"), 0, ""
        open_runs = np.zeros(len(runs), np.bool_)
        for view, covered in rows.items():
            widths = np.maximum(covered, from_m) if view == "camera" else covered
            shown = widths < np.inf
            open_runs[shown] |= widths[shown] * density_min - self.spread < self.best.texels
            if not shown.any():
                continue
            index = int(np.argmin(widths))
            texels = self.texels(float(widths[index]), density_min)
            if texels < bound:
                bound, run, name = texels, int(runs[index]), view
        if not name or bound >= self.best.texels:
            return
        remaining = runs[open_runs]
        heapq.heappush(self.heap, (bound, self.count, run, name, _Box(corners, density, place, remaining)))
        self._improve_best(box, remaining)

    def _improve_best(self, box: _Box, runs: Runs) -> None:
        """Evaluates a point of the box that is certainly drawn."""
        if box.place.from_m > 0.0:
            return
        k = int(np.argmin(box.density))
        a, b, c = box.corners[k]
        point = box.place.at([float(value) for value in (a + b + c) / 3.0])
        for view, covered in self.views.reached(point, runs).items():
            if not len(covered):
                continue
            index = int(np.argmin(covered))
            texels = self.texels(float(covered[index]), float(box.density[k]) / box.place.scale)
            if covered[index] < np.inf and texels < self.best.texels:
                self.best = FinestMip(texels, *self.views.moment(int(runs[index]), view))


def finest(views: Views, surfaces: Sequence[tuple[Surface, Placement]], spread: float = 0.0) -> FinestMip:
    """The finest mip that the views need of a texture on these surfaces. spread: texels of level 0 by which
    the samples of two neighbouring pixels may move towards each other (parallax)."""
    search = _Search(views, spread)
    for surface, place in surfaces:
        if len(surface.corners):
            search.add(surface.corners, surface.density, place, views.query.runs)
    while search.heap:
        bound, _, run, view, box = heapq.heappop(search.heap)
        low = FinestMip(bound, *views.moment(run, view))
        if bound >= search.best.texels:
            break
        if search.best.level() == low.level() and search.best.texels < float("inf"):
            return FinestMip(bound, search.best.second_s, search.best.view)
        if search.count > _MAX_BOXES:
            return low
        for corners, density in box.split_triangles():
            search.add(corners, density, box.place, box.runs)
    return search.best


def finest_lod(
    views: Views,
    center: Sequence[float],
    radius_m: float,
    errors_m: Sequence[float],
    places: Sequence[Placement],
) -> tuple[int, float | None, str | None, list[float | None]]:
    """The finest level of a mesh that the player ever selects, with the second and the view that need it
    first: at its smallest distance among the runs that show it; and of each level the second of the flight
    from which on it or a finer one is selected (None: never). errors_m: of the levels, finest first. The
    coarsest level where the mesh is never shown."""
    query = views.query
    coarser_m = [min(errors_m[k + 1 :], default=np.inf) for k in range(len(errors_m))]
    seconds = np.full(len(errors_m), np.inf)
    level, second, view = len(errors_m) - 1, None, None
    for place in places:
        sphere = Sphere(place.at(center), radius_m * place.scale)
        for name, covered in views.covered(sphere, query.runs).items():
            runs = query.runs[covered < np.inf]
            if not len(runs):
                continue
            distance = query.nearest(sphere, runs)
            # The player accepts a level with an error of at most this at this distance.
            accepted = distance * (1.0 - 1e-5) / query.pixels
            accepted[distance <= query.near_m[runs]] = 0.0
            for k, error_m in enumerate(coarser_m):
                needed = runs[(error_m * place.scale > accepted) & (query.start_s[runs] < query.duration_s)]
                if len(needed):
                    seconds[k] = min(seconds[k], query.start_s[needed[0]])
            index = int(np.argmin(accepted))
            own_level = 0
            for k in range(len(errors_m) - 1, 0, -1):
                if errors_m[k] * place.scale <= accepted[index]:
                    own_level = k
                    break
            if own_level < level or second is None:
                own_second, own_view = views.moment(int(runs[index]), name)
                if own_level < level or view is None:
                    level, second, view = min(own_level, level), own_second, own_view
    return level, second, view, [float(value) if value < np.inf else None for value in seconds]

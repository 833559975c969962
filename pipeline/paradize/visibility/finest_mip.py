"""The finest mip of a texture, and the finest level of a mesh, that a flight ever asks for.

A texture: the fewest texels of its level 0 that one pixel covers along the shorter axis (or a sixteenth of
the longer one, where that is more: no filter takes more samples), anywhere on the surface that wears it, in
any view, at any moment. Found by branch and bound (A. Land, A. Doig, "An Automatic
Method of Solving Discrete Programming Problems", 1960): boxes of triangles, halved where their bound is
lowest, each only with the runs of the flight that could still lower what is known to be seen. Every bound is
from below, so that no pixel ever asks for a mip that is not there. A mesh: the player's own rule, at the
nearest that a view which draws it comes.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh
from paradize.scene.flight import sine_cosine
from paradize.scene.placement import placed
from paradize.visibility.query import Runs, Sphere
from paradize.visibility.texel_footprint import Views

F64 = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
# Half a level: what OpenGL 3.3 (3.8.11) allows a device to be finer than the formula, sqrt(2).
SLACK = 1.4142135623730951
MOST_SAMPLES = 16.0  # of anisotropic filtering, along the longer axis, in the player's finest quality
_RESOLVED = 1.0 / 256.0  # of a texel: what samplers tell apart
_MOST = 6000  # boxes looked at; then the lowest bound stands


@dataclass(frozen=True)
class Surface:
    """Triangles that wear a texture. corners: (n, 3, 3) metres in their own space. density: (n,) texels of
    level 0 that a metre along the surface crosses at least."""

    corners: F64
    density: F64


@dataclass(frozen=True)
class Placement:
    """Where a surface stands: turned by yaw about +Y, scaled, moved. from_m: nearer than this it is not
    drawn (a coarser level of a mesh)."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    scale: float = 1.0
    from_m: float = 0.0

    def at(self, point: Sequence[float]) -> tuple[float, float, float]:
        """A point of the surface's space in the world."""
        return placed(point, self.position, sine_cosine(self.yaw_deg), self.scale)


@dataclass(frozen=True)
class FinestMip:
    """texels: of level 0 that a pixel covers at least; infinite where no view shows any of it. second_s:
    when, None where it is no moment of the flight. view: which asked."""

    texels: float
    second_s: float | None
    view: str | None

    def level(self) -> int:
        """The finest level that is ever sampled: the mips of a pixel between 2^k and 2^(k + 1) texels are k
        and k + 1."""
        level = 0
        while level < 31 and self.texels >= SLACK * float(2 << level):
            level += 1
        return level


def flat_triangles(mesh: Mesh, uvs: npt.NDArray[np.float32], width: int, height: int) -> Bools:
    """(m,): whether the texture coordinates of a triangle lie on one line or in one point of a texture of
    width x height texels, so that it shows no area of it."""
    texels = uvs.astype(np.float64)[mesh.triangles] * [width, height]
    p, q = texels[:, 1] - texels[:, 0], texels[:, 2] - texels[:, 0]
    square = np.maximum.reduce([(edge * edge).sum(axis=1) for edge in (p, q, q - p)])
    area = np.abs(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
    return np.asarray(area <= _RESOLVED * np.sqrt(square), np.bool_)


def surface_of(
    mesh: Mesh, uvs: npt.NDArray[np.float32], width: int, height: int, *, flat: bool = True
) -> Surface:
    """A mesh's triangles with a texture of width x height texels. Triangles without area are never drawn and
    left out. The least density is the smaller singular value of the map from metres to texels (none on
    `flat_triangles`), but at least what MOST_SAMPLES leave of the larger one (which the formula of OpenGL
    takes for less by SLACK at most). flat: False leaves `flat_triangles` out."""
    corners = mesh.places[mesh.triangles]
    texels = uvs.astype(np.float64)[mesh.triangles] * [width, height]
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p, q = texels[:, 1] - texels[:, 0], texels[:, 2] - texels[:, 0]
    length = np.sqrt(e[:, 0] * e[:, 0] + e[:, 1] * e[:, 1] + e[:, 2] * e[:, 2])
    safe = np.where(length > 0.0, length, 1.0)
    along = (e[:, 0] * f[:, 0] + e[:, 1] * f[:, 1] + e[:, 2] * f[:, 2]) / safe
    square = f[:, 0] * f[:, 0] + f[:, 1] * f[:, 1] + f[:, 2] * f[:, 2]
    across = np.sqrt(np.maximum(0.0, square - along * along))
    real = (length > 0.0) & (across > 0.0)
    across = np.where(real, across, 1.0)
    # Columns of the map: texels for a metre along the first edge, and for one across it.
    u = p / safe[:, None]
    v = (q - u * along[:, None]) / across[:, None]
    a = u[:, 0] * u[:, 0] + u[:, 1] * u[:, 1]
    c = v[:, 0] * v[:, 0] + v[:, 1] * v[:, 1]
    b = u[:, 0] * v[:, 0] + u[:, 1] * v[:, 1]
    half = 0.5 * (a - c)
    largest = np.sqrt(0.5 * (a + c) + np.sqrt(half * half + b * b))
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    lines = flat_triangles(mesh, uvs, width, height)
    smaller = np.where(lines, 0.0, area / np.where(largest > 0.0, largest, 1.0))
    least = np.maximum(smaller, largest / (MOST_SAMPLES * SLACK))
    real &= flat | ~lines
    return Surface(corners[real], least[real])


def halves(corners: F64) -> list[tuple[F64, Runs]]:
    """Triangles (n, 3, 3) in two halves that lie apart, a single one in four; with each part the rows that
    its triangles come from."""
    if len(corners) == 1:  # four triangles between the middles of the sides
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
    """Middle and radius of a sphere that holds triangles (n, 3, 3), a little larger for rounding."""
    middle = 0.5 * (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1)))
    gap = corners - middle
    square = gap[..., 0] * gap[..., 0] + gap[..., 1] * gap[..., 1] + gap[..., 2] * gap[..., 2]
    return middle, float(np.sqrt(square.max())) * (1.0 + 1e-6)


@dataclass(frozen=True)
class _Box:
    corners: F64
    density: F64
    place: Placement
    runs: Runs

    def sphere(self) -> Sphere:
        middle, radius = sphere_around(self.corners)
        return Sphere(self.place.at([float(value) for value in middle]), radius * self.place.scale)

    def halves(self) -> list[tuple[F64, F64]]:
        return [(corners, self.density[rows]) for corners, rows in halves(self.corners)]


class _Search:
    """The boxes that are left, the lowest bound first, and the least that is known to be seen."""

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
        least = float(density.min()) / place.scale
        from_m = place.from_m * self.views.pixel * self.views.demand.corner * self.views.demand.corner
        rows = self.views.covered(box.sphere(), runs)
        bound, run, name = float("inf"), 0, ""
        wanted = np.zeros(len(runs), np.bool_)
        for view, covered in rows.items():
            far = np.maximum(covered, from_m) if view == "camera" else covered
            shown = far < np.inf
            wanted[shown] |= far[shown] * least - self.spread < self.best.texels
            at = int(np.argmin(far)) if len(far) else 0
            if len(far) and far[at] < np.inf and self.texels(float(far[at]), least) < bound:
                bound, run, name = self.texels(float(far[at]), least), int(runs[at]), view
        if not name or bound >= self.best.texels:
            return
        left = runs[wanted]
        heapq.heappush(self.heap, (bound, self.count, run, name, _Box(corners, density, place, left)))
        self._see(box, left)

    def _see(self, box: _Box, runs: Runs) -> None:
        """What a place of the box that is surely drawn shows."""
        if box.place.from_m > 0.0:
            return
        k = int(np.argmin(box.density))
        a, b, c = box.corners[k]
        point = box.place.at([float(value) for value in (a + b + c) / 3.0])
        for view, covered in self.views.reached(point, runs).items():
            if not len(covered):
                continue
            at = int(np.argmin(covered))
            found = self.texels(float(covered[at]), float(box.density[k]) / box.place.scale)
            if covered[at] < np.inf and found < self.best.texels:
                self.best = FinestMip(found, *self.views.moment(int(runs[at]), view))


def finest(views: Views, worn: Sequence[tuple[Surface, Placement]], spread: float = 0.0) -> FinestMip:
    """What the views ever ask of a texture that these surfaces wear. spread: texels of level 0 by which what
    two neighbouring pixels sample may be moved towards each other (parallax)."""
    search = _Search(views, spread)
    for surface, place in worn:
        if len(surface.corners):
            search.add(surface.corners, surface.density, place, views.demand.runs)
    while search.heap:
        bound, _, run, view, box = heapq.heappop(search.heap)
        low = FinestMip(bound, *views.moment(run, view))
        if bound >= search.best.texels:
            break
        if search.best.level() == low.level() and search.best.texels < float("inf"):
            return FinestMip(bound, search.best.second_s, search.best.view)
        if search.count > _MOST:
            return low
        for corners, density in box.halves():
            search.add(corners, density, box.place, box.runs)
    return search.best


def finest_lod(
    views: Views,
    center: Sequence[float],
    radius_m: float,
    errors_m: Sequence[float],
    places: Sequence[Placement],
) -> tuple[int, float | None, str | None]:
    """The finest level of a mesh that the player ever takes, the second that first asks for it and the view:
    where it is nearest among the moments that show it. errors_m: of its levels, the finest first. The
    coarsest level where it is never shown."""
    demand = views.demand
    level, second, view = len(errors_m) - 1, None, None
    for place in places:
        sphere = Sphere(place.at(center), radius_m * place.scale)
        for name, covered in views.covered(sphere, demand.runs).items():
            runs = demand.runs[covered < np.inf]
            if not len(runs):
                continue
            away = demand.nearest(sphere, runs)
            # The player lets a level be that is off by so much at this distance.
            accepted = away * (1.0 - 1e-5) / demand.pixels
            accepted[away <= demand.near_m[runs]] = 0.0
            at = int(np.argmin(accepted))
            own = 0
            for k in range(len(errors_m) - 1, 0, -1):
                if errors_m[k] * place.scale <= accepted[at]:
                    own = k
                    break
            if own < level or second is None:
                told_s, told_view = views.moment(int(runs[at]), name)
                if own < level or view is None:
                    level, second, view = min(own, level), told_s, told_view
    return level, second, view

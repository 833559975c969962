"""Finds the patches and diamonds of a height field that the player needs for a flight.

From the roots down, a diamond is split if some part of the flight could need finer detail below it (its error
may be as large as its level's tolerance), and every new patch is measured. Then, from the finest level up, a
split stays if a patch's measured error is too large in a view that shows it, or if a split below needs it.
"""

from __future__ import annotations

import math
import weakref
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from tempfile import TemporaryFile
from threading import Lock

import numpy as np

from paradize.bakers.terrain.tree import Diamond, Patch, Tree, area_of, around, box_middle, error_of
from paradize.data import Heightfield, Mesh, QuantisationGrid, QuantisedValues
from paradize.errors import BakeError
from paradize.formats.glb.quantised import decoded_mesh
from paradize.kernels.terrain import patch
from paradize.kernels.threads import default_threads
from paradize.metrics.terrain import TerrainError, patch_error
from paradize.stages.quantise import direction_bits, quantise, terrain_grid
from paradize.stages.terrain import pixels_mesh
from paradize.stages.terrain_tree import Blocks, Corners, Point, Shape, diamond_of, tolerance
from paradize.visibility.query import Sphere, VisibilityQuery

MOST_VERTICES = 65000  # of a patch: 16-bit indices
TRIES = 4
LARGE_PX = (
    1 << 27
)  # patches whose box has more pixels are made one at a time: their judge holds 8 bytes for each
SHRINK = 1.0 - 1.0 / 1024.0  # room for what rounding to float32 positions adds to an error
_NESTED = (
    1.2072  # |middle of a diamond - anything below it| over its hypotenuse: 1 / (4 - 2 sqrt(2)), and more
)
_BYTES = 1500  # a patch's share of a GLB's JSON, about


class Grower:
    """Grows the tree of one height field. `mesh` returns the mesh of any of its patches."""

    def __init__(
        self,
        heightfield: Heightfield,
        *,
        max_error_m: float,
        leaf_px: int,
        sand_repeat: float,
        query: VisibilityQuery | None,
        quantise: bool = False,
    ) -> None:
        """query: None needs everything. quantise: vertices are quantised to one grid, and errors include
        that. Raises BakeError if there is no such grid."""
        rows, columns = heightfield.heights_m.shape
        self.heightfield, self.max_error_m, self.sand_repeat = heightfield, max_error_m, sand_repeat
        self.query = query
        self.shape = Shape(rows, columns, leaf_px)
        self.blocks = Blocks.of(heightfield.heights_m, max(1, leaf_px // 2))
        low, high = float(self.blocks.low.min()), float(self.blocks.high.max())
        self.grid: QuantisationGrid | None = None
        if quantise:
            sizes = heightfield.size_x_m, heightfield.size_z_m
            self.grid = terrain_grid((rows, columns), sizes, (low, high), max_error_m)
        self.least_m = (high - low) / 65536.0
        self.steps = heightfield.size_z_m / (rows - 1), heightfield.size_x_m / (columns - 1)
        self.levels: list[dict[Point, Diamond]] = [{} for _ in range(self.shape.finest + 1)]
        self.patches: list[Patch] = []
        self._spool = TemporaryFile()  # noqa: SIM115 (lives as long as the tree)
        weakref.finalize(self, self._spool.close)
        self._end = 0
        self._lock, self._large = Lock(), Lock()

    def grow(self) -> Tree:
        """Returns the tree. Raises BakeError if float32 positions cannot hold the finest level's error."""
        with ThreadPoolExecutor(default_threads(8)) as pool:
            list(pool.map(self._make, [self._patch(corners, 0, None) for corners in self.shape.roots()]))
            growing = True
            while growing:  # once more where a split brought something new at a level that was done
                growing = False
                for level in range(self.shape.finest):
                    rest = [diamond for diamond in self.levels[level].values() if not diamond.split]
                    asked = [diamond for diamond in rest if self._may_ask(diamond)]
                    new = [made for diamond in asked for made in self._split(diamond)]
                    list(pool.map(self._make, new))
                    growing |= bool(new)
        self._keep()
        return self._tree()

    def mesh(self, patch: Patch) -> Mesh:
        """The mesh of a patch, in the whole terrain's space, as floats."""
        vertices, triangles = patch.sizes
        self._spool.seek(patch.at)
        packed = np.frombuffer(self._spool.read(4 * vertices + 6 * triangles), np.uint16)
        pixels = packed[: 2 * vertices].reshape(-1, 2).astype(np.int32)
        return pixels_mesh(
            self.heightfield,
            pixels,
            packed[2 * vertices :].reshape(-1, 3).astype(np.uint32),
            sand_repeat=self.sand_repeat,
        )

    def quantised(self, mesh: Mesh) -> QuantisedValues | None:
        """The vertices of a patch's mesh as a file shall hold them; None: as floats."""
        if self.grid is None:
            return None
        most = self.sand_repeat * max(1.0, self.heightfield.size_z_m / self.heightfield.size_x_m)
        bits = direction_bits(self.grid)
        return quantise(mesh, self.grid, direction_bits=bits, float_uvs=most > 1.0)

    def _shown(self, mesh: Mesh) -> Mesh:
        """The mesh as a reader of its file has it."""
        values = self.quantised(mesh)
        return mesh if values is None else decoded_mesh(mesh, values)

    def tolerance_m(self, level: int) -> float:
        """The vertical tolerance of a level; of borders too."""
        finest = self.shape.finest
        rounding = 0.5 * self.grid.step[1] if self.grid else 0.0
        finest_m = max(0.0, self.max_error_m - rounding)
        return SHRINK * tolerance(min(level, finest), finest, finest_m, self.least_m)

    # -- down: making patches

    def _patch(self, corners: Corners, level: int, made_by: Diamond | None) -> Patch:
        polygon = self.shape.clipped(corners)
        found = Patch(corners, level, made_by, self._hull(polygon, corners), area_px=area_of(polygon))
        key = diamond_of(corners)
        found.diamond = self.levels[level].setdefault(key, Diamond(key, level))
        found.diamond.patches.append(found)
        self.patches.append(found)
        if made_by is not None:
            made_by.made.append(found)
        return found

    def _split(self, diamond: Diamond) -> list[Patch]:
        """Splits a diamond and returns all new patches. If its second patch does not exist yet, the diamond
        that makes that patch is split first."""
        if diamond.split:
            return []
        new: list[Patch] = []
        if len(diamond.patches) == 1:
            a, b, c = diamond.patches[0].corners
            other: Corners = ((b[0] + c[0] - a[0], b[1] + c[1] - a[1]), c, b)
            if self.shape.exists(other):
                # The middle of the diamond that makes it is its right angle; all four of that diamond's parts
                # were made together with the one that is here, so it is there.
                new = self._split(self.levels[diamond.level - 1][2 * other[0][0], 2 * other[0][1]])
        diamond.split = True
        return new + [
            self._patch(half, diamond.level + 1, diamond)
            for whole in diamond.patches
            for half in self.shape.halves(whole.corners)
        ]

    def _make(self, new: Patch) -> None:
        """Meshes and measures a patch; runs on any thread."""
        with self._large if self._box_px(new) > LARGE_PX else nullcontext():
            packed, sizes, error = self._made(new)
        with self._lock:
            self._spool.seek(self._end)
            self._spool.write(packed)
            new.at, self._end = self._end, self._end + len(packed)
        new.error, new.sizes = error, sizes

    def _box_px(self, new: Patch) -> float:
        rows, columns = zip(*self.shape.clipped(new.corners), strict=True)
        return float((max(rows) - min(rows) + 1) * (max(columns) - min(columns) + 1))

    def _made(self, new: Patch) -> tuple[bytes, tuple[int, int], TerrainError]:
        """The pixels and triangles of a patch as bytes, how many there are, and its error."""
        finest = new.level == self.shape.finest
        inside = self.tolerance_m(new.level)
        for _ in range(TRIES):
            vertices, triangles = patch(
                self.heightfield.heights_m,
                new.corners,
                inside,
                self.tolerance_m(new.level),
                self.tolerance_m(new.level + 1),
                most_vertices=MOST_VERTICES,
            )
            mesh = self._shown(
                pixels_mesh(self.heightfield, vertices, triangles, sand_repeat=self.sand_repeat)
            )
            error = patch_error(mesh, self.heightfield, new.corners)
            if not finest or error.max_m <= self.max_error_m or inside == 0.0:
                break
            inside = max(0.0, inside - 4.0 * (error.max_m - self.max_error_m))
        self._require_good(new, error, finest)
        packed = vertices.astype(np.uint16).tobytes() + triangles.astype(np.uint16).tobytes()
        return packed, (len(vertices), len(triangles)), error

    def _require_good(self, new: Patch, error: TerrainError, finest: bool) -> None:
        if error.holes or error.flipped or error.strays:
            raise BakeError(
                f"a patch of the terrain misses {error.holes} pixels, covers {error.strays} that are not its "
                f"own and has {error.flipped} triangles that do not face up; neighbouring pixels fall on one "
                "float32 position",
                place=f"pixel ({new.corners[0][1]}, {new.corners[0][0]})",
                mend="give the terrain a larger size, or the heightmap fewer pixels",
            )
        if finest and error.max_m > self.max_error_m > 0.0:
            what = "16-bit positions" if self.grid else "float32 positions"
            raise BakeError(
                f"the error is {error.max_m:.6g} m, allowed {self.max_error_m:.6g} m: {what} reach no less",
                place=f"pixel ({error.worst[1]}, {error.worst[0]})",
                mend="allow a larger error, or a smaller terrain",
            )

    def _may_ask(self, diamond: Diamond) -> bool:
        """Whether some run may ask for anything below the diamond; keeps those runs."""
        if self.query is None:
            return True
        runs = self.query.runs
        for whole in diamond.patches:
            maker = whole.made_by
            if maker is not None and maker.runs is not None and len(maker.runs) < len(runs):
                runs = maker.runs
        reach, low, high = self._reach(diamond)
        below = min(self.tolerance_m(diamond.level + 1), high - low)
        error_m = max([below, *(error_of(whole) for whole in diamond.patches)])
        runs = self.query.wanting(error_m, reach, runs)
        diamond.runs = self.query.seeing(reach, runs)
        return len(diamond.runs) > 0

    def _reach(self, diamond: Diamond) -> tuple[Sphere, float, float]:
        """A sphere that holds those of everything that may be made below a diamond, and the range of heights
        there."""
        _, b, c = diamond.patches[0].corners
        row, column = diamond.key[0] / 2.0, diamond.key[1] / 2.0
        span = _NESTED * math.sqrt((b[0] - c[0]) ** 2 + (b[1] - c[1]) ** 2)
        corners = [(row - span, column - span), (row + span, column + span)]
        low, high = self.blocks.range(
            [
                (min(max(r, 0.0), self.shape.rows - 1.0), min(max(k, 0.0), self.shape.columns - 1.0))
                for r, k in corners
            ]
        )
        step_z, step_x = self.steps
        radius = span * max(step_x, step_z) + 1.5 * (high - low)
        return Sphere(self._place(row, column, 0.5 * (low + high)), radius), low, high

    # -- up: keeping what is asked for

    def _keep(self) -> None:
        for level in reversed(self.levels[:-1]):
            for diamond in level.values():
                if not diamond.split:
                    continue
                self._ask(diamond)
                below = {id(made.diamond): made.diamond for made in diamond.made if made.diamond is not None}
                kept = [child for child in below.values() if child.kept]
                diamond.kept = diamond.first_s < math.inf or bool(kept)
                if diamond.kept:
                    self._saturate(diamond, kept)

    def _ask(self, diamond: Diamond) -> None:
        """Notes when the flight first asks for more than the diamond's own patches."""
        if self.query is None:
            diamond.first_s = 0.0
            return
        for whole in diamond.patches:
            runs = self.query.runs if diamond.runs is None else diamond.runs
            runs = self.query.wanting(error_of(whole), whole.sphere, runs)
            runs = self.query.seeing(whole.sphere, runs)
            if len(runs):
                diamond.first_s = min(diamond.first_s, float(self.query.start_s[runs[0]]))

    def _saturate(self, diamond: Diamond, below: list[Diamond]) -> None:
        inner = [whole.sphere for whole in diamond.patches] + [child.sphere for child in below]
        diamond.error_m = max([error_of(w) for w in diamond.patches] + [child.error_m for child in below])
        low, high = self.blocks.range([p for w in diamond.patches for p in self.shape.clipped(w.corners)])
        row, column = diamond.key[0] / 2.0, diamond.key[1] / 2.0
        middle = self._place(row, column, 0.5 * (low + high))
        diamond.sphere = min(
            (around(center, inner) for center in (middle, box_middle(inner))), key=lambda s: s.radius_m
        )

    def _tree(self) -> Tree:
        patches = [p for p in self.patches if p.made_by is None or p.made_by.kept]
        diamonds = [d for level in self.levels for d in level.values() if d.kept]
        for kept in patches:
            kept.first_s = self._first_seen(kept)
            if kept.diamond is not None and not kept.diamond.kept:
                kept.diamond = None
        patches.sort(key=lambda p: (p.level, p.first_s, diamond_of(p.corners), p.corners))
        diamonds.sort(key=lambda d: (d.level, d.first_s, d.key))
        finest = patches[-1].level
        asked = min((d.first_s for d in diamonds if d.level == finest - 1), default=math.inf)
        whole = self.shape.count()
        left, bytes_left, mean = 0, 0.0, float(_BYTES)
        for level, count in enumerate(whole):
            known = [p for p in self.patches if p.level == level]
            if known:
                mean = sum(self._bytes(p) for p in known) / len(known)
            absent = count - sum(p.level == level for p in patches)
            left, bytes_left = left + absent, bytes_left + mean * absent
        return Tree(patches, diamonds, left, round(bytes_left), asked if asked < math.inf else None)

    def _bytes(self, known: Patch) -> int:
        """About how long a patch is in a tile: 56 bytes a vertex as floats, 28 or so quantised."""
        vertices, triangles = known.sizes
        return (56 if self.grid is None else 28) * vertices + 6 * triangles + _BYTES

    def _first_seen(self, kept: Patch) -> float:
        """When a view first shows the patch while the player draws it or finer; the flight's end if never."""
        if self.query is None:
            return 0.0
        runs = self.query.runs
        if kept.made_by is not None:
            runs = self.query.wanting(kept.made_by.error_m, kept.made_by.sphere, runs)
        runs = self.query.seeing(kept.sphere, runs)
        return float(self.query.start_s[runs[0]]) if len(runs) else self.query.duration_s

    # -- places

    def _place(self, row: float, column: float, height_m: float) -> tuple[float, float, float]:
        step_z, step_x = self.steps
        return (
            column * step_x - 0.5 * self.heightfield.size_x_m,
            height_m,
            row * step_z - 0.5 * self.heightfield.size_z_m,
        )

    def _hull(self, polygon: list[tuple[float, float]], corners: Corners) -> Sphere:
        """A sphere around a patch at all its heights."""
        low, high = self.blocks.range(polygon)
        points = [Sphere(self._place(r, c, y), 0.0) for r, c in polygon for y in (low, high)]
        (r0, c0), (r1, c1) = corners[1], corners[2]
        middle = self._place(0.5 * (r0 + r1), 0.5 * (c0 + c1), 0.5 * (low + high))
        return min(
            (around(center, points) for center in (middle, box_middle(points))), key=lambda s: s.radius_m
        )

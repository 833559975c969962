"""The tree of a terrain's patches: every cut covers the ground once and has no cracks; errors are those that
an independent judge finds; what any moment of a flight wants is baked."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from paradize.bake_demand import Demand, Sphere, plan_demand
from paradize.bake_terrain_grow import MOST_VERTICES, Grower
from paradize.bake_terrain_tree import Tree, columns_of
from paradize.data import Heightfield, Mesh
from paradize.errors import BakeError
from paradize.flight import plan_flight
from paradize.formats.glb_codes import decoded_mesh
from paradize.formats.terrain_tables import check_tree
from paradize.metrics.terrain import patch_error
from paradize.scene import EyePoint, Flight, TargetPoint
from paradize.stages.terrain_tree import Blocks, Shape, diamond_of
from tests.pipeline.terrain_cut import drawn, split_diamonds

PIXELS = 500.0


def rough(rows: int, columns: int, seed: int = 5) -> Heightfield:
    """Hills with a plain and a cliff, so that patches differ in how much they need."""
    rng = np.random.default_rng(seed)
    r, c = np.mgrid[0:rows, 0:columns].astype(np.float64)
    heights = 3.0 * np.sin(r / 9.0) * np.cos(c / 7.0) + 0.3 * rng.standard_normal((rows, columns))
    heights[: rows // 3, : columns // 2] = -1.0
    heights[rows // 2 :, columns // 2 :] += 6.0
    return Heightfield(heights.astype(np.float32), float(columns - 1), 0.5 * (rows - 1))


def grown(ground: Heightfield, leaf_px: int = 8, demand: Demand | None = None) -> tuple[Grower, Tree]:
    grower = Grower(ground, max_error_m=0.2, leaf_px=leaf_px, sand_repeat=3.0, demand=demand)
    return grower, grower.grow()


def tables_of(tree: Tree) -> dict[str, Any]:
    count = len(tree.patches)
    return columns_of(tree, [0] * count, list(range(count)))


FIELDS = {
    "square": rough(65, 65),
    "wide": rough(20, 75),
    "tall": rough(61, 13),
    "small": rough(2, 2),
    "line": rough(2, 40),
}


@pytest.fixture(scope="module", params=list(FIELDS))
def whole(request: pytest.FixtureRequest) -> tuple[Grower, Tree, list[Mesh], dict[str, Any]]:
    grower, tree = grown(FIELDS[request.param])
    return grower, tree, [grower.mesh(patch) for patch in tree.patches], tables_of(tree)


def some_cuts(tables: dict[str, Any], count: int) -> list[list[bool]]:
    """Cuts of eyes near and far, and those of whole levels."""
    rng = np.random.default_rng(3)
    eyes = [tuple(float(x) for x in rng.uniform(-40, 40, 3) * [1, 0.3, 1]) for _ in range(count)]
    cuts = [split_diamonds(tables, eye, float(10 ** rng.uniform(0, 3)), 0.1) for eye in eyes]  # type: ignore[arg-type]
    levels = tables["diamonds"]["level"]
    return cuts + [[level < top for level in levels] for top in range(max(levels, default=0) + 2)]


def test_every_cut_covers_every_point_of_the_rectangle_once(whole: Any) -> None:
    grower, tree, _, tables = whole
    rows, columns = grower.shape.rows, grower.shape.columns
    rng = np.random.default_rng(9)
    places = rng.uniform([0, 0], [rows - 1, columns - 1], (400, 2))
    inside = np.stack([_holds(patch.corners, places) for patch in tree.patches])
    for split in some_cuts(tables, 40):
        assert (inside[drawn(tables, split)].sum(axis=0) == 1).all()


def _holds(corners: Any, places: np.ndarray) -> np.ndarray:
    """Which places (n, 2) lie in a triangle; places on an edge have no chance."""
    sides = []
    for (r0, c0), (r1, c1) in pairwise([*corners, corners[0]]):
        sides.append((r1 - r0) * (places[:, 1] - c0) - (c1 - c0) * (places[:, 0] - r0))
    signs = np.sign(np.stack(sides))
    return np.asarray((signs == signs[0]).all(axis=0))


def test_a_split_diamond_has_all_that_stands_above_it_split(whole: Any) -> None:
    tables = whole[3]
    patches = tables["patches"]
    for split in some_cuts(tables, 40):
        for p, d in enumerate(patches["diamond"]):
            if d >= 0 and split[d]:
                assert patches["made_by"][p] == -1 or split[patches["made_by"][p]]


def test_errors_and_spheres_alone_make_every_cut_whole(whole: Any) -> None:
    """No eye wants a diamond without wanting what makes its patches: so it may be split where it stands."""
    tables = whole[3]
    diamonds, patches = tables["diamonds"], tables["patches"]
    rng = np.random.default_rng(4)
    for _ in range(300):
        eye, pixels = rng.uniform(-40, 40, 3), 10 ** rng.uniform(0, 3)
        wants = [
            error * pixels > max(0.1, math.dist(eye, center) - radius * (1 + 1e-5))
            for error, center, radius in zip(
                diamonds["error_m"], diamonds["center"], diamonds["radius_m"], strict=True
            )
        ]
        for p, d in enumerate(patches["diamond"]):
            if d >= 0 and wants[d] and patches["made_by"][p] >= 0:
                assert wants[patches["made_by"][p]]


def border(mesh: Mesh) -> Counter[tuple[bytes, bytes]]:
    """Edges of one triangle alone, each end as the bits of its position, normal, tangent and both UVs."""
    assert mesh.normals is not None and mesh.tangents is not None
    assert mesh.uvs is not None and mesh.uvs1 is not None
    bits = np.concatenate([mesh.positions, mesh.normals, mesh.tangents, mesh.uvs, mesh.uvs1], axis=1)
    ends = [row.tobytes() for row in bits]
    edges: Counter[tuple[bytes, bytes]] = Counter()
    for triangle in mesh.triangles.tolist():
        for a, b in pairwise([*triangle, triangle[0]]):
            edges[min(ends[a], ends[b]), max(ends[a], ends[b])] += 1
    return Counter({edge: 1 for edge, count in edges.items() if count == 1})


def on_rim(edge: tuple[bytes, bytes], ground: Heightfield) -> bool:
    (x0, _, z0), (x1, _, z1) = (np.frombuffer(end, np.float32)[:3] for end in edge)
    half_x, half_z = np.float32(ground.size_x_m / 2), np.float32(ground.size_z_m / 2)
    return bool((x0 == x1 and abs(x0) == half_x) or (z0 == z1 and abs(z0) == half_z))


def test_no_cut_has_a_crack_or_a_t_junction(whole: Any) -> None:
    """An edge that is the border of one drawn patch is that of exactly one other, bit by bit, or on the
    rim."""
    grower, _, meshes, tables = whole
    rims = [border(mesh) for mesh in meshes]
    for split in some_cuts(tables, 30):
        edges = sum((rims[p] for p in drawn(tables, split)), Counter())
        assert max(edges.values()) <= 2
        for edge, count in edges.items():
            assert (count == 1) == on_rim(edge, grower.ground)


def test_every_pair_of_patches_that_a_cut_may_show_shares_its_border_bit_by_bit(whole: Any) -> None:
    """Walks each shared border of each pair, of one level or of two that follow each other."""
    grower, tree, meshes, _ = whole
    sides: dict[frozenset[tuple[float, float]], list[tuple[int, int]]] = {}
    for p, patch in enumerate(tree.patches):
        a, b, c = patch.corners
        for level, ends in ((patch.level, (b, c)), (patch.level + 1, (a, b)), (patch.level + 1, (c, a))):
            sides.setdefault(frozenset(ends), []).append((p, level))
    walked = 0
    for side, owners in sides.items():
        assert len({level for _, level in owners}) == 1  # an edge is of one level, whoever has it
        lines = [_along(meshes[p], grower.ground, tuple(side)) for p, _ in owners]
        for line in lines[1:]:
            assert line == lines[0]
            walked += len(line)
    assert walked > 0 or len(tree.patches) < 3


def _along(mesh: Mesh, ground: Heightfield, ends: Any) -> list[bytes]:
    """The vertices of a mesh on the line between two pixels, in order: their bits."""
    rows, columns = ground.heights_m.shape
    assert mesh.normals is not None and mesh.tangents is not None
    r = (mesh.positions[:, 2] / ground.size_z_m + 0.5) * (rows - 1)
    c = (mesh.positions[:, 0] / ground.size_x_m + 0.5) * (columns - 1)
    (r0, c0), (r1, c1) = sorted(ends)
    on = np.abs((r1 - r0) * (np.rint(c) - c0) - (c1 - c0) * (np.rint(r) - r0)) == 0
    bits = np.concatenate([mesh.positions, mesh.normals, mesh.tangents], axis=1)[on]
    order = np.lexsort((np.rint(c[on]), np.rint(r[on])))
    return [bits[k].tobytes() for k in order]


def test_the_error_of_a_patch_is_what_brute_force_finds(whole: Any) -> None:
    grower, tree, meshes, _ = whole
    heights = grower.ground.heights_m
    rows, columns = heights.shape
    for patch, mesh in zip(tree.patches, meshes, strict=True):
        worst, covered = 0.0, set()
        r = (mesh.positions[:, 2].astype(np.float64) / grower.ground.size_z_m + 0.5) * (rows - 1)
        c = (mesh.positions[:, 0].astype(np.float64) / grower.ground.size_x_m + 0.5) * (columns - 1)
        r, c = np.rint(r).astype(int), np.rint(c).astype(int)
        y = mesh.positions[:, 1].astype(np.float64)
        for i, j, k in mesh.triangles.tolist():
            span_r = range(min(r[i], r[j], r[k]), max(r[i], r[j], r[k]) + 1)
            span_c = range(min(c[i], c[j], c[k]), max(c[i], c[j], c[k]) + 1)
            area = (r[j] - r[i]) * (c[k] - c[i]) - (c[j] - c[i]) * (r[k] - r[i])
            for row in span_r:
                for column in span_c:
                    u = (r[j] - row) * (c[k] - column) - (c[j] - column) * (r[k] - row)
                    v = (r[k] - row) * (c[i] - column) - (c[k] - column) * (r[i] - row)
                    w = area - u - v
                    if u * area >= 0 and v * area >= 0 and w * area >= 0:
                        height = (u * y[i] + v * y[j] + w * y[k]) / area
                        worst = max(worst, abs(height - float(heights[row, column])))
                        covered.add((row, column))
        assert patch.error is not None
        assert patch.error.max_m == pytest.approx(worst, rel=1e-4, abs=1e-5)
        assert len(covered) >= patch.area_px
        if patch.level == grower.shape.finest:
            assert worst <= 0.2


def test_errors_never_fall_towards_the_roots(whole: Any) -> None:
    check_tree(whole[3] | {"tiles": ["terrain_mesh"]})  # a diamond holds those below it
    patches, diamonds = whole[3]["patches"], whole[3]["diamonds"]
    for p, d in enumerate(patches["diamond"]):
        if d >= 0 and patches["made_by"][p] >= 0:
            assert diamonds["error_m"][d] <= diamonds["error_m"][patches["made_by"][p]]


def test_spheres_hold_their_meshes(whole: Any) -> None:
    _, tree, meshes, _ = whole
    for patch, mesh in zip(tree.patches, meshes, strict=True):
        away = np.linalg.norm(mesh.positions.astype(np.float64) - patch.sphere.center, axis=1)
        assert away.max() <= patch.sphere.radius_m * (1 + 1e-6)


def test_noise_fills_16_bit_indices_and_no_more() -> None:
    """A coarse patch that would need every pixel keeps to the limit, and says what that costs."""
    rng = np.random.default_rng(1)
    ground = Heightfield(rng.uniform(-50, 50, (513, 513)).astype(np.float32), 512.0, 512.0)
    grower = Grower(ground, max_error_m=0.01, leaf_px=128, sand_repeat=1.0, demand=None)
    tree = grower.grow()
    assert max(patch.sizes[0] for patch in tree.patches) <= MOST_VERTICES
    roots = [patch for patch in tree.patches if patch.level == 0]
    assert all(patch.error and patch.error.max_m > 1.0 for patch in roots)
    assert all(p.error and p.error.max_m <= 0.01 for p in tree.patches if p.level == grower.shape.finest)


def test_a_plain_needs_its_corners_only() -> None:
    grower, tree = grown(Heightfield(np.full((65, 65), 2.5, np.float32), 64.0, 64.0), demand=still_demand())
    assert [patch.sizes for patch in tree.patches] == [(3, 1), (3, 1)]
    assert tree.asked_s is None
    assert tree.left_out == sum(grower.shape.count()) - 2


NOISE = np.random.default_rng(0).standard_normal((70, 90))
SPIKE = np.pad([[100.0]], 40)
EXTREMES: dict[str, tuple[np.ndarray, float, float, float]] = {
    # heights, size along x and z, tolerance: metres
    "a millimetre": (NOISE * 1e-6, 1e-3, 1e-3, 1e-7),
    "a thousand kilometres": (NOISE * 1e3, 1e6, 1e6, 1.0),
    "heights of 1e6": (NOISE * 1e6, 100.0, 100.0, 10.0),
    "heights of 1e-6": (NOISE * 1e-6, 100.0, 100.0, 1e-8),
    "two pixels": (NOISE[:2, :2], 1.0, 1.0, 0.01),
    "two rows": (NOISE[:2], 89.0, 1.0, 0.01),
    "two columns": (NOISE[:, :2], 1.0, 69.0, 0.01),
    "a spike": (SPIKE, 80.0, 80.0, 0.5),
    "a step": (np.where(np.arange(81)[:, None] > 40, 10.0, 0.0) * np.ones(81), 80.0, 80.0, 0.5),
    "long pixels": (NOISE, 1e5, 1.0, 0.05),
    "no error": (NOISE, 89.0, 69.0, 0.0),
}


@pytest.mark.parametrize("name", EXTREMES)
@pytest.mark.parametrize("leaf_px", [16, 13, 256])
def test_extremes_keep_the_bound_at_the_finest_level(name: str, leaf_px: int) -> None:
    heights, size_x_m, size_z_m, bound_m = EXTREMES[name]
    ground = Heightfield(np.ascontiguousarray(heights, np.float32), size_x_m, size_z_m)
    grower = Grower(ground, max_error_m=bound_m, leaf_px=leaf_px, sand_repeat=1.0, demand=None)
    tree = grower.grow()
    check_tree(tables_of(tree) | {"tiles": ["terrain_mesh"]})
    finest = [p.error for p in tree.patches if p.level == grower.shape.finest]
    assert finest and all(error and error.max_m <= max(bound_m, 1e-12) for error in finest)


def test_a_bound_that_codes_cannot_hold_is_refused() -> None:
    ground = Heightfield((NOISE * 100).astype(np.float32), 89.0, 69.0)
    grower = Grower(ground, max_error_m=1e-4, leaf_px=16, sand_repeat=1.0, demand=None, quantise=True)
    with pytest.raises(BakeError, match="16-bit codes reach no less") as raised:
        grower.grow()
    assert raised.value.place and raised.value.mend


# -- requirements


def flight_settings(low: bool) -> Flight:
    y = 4.0 if low else 60.0
    eye = tuple(EyePoint(position=p) for p in ((20, y, -10), (5, y, -14), (-25, y + 3, -8), (0, y, 4)))
    target = tuple(TargetPoint(position=p) for p in ((5, 0, -10), (-20, 1, -12), (-20, 0, 5), (18, 0, -2)))
    return Flight(duration_s=12.0, fov_deg=50.0, near_m=0.2, far_m=500.0, eye=eye, target=target)


def sight_of(flight: Flight, **more: Any) -> dict[str, Any]:
    plain = {"mirror_m": None, "water_m": None, "shadow": None, "sun": [0.3, 0.9, 0.3]}
    return {"flight": asdict(flight), "viewport": [160, 90], "error_px": 1.0} | plain | more


def still_demand() -> Demand:
    return plan_demand(sight_of(flight_settings(False)))


def looks(flight: Flight, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Eye and target at moments that no run starts at."""
    planned = plan_flight(flight)
    return [
        (np.array(eye), np.array(target))
        for eye, target in (planned.view(flight.duration_s * (k + 0.37) / count) for k in range(count))
    ]


def visible(
    centers: np.ndarray, radii: np.ndarray, eye: np.ndarray, target: np.ndarray, flight: Flight
) -> np.ndarray:
    """Which spheres (n, 3), (n,) the picture's pyramid may show: those that none of its five planes parts."""
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    tangent = math.tan(math.radians(flight.fov_deg) / 2)
    normals = [ahead]
    for side, slope in ((right, tangent * 160 / 90), (up, tangent)):
        normals += [(slope * ahead + sign * side) / math.hypot(slope, 1.0) for sign in (1.0, -1.0)]
    return np.asarray(((centers - eye) @ np.stack(normals, axis=1) >= -radii[:, None]).all(axis=1))


class Known:
    """The patches of a tree that could be split, as columns."""

    def __init__(self, tree: Tree) -> None:
        patches = [patch for patch in tree.patches if patch.diamond is not None]
        self.centers = np.array([patch.sphere.center for patch in patches])
        self.radii = np.array([patch.sphere.radius_m for patch in patches])
        self.errors = np.array([patch.error.max_m for patch in patches if patch.error])
        self.names = [(patch.level, diamond_of(patch.corners)) for patch in patches]

    def wanted(
        self,
        eye: np.ndarray,
        target: np.ndarray,
        flight: Flight,
        mirror_m: float | None,
        water_m: float | None = None,
    ) -> set[tuple[int, tuple[int, int]]]:
        """The diamonds, by level and place, of whose patches one is in view with too large an error."""
        pixels = 90 / (2 * math.tan(math.radians(flight.fov_deg) / 2))
        away = np.linalg.norm(self.centers - eye, axis=1) - self.radii
        seen = visible(self.centers, self.radii, eye, target, flight)
        if mirror_m is not None and eye[1] > mirror_m:
            flipped = self.centers * [1.0, -1.0, 1.0] + [0.0, 2 * mirror_m, 0.0]
            above = self.centers[:, 1] + self.radii > mirror_m
            seen |= above & visible(flipped, self.radii, eye, target, flight)
        if water_m is not None and eye[1] > water_m:  # refraction may show it anywhere below the surface
            for share in np.linspace(0.0, 1.0, 23):
                lifted = self.centers.copy()
                lifted[:, 1] += share * np.maximum(0.0, water_m - lifted[:, 1])
                seen |= visible(lifted, self.radii, eye, target, flight)
        wants = seen & (self.errors * pixels > np.maximum(flight.near_m, away))
        return {self.names[k] for k in np.flatnonzero(wants)}


@pytest.fixture(scope="module")
def everything() -> Tree:
    return grown(FIELDS["square"], 4)[1]


@pytest.mark.parametrize("low", [True, False])
@pytest.mark.parametrize(("mirror_m", "water_m"), [(None, None), (0.5, None), (None, 3.0)])
def test_what_any_moment_wants_of_the_whole_tree_is_baked(
    everything: Tree, low: bool, mirror_m: float | None, water_m: float | None
) -> None:
    flight, known = flight_settings(low), Known(everything)
    demand = plan_demand(sight_of(flight, mirror_m=mirror_m, water_m=water_m))
    _, asked = grown(FIELDS["square"], 4, demand)
    baked = {(diamond.level, diamond.key) for diamond in asked.diamonds}
    wanted = set()
    for eye, target in looks(flight, 331):
        wanted |= known.wanted(eye, target, flight, mirror_m, water_m)
    assert wanted
    assert wanted <= baked
    if not low:
        assert len(baked) < len(everything.diamonds)
        assert asked.left_out > 0 and asked.left_out_bytes > 0


def test_patches_drawn_in_view_are_within_the_accepted_error_or_the_finest() -> None:
    flight = flight_settings(False)
    grower, tree = grown(FIELDS["square"], 4, plan_demand(sight_of(flight)))
    tables, pixels = tables_of(tree), 90 / (2 * math.tan(math.radians(flight.fov_deg) / 2))
    centers = np.array([patch.sphere.center for patch in tree.patches])
    radii = np.array([patch.sphere.radius_m for patch in tree.patches])
    checked = 0
    for eye, target in looks(flight, 61):
        seen = visible(centers, radii, eye, target, flight)
        split = split_diamonds(tables, tuple(eye), pixels, flight.near_m)
        for p in drawn(tables, split):
            patch = tree.patches[p]
            if seen[p] and patch.level < grower.shape.finest and patch.error is not None:
                away = max(flight.near_m, math.dist(eye, centers[p]) - radii[p])
                assert patch.error.max_m * pixels <= away * (1 + 1e-5)
                checked += 1
    assert checked > 100


def test_ground_in_the_lights_square_counts_as_seen() -> None:
    flight = flight_settings(True)
    dark = plan_demand(sight_of(flight))
    lit = plan_demand(sight_of(flight, shadow={"extent_m": 30.0, "center": [0.0, 0.0, 0.0]}))
    inside, outside = Sphere((3.0, 0.0, 3.0), 1.0), Sphere((0.0, 400.0, 0.0), 1.0)
    assert len(lit.seeing(inside, lit.runs)) == len(lit.runs)
    assert len(dark.seeing(inside, dark.runs)) < len(dark.runs)
    assert len(lit.seeing(outside, lit.runs)) == len(dark.seeing(outside, dark.runs)) == 0


def test_ground_that_water_lifts_into_view_counts_as_seen() -> None:
    """Straight ahead over the sea: what lies below the picture's lower edge is drawn higher up."""
    eye = (EyePoint(position=(0.0, 1.0, 10.0)),) * 4
    target = (TargetPoint(position=(0.0, 1.0, -10.0)),) * 4
    eye = (*eye[:3], EyePoint(position=(0.1, 1.0, 10.0)))
    flight = replace(flight_settings(True), eye=eye, target=target)
    dry, wet = (plan_demand(sight_of(flight, water_m=level)) for level in (None, 0.0))
    for depth_m in (8.0, 40.0):
        floor = Sphere((0.0, -depth_m, 2.0), 0.5)
        assert len(dry.seeing(floor, dry.runs)) == 0
        assert len(wet.seeing(floor, wet.runs)) == len(wet.runs)
    behind = Sphere((0.0, -8.0, 20.0), 0.5)
    assert len(wet.seeing(behind, wet.runs)) == 0
    below = plan_demand(sight_of(flight, water_m=2.0))  # an eye under water sees things where they are
    assert len(below.seeing(Sphere((0.0, -8.0, 2.0), 0.5), below.runs)) == 0


def test_runs_hold_the_eye_and_the_view_at_every_moment() -> None:
    flight = flight_settings(True)
    planned, demand = plan_flight(flight), still_demand()
    demand = plan_demand(sight_of(flight))
    for k in range(1999):
        t = flight.duration_s * k / 1999
        eye, target = planned.view(t)
        run = int(np.searchsorted(demand.start_s, t, side="right")) - 1
        starts = np.flatnonzero(demand.start_s == demand.start_s[run])
        balls = [math.dist(eye, [axis[i] for axis in demand.eye]) - demand.slack_m[i] for i in starts]
        assert min(balls) <= 1e-9
        i = starts[int(np.argmin(balls))]
        ahead = np.array(target) - eye
        corner = np.array([axis[i] for axis in demand.ahead]) @ ahead / np.linalg.norm(ahead)
        assert corner >= demand.cosine[i]  # the picture's middle, far inside


def runs_at(demand: Demand, t: float) -> set[int]:
    """The runs that hold a second: those that start last before it."""
    start = demand.start_s[int(np.searchsorted(demand.start_s, t, side="right")) - 1]
    return set(np.flatnonzero(demand.start_s == start).tolist())


def test_what_one_moment_wants_or_sees_is_wanted_or_seen_by_its_run() -> None:
    """Points in the very corners of the picture, at its far plane, and at the distance that just asks."""
    flight = replace(flight_settings(True), duration_s=3.0, far_m=40.0)  # fast: metres in every run
    planned, demand = plan_flight(flight), plan_demand(sight_of(flight))
    tangent = math.tan(math.radians(flight.fov_deg) / 2)
    for k in range(400):
        t = flight.duration_s * (k + 0.37) / 400
        eye, target = (np.array(place) for place in planned.view(t))
        ahead = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(ahead, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        up = np.cross(right, ahead)
        across, along = ((-1.0, 1.0)[k >> bit & 1] for bit in (0, 1))
        corner = ahead + tangent * (across * 160 / 90 * right + along * up)
        for deep in (0.3, 5.0, 39.99):
            point = Sphere(tuple((eye + deep * corner).tolist()), 0.0)
            assert runs_at(demand, t) & set(demand.seeing(point, demand.runs).tolist())
        ball = Sphere(tuple((eye + 9.0 * corner).tolist()), 1.5)
        away = math.dist(ball.center, eye) - ball.radius_m
        asking = away / demand.pixels * (1.0 + 1e-6)
        assert runs_at(demand, t) & set(demand.wanting(asking, ball, demand.runs).tolist())
    assert demand.pixels == pytest.approx(90 / (2 * tangent))
    half = plan_demand(sight_of(flight, error_px=2.0))
    assert half.pixels == pytest.approx(demand.pixels / 2)


def test_the_light_sees_its_whole_box_and_not_much_more() -> None:
    """A square of 30 m across the light, three times as deep: also where the sun stands in the zenith."""
    for sun, side in (([0.0, 1.0, 0.0], (1.0, 0.0, 0.0)), ([0.6, 0.8, 0.0], (0.0, 0.0, 1.0))):
        sight = sight_of(flight_settings(True), shadow={"extent_m": 30.0, "center": [0, 500.0, 0]}, sun=sun)
        demand = plan_demand(sight)
        for direction, reach in ((side, 15.0), (tuple(sun), 45.0)):
            for share, seen in ((0.99, True), (1.01, False)):
                x, y, z = (share * reach * axis for axis in direction)
                found = demand.seeing(Sphere((x, 500.0 + y, z), 0.0), demand.runs)
                assert (len(found) == len(demand.runs)) is seen


def test_a_tree_is_the_same_whatever_asks_for_it_first() -> None:
    ground, flight = FIELDS["wide"], flight_settings(True)
    first, again = (grown(ground, 4, plan_demand(sight_of(flight))) for _ in range(2))
    assert tables_of(first[1]) == tables_of(again[1])
    for one, other in zip(first[1].patches, again[1].patches, strict=True):
        assert first[0].mesh(one).triangles.tobytes() == again[0].mesh(other).triangles.tobytes()


# -- geometry


@pytest.mark.parametrize(("rows", "columns", "leaf"), [(65, 65, 8), (33, 9, 4), (2, 2, 8), (50, 71, 8)])
def test_the_patches_of_a_level_tile_the_field(rows: int, columns: int, leaf: int) -> None:
    shape = Shape(rows, columns, leaf)
    level = shape.roots()
    for count in shape.count():
        assert len(level) == count
        areas = [_area(shape.clipped(corners)) for corners in level]
        assert min(areas) > 0
        assert sum(areas) == pytest.approx((rows - 1) * (columns - 1))
        level = [half for corners in level for half in shape.halves(corners)]


def _area(polygon: list[tuple[float, float]]) -> float:
    return abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in pairwise([*polygon, polygon[0]]))) / 2


def test_blocks_know_the_range_of_what_they_touch() -> None:
    heights = FIELDS["wide"].heights_m
    blocks = Blocks.of(heights, 4)
    for r0, r1, c0, c1 in ((0, 19, 0, 74), (3, 9, 17, 18), (16, 19, 70, 74), (4, 8, 4, 8)):
        low, high = blocks.range([(r0, c0), (r1, c1)])
        part = heights[r0 : r1 + 1, c0 : c1 + 1]
        assert low <= part.min() and high >= part.max()
    assert blocks.range([(4.0, 4.0), (8.0, 8.0)]) == (
        heights[4:9, 4:9].min(),
        heights[4:9, 4:9].max(),
    )


# -- codes


def test_codes_keep_the_bound_and_leave_no_crack() -> None:
    ground = FIELDS["tall"]
    grower = Grower(ground, max_error_m=0.2, leaf_px=8, sand_repeat=3.0, demand=None, quantise=True)
    tree = grower.grow()
    assert grower.lattice is not None
    finest = [p for p in tree.patches if p.level == grower.shape.finest]
    assert finest and all(p.error and p.error.max_m <= 0.2 for p in finest)
    rims = []
    for patch in tree.patches:
        codes = grower.codes(grower.mesh(patch))
        assert codes is not None and codes.lattice == grower.lattice
        assert patch.error == patch_error(decoded_mesh(grower.mesh(patch), codes), ground, patch.corners)
        rims.append(border(decoded_mesh(grower.mesh(patch), codes)))
    tables = tables_of(tree)
    for split in some_cuts(tables, 20):
        edges = sum((rims[p] for p in drawn(tables, split)), Counter())
        assert set(edges.values()) == {1, 2}
        for edge, count in edges.items():
            assert (count == 1) == on_rim(edge, ground)


def test_codes_of_all_patches_have_the_same_types() -> None:
    """The sand's coordinates of the first corner's patches lie in 0 to 1, those of others beyond: a player
    draws a tile in one call, with one layout of vertices."""
    for sand_repeat, uvs in ((3.0, np.float32), (0.5, np.uint16)):
        grower = Grower(
            FIELDS["square"], max_error_m=0.2, leaf_px=4, sand_repeat=sand_repeat, demand=None, quantise=True
        )
        codes = [grower.codes(grower.mesh(patch)) for patch in grower.grow().patches]
        types = {
            tuple(part.dtype for part in (found.uvs, found.uvs1, found.normals) if part is not None)
            for found in codes
            if found
        }
        assert len(types) == 1
        assert types.pop()[:2] == (np.dtype(uvs), np.dtype(np.uint16))

"""Levels as they are seen: a reference that tries every triangle at every sample, and cases whose answer is
known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from paradize.data import Group, Mesh
from paradize.kernels.reference.seen import SeenDifference, SeenMaterial, SeenMesh, seen_differences
from paradize.metrics.seen import (
    DIRECTIONS,
    LARGEST_PX,
    Limits,
    directions,
    largest_size,
    seen_difference,
    seen_mesh,
)
from paradize.stages.tangents import tangent_frames
from tests.pipeline.shapes import cube, grid, sphere
from tests.sweeps import sample, sweep

F64 = npt.NDArray[np.float64]
SAND = grid(1).groups[0].material


def texel(mip: npt.NDArray[np.float32], uv: F64, wrap: tuple[str, str]) -> F64:
    rows, columns = mip.shape[:2]
    x, y = uv[0] * columns - 0.5, uv[1] * rows - 0.5
    out = np.zeros(mip.shape[2:])
    for j in (0, 1):
        for i in (0, 1):
            column, row = int(np.floor(x)) + i, int(np.floor(y)) + j
            weight = (1 - abs(x - column)) * (1 - abs(y - row))
            out = out + weight * mip[within(row, rows, wrap[1]), within(column, columns, wrap[0])].astype(
                float
            )
    return np.asarray(out)


def within(at: int, count: int, wrap: str) -> int:
    if wrap == "clamp":
        return min(max(at, 0), count - 1)
    return [*range(count), *range(count)[::-1]][at % (2 * count)] if wrap == "mirror" else at % count


def mip_of(chain: list[npt.NDArray[np.float32]], gradients: F64) -> npt.NDArray[np.float32]:
    """gradients: (axis, uv), per sample."""
    rows, columns = chain[0].shape[:2]
    widest = float((np.square(gradients * [columns, rows])).sum(axis=1).max())
    level = max(0, int(np.floor(0.5 * np.log2(max(widest, 1e-30)) + 0.5)))
    return chain[min(level, len(chain) - 1)]


class Model:
    """A mesh of m triangles, its corners apart."""

    def __init__(self, random: np.random.Generator, count: int) -> None:
        self.points = random.uniform(-1, 1, (3 * count, 3)).astype(np.float32)
        self.points[3:] = self.points[:-3] * 0.4 + self.points[3:] * 0.6
        self.faces = np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)
        self.normals = self.unit(random.normal(size=(3 * count, 3)))
        self.tangents = np.hstack([self.unit(random.normal(size=(3 * count, 3))), np.ones((3 * count, 1))])
        self.tangents[::6, 3] = -1
        self.uvs = random.uniform(-0.5, 1.5, (3 * count, 2)).astype(np.float32)
        self.rows = random.integers(0, 3, count)
        up = np.array([0.0, 0.0, 3.0])
        vectors = [self.unit(random.normal(size=(n, 2 * n, 3)) + up) for n in (8, 4, 2)]
        alpha = [random.uniform(0, 1, (n, n)).astype(np.float32) for n in (6, 3)]
        self.materials = [
            SeenMaterial(vectors, wrap=("clamp", "mirror")),
            SeenMaterial(vectors, alpha, 0.4, ("repeat", "mirror"), True),
            SeenMaterial(two_sided=True),
        ]

    @staticmethod
    def unit(v: F64) -> npt.NDArray[np.float32]:
        return (v / np.sqrt((v * v).sum(axis=-1, keepdims=True))).astype(np.float32)

    def native(self) -> SeenMesh:
        columns = {"normals": self.normals, "tangents": self.tangents, "uvs": self.uvs}
        return SeenMesh(self.points, self.faces, self.materials, self.rows, **columns)

    def pixels(self, axes: F64, corner: F64, size: tuple[int, int], step: float) -> tuple[F64, F64]:
        """Mean normals (h, w, 3) and coverage (h, w), of samples `step` apart."""
        normals, covered = np.zeros((*size, 3)), np.zeros(size)
        seen = self.points.astype(np.float64) @ axes.T
        drawn = [self.drawn(seen, t) for t in range(len(self.faces))]
        for row in range(size[0]):
            for column in range(size[1]):
                found = self.sample(drawn, corner + step * (np.array([column, row]) + 0.5), step)
                if found is not None:
                    normals[row, column], covered[row, column] = found, 1
        return normals, covered

    def drawn(self, seen: F64, t: int) -> tuple[int, bool, F64, F64]:
        """A triangle, whether its front is seen, its corners, and what turns a place into their weights."""
        a, b, c = seen[self.faces[t]]
        by = np.array([b[:2] - a[:2], c[:2] - a[:2]]).T
        return t, bool(np.linalg.det(by) > 0), seen[self.faces[t]], np.linalg.inv(by)

    def sample(self, drawn: list[tuple[int, bool, F64, F64]], place: F64, step: float) -> F64 | None:
        best, found = -np.inf, None
        for t, front, corners, back in drawn:
            face, material = self.faces[t], self.materials[self.rows[t]]
            if not front and not material.two_sided:
                continue
            s = back @ (place - corners[0, :2])
            weights = np.array([1 - s[0] - s[1], *s])
            z = weights @ corners[:, 2]
            if weights.min() < 0 or z <= best:
                continue
            gradients = step * back.T @ (self.uvs[face[1:]].astype(np.float64) - self.uvs[face[0]])
            uv = weights @ self.uvs[face].astype(np.float64)
            if material.alpha:
                chain = list(material.alpha)
                if texel(mip_of(chain, gradients), uv, material.wrap) < material.cutoff:
                    continue
            n = weights @ self.normals[face].astype(np.float64)
            n /= np.linalg.norm(n)
            if material.normals:
                tangent = weights @ self.tangents[face].astype(np.float64)
                t3 = tangent[:3] / np.linalg.norm(tangent[:3])
                m = texel(mip_of(list(material.normals), gradients), uv, material.wrap)
                m /= np.linalg.norm(m)
                n = m[0] * t3 + m[1] * np.cross(n, t3) * (-1 if tangent[3] < 0 else 1) + m[2] * n
                n /= np.linalg.norm(n)
            best, found = z, n if front else -n
        return found


def brute(a: Model, b: Model, toward: F64, pixel: float, samples: int) -> tuple[F64, F64, float, float]:
    """Angles and weights of all pixels; pixels covered by a, and changed."""
    toward = toward / np.linalg.norm(toward)
    right = np.cross([0, 1, 0] if abs(toward[1]) < 0.9 else [0, 0, 1], toward)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(toward, right), toward])
    corners = np.concatenate([a.points, b.points]).astype(np.float64) @ axes[:2].T
    low = corners.min(axis=0) - pixel * np.array([0.5717, 0.5393])
    wide, high = (int(n) for n in np.ceil((corners.max(axis=0) - low) / pixel))
    step = pixel / samples
    shown = []
    for model in (a, b):
        normals, covered = model.pixels(axes, low, (high * samples, wide * samples), step)
        normals = normals.reshape(high, samples, wide, samples, 3).sum(axis=(1, 3))
        shown.append((normals, covered.reshape(high, samples, wide, samples).sum(axis=(1, 3))))
    (n0, c0), (n1, c1) = shown
    both = (c0 > 0) & (c1 > 0)
    chord = np.linalg.norm(n0[both] / c0[both][:, None] - n1[both] / c1[both][:, None], axis=1)
    weights = np.minimum(c0, c1)[both] / samples**2
    angles = np.degrees(2 * np.arcsin(np.minimum(1, chord / 2)))
    return angles, weights, float(c0.sum()) / samples**2, float(np.abs(c0 - c1).sum()) / samples**2


def quantile(angles: F64, weights: F64) -> float:
    order = np.argsort(angles)
    return float(angles[order][np.searchsorted(np.cumsum(weights[order]), 0.99 * weights.sum())])


@pytest.mark.parametrize("seed", sample(range(4), every=4))
def test_it_is_what_trying_every_triangle_at_every_sample_finds(seed: int) -> None:
    random = np.random.default_rng(seed)
    a, b = Model(random, 7), Model(random, 9)
    towards = np.array([[0.3, 0.5, -0.8], [0.1, -2.0, 0.2]])
    each, both = seen_differences(a.native(), b.native(), towards, 0.21, samples=3, most_tiles=10)
    found = [brute(a, b, toward, 0.21, 3) for toward in towards]
    for result, (angles, weights, covered, changed) in zip(each, found, strict=True):
        assert result.covered_px == pytest.approx(covered) and result.changed_px == pytest.approx(changed)
        assert result.mean_deg == pytest.approx((angles * weights).sum() / weights.sum(), abs=1e-6)
        assert result.p99_deg == pytest.approx(quantile(angles, weights), abs=1e-6)
        assert result.max_deg == pytest.approx(angles.max(), abs=1e-6)
    angles, weights = (np.concatenate([one[k] for one in found]) for k in (0, 1))
    assert both.p99_deg == pytest.approx(quantile(angles, weights), abs=1e-6)
    assert both.covered_px == pytest.approx(sum(one[2] for one in found))


def test_any_number_of_threads_gives_the_same_bits() -> None:
    random = np.random.default_rng(5)
    a, b = Model(random, 300).native(), Model(random, 300).native()
    one, many = (
        seen_differences(a, b, directions()[::4], 0.01, samples=2, most_tiles=20, threads=threads)
        for threads in (1, 7)
    )
    assert one == many


def test_a_mesh_differs_by_nothing_from_itself() -> None:
    ball = seen_mesh(sphere(12), {})
    seen = seen_difference(ball, ball, 100.0)
    assert (seen.p99_deg, seen.max_deg, seen.silhouette) == (0, 0, 0)


@pytest.mark.parametrize("degrees", sample([0.5, 10.0, 90.0, 179.0], every=2))
def test_normals_turned_by_an_angle_are_seen_to_turn_by_it(degrees: float) -> None:
    ground = grid(4)
    turned = np.zeros_like(ground.normals)
    turned[:, 0], turned[:, 1] = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    seen = seen_difference(seen_mesh(ground, {}), seen_mesh(replace(ground, normals=turned), {}), 64.0)
    assert (seen.mean_deg, seen.p99_deg, seen.max_deg) == pytest.approx((degrees,) * 3, abs=1e-3)
    assert seen.silhouette == 0


def test_bumps_narrower_than_a_pixel_are_the_mean_that_light_sees_of_them() -> None:
    """A map whose texels lean by 50 degrees to and fro, level 0 only, against a flat one."""
    ground = tangent_frames(grid(4))
    lean = np.radians(50.0) * np.where(np.arange(64) % 2, 1, -1)
    row = np.stack([np.sin(lean), np.zeros(64), np.cos(lean)], -1)
    bumps = np.broadcast_to(row, (64, 64, 3)).astype(np.float32)
    mesh = seen_mesh(ground, {SAND: SeenMaterial([bumps])}), seen_mesh(ground, {})
    near, far = (seen_difference(*mesh, size).mean_deg for size in (800.0, 20.0))
    between = np.sin(np.radians(50.0)) * np.linspace(-1, 1, 1001)  # of two texels, as they are filtered
    upright = np.cos(np.radians(50.0)) / np.hypot(np.cos(np.radians(50.0)), between)
    assert near == pytest.approx(np.degrees(np.arccos(upright)).mean(), abs=2)
    assert far == pytest.approx(np.degrees(2 * np.arcsin((1 - upright.mean()) / 2)), abs=1)


def test_what_only_one_covers_is_the_change_of_the_silhouette() -> None:
    ground = grid(4)
    half = replace(ground, triangles=ground.triangles[: len(ground.triangles) // 2])
    result = difference(seen_mesh(ground, {}), seen_mesh(half, {}))
    assert (result.changed_px, result.box_px) == (pytest.approx(200, abs=12), pytest.approx(400))
    seen = seen_difference(seen_mesh(ground, {}), seen_mesh(half, {}), 200.0)
    assert 0.1 < seen.silhouette < 0.5 and seen.max_deg == 0


def difference(a: SeenMesh, b: SeenMesh) -> SeenDifference:
    """Seen from above."""
    return seen_differences(a, b, [[0, 1, 0]], 0.05, samples=4, most_tiles=100)[1]


def test_a_back_face_is_drawn_where_it_is_two_sided_with_its_normal_turned_round() -> None:
    ground = grid(2)
    under = replace(ground, triangles=ground.triangles[:, ::-1], normals=-ground.normals)
    top = seen_mesh(ground, {})
    assert difference(top, seen_mesh(under, {})).changed_px == pytest.approx(400, abs=5)
    both = difference(top, seen_mesh(under, {SAND: SeenMaterial(two_sided=True)}))
    assert both.changed_px == 0 and both.max_deg == pytest.approx(0, abs=1e-6)


def test_less_alpha_than_the_cutoff_is_a_hole_that_shows_what_is_behind() -> None:
    ground = grid(2)
    alpha = np.zeros((2, 2), np.float32)
    alpha[:, 1] = 1
    masked = SeenMaterial(
        alpha=[np.repeat(np.repeat(alpha, 32, 0), 32, 1)], cutoff=0.5, wrap=("clamp", "clamp")
    )
    result = difference(seen_mesh(ground, {}), seen_mesh(ground, {SAND: masked}))
    assert result.changed_px == pytest.approx(200, abs=8)
    lower = replace(ground, positions=ground.positions - np.float32([0, 0.5, 0]))
    faces = np.concatenate([ground.triangles, lower.triangles + len(ground.positions)])
    stack = Mesh(
        np.concatenate([ground.positions, lower.positions]),
        faces.astype(np.uint32),
        normals=np.concatenate([ground.normals, lower.normals]),
        uvs=np.concatenate([ground.uvs, lower.uvs]),
        groups=(
            Group("a", "holes", 0, len(ground.triangles)),
            Group("b", "", len(ground.triangles), len(ground.triangles)),
        ),
    )
    assert difference(seen_mesh(ground, {}), seen_mesh(stack, {"holes": masked})).changed_px == 0


def test_of_a_large_picture_some_tiles_stand_for_all() -> None:
    rough, fine = sphere(10), sphere(40)
    a, b = seen_mesh(fine, {}), seen_mesh(rough, {})
    all_of_it, some = (
        seen_differences(a, b, directions()[::4], 0.004, samples=2, most_tiles=most)[1]
        for most in (65536, 20)
    )
    assert some.covered_px < 0.2 * all_of_it.covered_px
    assert some.p99_deg == pytest.approx(all_of_it.p99_deg, rel=0.1)
    shares = [one.changed_px / one.box_px for one in (some, all_of_it)]
    assert shares[0] == pytest.approx(shares[1], rel=0.2)


def test_a_level_takes_over_where_it_looks_the_same() -> None:
    fine, limits = seen_mesh(sphere(32), {}), Limits(normal_deg=4.0, silhouette=0.01)
    near = largest_size(fine, seen_mesh(sphere(20), {}), limits, 100.0)
    far = largest_size(fine, seen_mesh(sphere(8), {}), limits, 100.0)
    assert near is not None and near.inside(limits) and near.size_px <= 100
    assert far is None or far.size_px < near.size_px
    assert largest_size(fine, seen_mesh(cube(), {}), limits, 100.0) is None
    ground = seen_mesh(grid(2), {})
    same = largest_size(ground, ground, limits, 1e9)
    assert same is not None and same.size_px == LARGEST_PX


@pytest.mark.parametrize("rings", sweep([8, 16], test=[8]))
@pytest.mark.parametrize("pixel", sample([0.02, 0.1, 0.4], every=2))
def test_pictures_are_left_out_only_where_no_other_could_bring_them_inside(rings: int, pixel: float) -> None:
    fine, level = seen_mesh(sphere(24), {}), seen_mesh(sphere(rings), {})

    def found(**limits: float) -> tuple[list[SeenDifference], SeenDifference] | None:
        return seen_differences(fine, level, directions()[::3], pixel, samples=2, most_tiles=20, **limits)

    every = found()
    assert every is not None
    _, both = every
    for share in (0.0, 0.5, 0.9999, 1.0, 1.0001, 2.0):
        result = every if share >= 1.0 else None
        assert found(p99_deg=share * both.p99_deg) == result, share
        assert found(changed=share * both.changed_px / both.box_px * (1 + 1e-8)) == result, share


def test_directions_are_unit_and_all_around() -> None:
    found = directions()
    assert found.shape == (DIRECTIONS, 3)
    assert np.linalg.norm(found, axis=1) == pytest.approx(1, abs=1e-12)
    assert np.abs(found.mean(axis=0)).max() < 0.05
    nearest = np.sort(found @ found.T, axis=1)[:, -2]
    assert np.degrees(np.arccos(nearest)).min() > 35


@pytest.mark.parametrize("broken", ["points", "rows", "mips", "pixel", "direction", "samples"])
def test_arrays_that_do_not_fit_are_refused(broken: str) -> None:
    def call(**changes: object) -> None:
        known = {"positions": np.eye(3), "triangles": [[0, 1, 2]], "directions": [[0, 0, 1]]}
        known |= {"pixel": 0.1, "samples": 2, "materials": [SeenMaterial()], "rows": None} | changes
        mesh = SeenMesh(known["positions"], known["triangles"], known["materials"], known["rows"])
        numbers = {"samples": known["samples"], "most_tiles": 4}
        seen_differences(mesh, mesh, known["directions"], known["pixel"], **numbers)

    call()
    faults: dict[str, dict[str, object]] = {
        "points": {"positions": np.full((3, 3), np.nan)},
        "rows": {"rows": [1]},
        "mips": {"materials": [SeenMaterial(normals=[np.zeros((2, 2), np.float32)])]},
        "pixel": {"pixel": 1e-9},
        "direction": {"directions": [[0, 0, 0]]},
        "samples": {"samples": 17},
    }
    with pytest.raises(ValueError):
        call(**faults[broken])

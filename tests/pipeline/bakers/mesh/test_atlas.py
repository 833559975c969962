"""The atlas: inside the square, nothing over anything else, and an error instead of a hang."""

from __future__ import annotations

import json
import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.mesh.atlas import overlaps, with_atlas
from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Mesh
from paradize.errors import BakeError, SourceError
from paradize.formats.glb.reader import decode_glb
from paradize.jobs.isolate import call_isolated
from paradize.kernels.atlas import make_charts, pack
from paradize.kernels.reference.atlas import layout_quality, layout_raster
from paradize.metrics.atlas import atlas_quality
from paradize.readers.obj import read_obj
from paradize.stages.atlas import make_atlas, seam_length
from paradize.tiers import TIERS
from tests.pipeline.shapes import cube, grid, soup, sphere
from tests.processor_time import ratio
from tests.sweeps import sample, sweep


def bare(mesh: Mesh) -> Mesh:
    return replace(mesh, uvs=None)


def require_sound(quality: dict[str, object]) -> None:
    assert {key: quality[key] for key in ("overlap", "near", "flipped", "without")} == {
        "overlap": 0.0,
        "near": 0,
        "flipped": 0,
        "without": 0,
    }


def cards(count: int) -> Mesh:
    """Squares that touch nothing, in every direction."""
    rng = np.random.default_rng(5)
    middle, a, b = (rng.normal(size=(count, 3)) for _ in range(3))
    points = np.stack([middle * 9, middle * 9 + a, middle * 9 + a + b, middle * 9 + b], axis=1)
    faces = 4 * np.arange(count)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    return Mesh(points.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3).astype(np.uint32))


@pytest.mark.parametrize("seed", range(3))
def test_a_plane_is_one_chart_whose_triangles_keep_their_shape(seed: int) -> None:
    """Triangles of all shapes, in a plane that is turned."""
    rng = np.random.default_rng(seed)
    mesh = grid(5)
    flat = mesh.positions[:, [0, 2, 1]] * [1.0, 2.5, 0.0] + rng.uniform(-0.08, 0.08, (36, 3)) * [1, 2, 0]
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    _, corners, count = make_charts(flat @ turn, mesh.triangles, deviation=0.1)
    assert count == 1
    lengths = [np.linalg.norm(np.roll(p, 1, axis=1) - p, axis=2) for p in (corners, flat[mesh.triangles])]
    assert np.abs(lengths[0] - lengths[1]).max() < 1e-4


def moebius(turns: int = 40) -> Mesh:
    at = np.arange(turns) * (2 * np.pi / turns)
    wide = np.array([-0.3, 0.3])[None, :]
    r = 1 + wide * np.cos(at / 2)[:, None]
    points = np.stack([r * np.cos(at)[:, None], wide * np.sin(at / 2)[:, None], r * np.sin(at)[:, None]], -1)
    faces = []
    for k in range(turns):
        a, b = 2 * k, 2 * k + 1
        c, d = (2 * k + 2, 2 * k + 3) if k + 1 < turns else (1, 0)  # closed the wrong way round
        faces += [(a, b, d), (a, d, c)]
    return soup([tuple(p) for p in points.reshape(-1, 3).tolist()], faces)


@pytest.mark.parametrize("scale", sample([1e-30, 1e-6, 1.0, 1e9, 1e30], every=2))
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_any_size_and_place_gets_a_sound_atlas(scale: float, offset: float) -> None:
    mesh = bare(sphere(6))
    moved = replace(mesh, positions=((mesh.positions + np.float32(offset)) * np.float32(scale)))
    done = make_atlas(moved)
    assert np.array_equal(done.positions[done.triangles], moved.positions[moved.triangles])
    quality = atlas_quality(done)
    require_sound(quality)
    assert quality["stretch"] < 1.05 and quality["packing"] > 0.4
    low, middle, high = quality["texels_per_m"]
    assert 0 < low <= middle <= high < 1.6 * low


@pytest.mark.parametrize("mesh", [cube(), moebius(), cards(300), bare(grid(12, height=0.3)), cards(2)])
@pytest.mark.parametrize("tier", sweep(sorted(TIERS), test=["exact"]))
def test_closed_open_one_sided_and_scattered_meshes_get_sound_atlases(mesh: Mesh, tier: str) -> None:
    quality = atlas_quality(make_atlas(mesh, tier=tier))
    require_sound(quality)
    assert quality["stretch"] < 1.05
    assert quality["packing"] > 0.25


def bumpy(side: int, height: float, seed: int) -> Mesh:
    """A sheet of `side` x `side` quads, one wide; each corner as high as chance has it."""
    flat = bare(grid(side))
    up = np.random.default_rng(seed).uniform(0, height, len(flat.positions))
    sheet = (flat.positions - flat.positions.min(axis=0)) / np.float32(np.ptp(flat.positions))
    points = np.stack([sheet[:, 0], sheet[:, 2 if np.ptp(sheet[:, 2]) > 0 else 1], up], axis=1)
    return Mesh(points.astype(np.float32), flat.triangles)


def rough(rings: int, share: float, seed: int) -> Mesh:
    ball = bare(sphere(rings))
    _, place = np.unique(ball.positions, axis=0, return_inverse=True)
    size = np.random.default_rng(seed).uniform(1, 1 + share, place.max() + 1)[place.reshape(-1)]
    return replace(ball, positions=(ball.positions * size[:, None]).astype(np.float32))


@pytest.mark.parametrize("seed", sweep(range(3), test=[0]))
@pytest.mark.parametrize("rough_by", sample([0.005, 0.02, 0.05, 0.3], every=4))
def test_rough_sheets_and_balls_of_any_kind_get_sound_atlases(rough_by: float, seed: int) -> None:
    """Their charts are pinched at corners, where two parts of one came to lie over each other."""
    for mesh in (bumpy(60, rough_by, seed), rough(24, 4 * rough_by, seed)):
        made = make_atlas(mesh)
        require_sound(atlas_quality(made, resolution=2048, padding=8))
        assert np.array_equal(made.positions[made.triangles], mesh.positions[mesh.triangles])


@pytest.mark.deep
@pytest.mark.parametrize(("side", "height"), [(100, 0.02), (100, 0.1), (224, 0.01), (224, 0.05)])
def test_large_rough_sheets_get_sound_atlases(side: int, height: float) -> None:
    require_sound(atlas_quality(make_atlas(bumpy(side, height, 1))))


def test_thousands_of_triangles_that_touch_nothing_are_packed() -> None:
    points = np.random.default_rng(2).normal(size=(15_000, 3)).astype(np.float32)
    quality = atlas_quality(make_atlas(Mesh(points, np.arange(15_000, dtype=np.uint32).reshape(-1, 3))))
    require_sound(quality)
    assert quality["charts"] == 5_000
    assert quality["packing"] > 0.03  # the gutter takes most


def test_a_grid_stays_one_chart_and_a_cube_is_cut() -> None:
    assert atlas_quality(make_atlas(bare(grid(10))))["charts"] == 1
    assert 2 <= atlas_quality(make_atlas(cube()))["charts"] <= 6


def test_slivers_and_triangles_without_an_area_keep_the_rest_sound() -> None:
    mesh = cube()
    points = np.concatenate([mesh.positions, [[0.5, 0, 0], [0.5, 1e-6, 0]]]).astype(np.float32)
    faces = np.concatenate([mesh.triangles, [[0, 8, 4], [0, 4, 9]]]).astype(np.uint32)
    quality = atlas_quality(make_atlas(Mesh(points, faces)))
    assert (quality["overlap"], quality["flipped"], quality["near"]) == (0.0, 0, 0)


@pytest.mark.parametrize(
    ("resolution", "padding"), sample([(64, 0), (64, 4), (512, 2), (2048, 8), (8192, 64)], every=2)
)
def test_the_gutter_is_kept_at_every_resolution(resolution: int, padding: int) -> None:
    done = make_atlas(bare(sphere(10)), resolution=resolution, padding=padding, tier="fast")
    quality = atlas_quality(
        done, resolution=min(resolution, 2048), padding=padding * min(resolution, 2048) // resolution
    )
    require_sound(quality)
    assert quality["charts"] > 3


def test_what_does_not_fit_is_an_error_not_an_overlap() -> None:
    with pytest.raises(BakeError, match=r"2000 charts .* 64 texels.* hold 144 at most; weld"):
        make_atlas(cards(2000), resolution=64, padding=4)


def test_the_exact_tier_has_no_longer_seams_than_any_of_its_ways() -> None:
    for mesh in (bare(sphere(14)), moebius(), cube(), bare(grid(12, height=0.9))):
        seams = {tier: atlas_quality(make_atlas(mesh, tier=tier))["seam_length"] for tier in TIERS}
        assert seams["exact"] <= seams["balanced"] + 1e-6
    assert atlas_quality(make_atlas(bare(sphere(14)), tier="fast"))["charts"] > 2


def test_seams_are_counted_once_each() -> None:
    points, faces = (
        np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], float),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    assert seam_length(points, faces.astype(np.uint32), np.array([0, 0], np.int32)) == 0
    assert seam_length(points, faces.astype(np.uint32), np.array([0, 1], np.int32)) == pytest.approx(8**0.5)


def test_more_charts_than_the_square_has_room_for_are_refused_at_once() -> None:
    corners = np.tile(np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]), (40_000, 1, 1))

    def packed(count: int) -> object:
        return pack(corners[:count], np.arange(count), count, resolution=1024, padding=4)

    assert packed(4_000) is not None and packed(40_000) is None
    # 0.2; to try whether they fit takes 25 times as long as to pack a tenth of them.
    assert ratio(lambda: packed(40_000), lambda: packed(4_000)) < 2


@pytest.mark.parametrize("resolution", sample([100, 512, 1000, 4096], every=2))
def test_charts_of_every_width_are_packed_apart(resolution: int) -> None:
    """Rectangles a few texels to the whole square wide, with gutters up to the widest."""
    rng = np.random.default_rng(resolution)
    for padding in (0, 1, 7, 64):
        count = 40 if resolution > 100 or padding < 8 else 1
        sides = 10.0 ** rng.uniform(-2, 0, (count, 2))
        across = sides[:, None, :]
        corners = np.concatenate(
            [across * [[0, 0], [1, 0], [1, 1]], across * [[0, 0], [1, 1], [0, 1]]], axis=1
        ).reshape(-1, 3, 2)
        packed = pack(corners, np.repeat(np.arange(count), 2), count, resolution=resolution, padding=padding)
        assert packed is not None
        boxes = packed[0].reshape(count, 6, 2)
        low, high = boxes.min(axis=1), boxes.max(axis=1)
        assert low.min() >= padding // 2 and high.max() <= resolution - padding // 2
        gap = np.maximum(low[:, None] - high[None], low[None] - high[:, None]).max(axis=2)
        np.fill_diagonal(gap, np.inf)
        assert gap.min() >= padding - 1e-9


def test_the_bytes_do_not_depend_on_threads_and_hardly_on_the_order_of_faces() -> None:
    mesh = sphere(14)
    points = mesh.positions.astype(np.float64)
    ones = [make_charts(points, mesh.triangles, deviation=0.3, threads=n) for n in (1, 5)]
    assert ones[0][2] == ones[1][2]
    assert all(np.array_equal(a, b) for a, b in zip(ones[0][:2], ones[1][:2], strict=True))
    turned = replace(bare(mesh), triangles=np.ascontiguousarray(mesh.triangles[::-1]))
    a, b = atlas_quality(make_atlas(bare(mesh))), atlas_quality(make_atlas(turned))
    assert a["stretch"] == pytest.approx(b["stretch"], abs=0.01)
    assert a["seam_length"] == pytest.approx(b["seam_length"], rel=0.35)


def test_kernels_refuse_what_is_no_surface() -> None:
    points, faces = np.eye(3), np.array([[0, 1, 2]])
    with pytest.raises(ValueError, match="finite"):
        make_charts(points * np.nan, faces, deviation=0.3)
    with pytest.raises(ValueError, match="index 3 of 3 vertices"):
        make_charts(points, faces + 1, deviation=0.3)
    with pytest.raises(ValueError, match="deviation"):
        make_charts(points, faces, deviation=1.0)
    with pytest.raises(ValueError, match="charts are not"):
        pack(np.zeros((1, 3, 2)), [1], 1, resolution=64, padding=0)


def square(low: float, high: float) -> np.ndarray:
    return np.array([[[low, low], [high, low], [high, high]], [[low, low], [high, high], [low, high]]])


def test_the_quality_is_that_counted_by_hand() -> None:
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], np.float64)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    quality = layout_quality(points, faces, square(0.25, 0.75))
    assert (quality["stretch"], quality["packing"], quality["seam_length"]) == (1.0, 0.25, 0.0)
    assert (quality["charts"], quality["flipped"], quality["without"]) == (1, 0, 0)
    assert quality["density"].tolist() == [0.25, 0.25]  # of the image's side, per metre
    apart = square(0.0, 0.25)
    apart[1] += 0.5
    assert layout_quality(points, faces, apart)["seam_length"] == pytest.approx(8**0.5 / 2)
    assert layout_quality(points, faces, apart)["charts"] == 2
    beside = square(0.25, 0.75)
    beside[1] += [1 / 256, 0]  # a texel of a small image
    assert layout_quality(points, faces, beside)["charts"] == 2
    flat = square(0.0, 0.5) * [1, 0.5]
    # A unit of the image is 4 metres one way and 8 the other; the image's area an eighth of a square's.
    assert layout_quality(points, faces, flat)["stretch"] == pytest.approx(((4**2 + 8**2) / 2 / 4 / 8) ** 0.5)
    mirrored = square(0.0, 0.5)
    mirrored[1] = mirrored[1][::-1] / 2
    assert layout_quality(points, faces, mirrored)["flipped"] == 1


def test_triangles_that_float32_cannot_tell_apart_are_not_held_against_a_layout() -> None:
    """One is turned over by a rounding in the image, and by more than one."""
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 0, 0]], np.float64)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 4, 1]], np.uint32)
    for below, flipped in ((-1e-8, 0), (1e-8, 0), (1e-5, 1)):
        sliver = [[0.25, 0.25], [0.5, 0.25 + below], [0.75, 0.25]]
        quality = layout_quality(points, faces, np.concatenate([square(0.25, 0.75), [sliver]]))
        assert (quality["flipped"], quality["without"]) == (flipped, 0)
        assert quality["stretch"] == pytest.approx(1, abs=1e-4)
    points[4, 1] = -0.5
    quality = layout_quality(points, faces, np.concatenate([square(0.25, 0.75), [[[0.25, 0.25]] * 3]]))
    assert quality["without"] == 1


@pytest.mark.deep
def test_every_model_of_the_kits_gets_a_sound_atlas(sources: Path) -> None:
    paths = sorted((sources / "obj-kits").rglob("*.obj"))
    assert len(paths) > 5
    for path in paths:
        quality = atlas_quality(make_atlas(bare(read_obj(path).mesh)))
        assert [quality[key] for key in ("overlap", "near", "flipped", "without")] == [0, 0, 0, 0], path


def test_overlap_and_a_gutter_too_small_are_seen() -> None:
    points = np.concatenate([np.eye(3), np.eye(3) + 5, np.eye(3) + 9])[:6]
    faces = np.array([[0, 1, 2], [3, 4, 5]], np.uint32)
    one = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]])
    beside = np.array([[0.5 + 4 / 64, 0.0], [1.0, 0.0], [0.5 + 4 / 64, 0.4]])
    covered, twice, _ = layout_raster(points, faces, np.stack([one, one]), resolution=64, gap=0)
    assert twice == covered > 0
    near = [
        layout_raster(points, faces, np.stack([one, beside]), resolution=64, gap=gap)[2]
        for gap in (0, 3, 4, 6)
    ]
    assert near[0] == near[1] == 0 < near[3]
    reaching = np.array([[0.0, 0.0], [32.4 / 64, 0.0], [0.0, 0.5]])
    shared = np.stack([reaching, beside - [3.4 / 64, 0]])  # both touch texel 32 of row 0
    assert layout_raster(points, faces, shared, resolution=64, gap=0)[1:] == (0, 1)


def test_the_stage_counts_its_seams_along_every_axis() -> None:
    box = cube()
    points, faces = box.positions.astype(np.float64), box.triangles
    assert seam_length(points * [1, 2, 4], faces, np.arange(12, dtype=np.int32) // 2) == 4 * (1 + 2 + 4)
    assert seam_length(points, faces, np.zeros(12, np.int32)) == 0.0


def squares_of(places: list[tuple[float, float]], apart: tuple[float, float, float]) -> Mesh:
    """Squares of a metre, each `apart` from the one before, on squares of 16 texels of 64 at these texels."""
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)
    count = len(places)
    flat = np.concatenate([corners, np.zeros((4, 1))], axis=1)
    return Mesh(
        np.concatenate([flat + k * np.array(apart) for k in range(count)]).astype(np.float32),
        np.concatenate(
            [[[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]] for k in range(count)]
        ).astype(np.uint32),
        uvs=np.concatenate([corners / 4 + np.array(place) / 64 for place in places]).astype(np.float32),
    )


@pytest.mark.parametrize("axis", [0, 1])
def test_texels_with_another_chart_nearer_than_the_padding_are_counted_on_both_sides(axis: int) -> None:
    for between, near in ((3, 0), (2, 32), (1, 64)):  # rows of 16 texels of either chart
        places = [(4.0, 4.0), (4.0 + (axis == 0) * (16 + between), 4.0 + (axis == 1) * (16 + between))]
        assert atlas_quality(squares_of(places, (0, 0, 9)), resolution=64, padding=4)["near"] == near


def test_overlap_is_a_share_of_what_is_covered() -> None:
    quality = atlas_quality(squares_of([(4, 4), (12, 4)], (0, 0, 9)), resolution=64)
    assert quality["overlap"] == pytest.approx(
        1 / 3, rel=0.1
    )  # texels whose middle lies on a diagonal are none's


@pytest.mark.parametrize("apart", [(0, 0, 2), (0, 2, 0), (2, 0, 0), (1, 1, 2)])
def test_squares_that_lie_apart_along_any_axis_share_no_seam(apart: tuple[float, float, float]) -> None:
    quality = atlas_quality(squares_of([(0, 0), (32, 32)], apart), resolution=64)
    assert (quality["charts"], quality["seam_length"], quality["stretch"]) == (2, 0.0, 1.0)
    assert quality["texels_per_m"] == [16.0] * 3


def test_a_bake_with_an_atlas_has_tangent_frames(tmp_path: Path) -> None:
    path = tmp_path / "cube.obj"
    rows = [f"v {x} {y} {z}" for x, y, z in cube().positions.tolist()]
    path.write_text("\n".join(rows + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in cube().triangles.tolist()]))
    plain = bake_mesh(path, lods=1)
    assert decode_glb(plain.glb)[0].mesh.tangents is None
    assert any("--atlas" in warning for warning in plain.report["warnings"])
    mesh = decode_glb(bake_mesh(path, lods=1, atlas=True).glb)[0].mesh
    assert mesh.tangents is not None and mesh.uvs is not None
    require_sound(atlas_quality(mesh))


def test_a_layout_over_itself_is_replaced_and_a_sound_or_repeating_one_is_kept(tmp_path: Path) -> None:
    mesh = sphere(8)
    assert mesh.uvs is not None
    assert not overlaps(mesh)
    assert not overlaps(replace(mesh, uvs=mesh.uvs * np.float32(3)))
    folded = replace(mesh, uvs=np.abs(mesh.uvs - np.float32(0.5)))
    assert overlaps(folded)
    made, result, warnings = with_atlas(folded, tmp_path / "a.obj", "balanced")
    assert result is not None and "over one another" in warnings[0]
    require_sound(atlas_quality(made))
    assert with_atlas(mesh, tmp_path / "a.obj", "balanced") == (mesh, None, [])


def test_an_atlas_that_is_not_sound_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "paradize.bakers.mesh.atlas.call_isolated",
        lambda *a, **k: replace(sphere(8), uvs=np.zeros_like(sphere(8).uvs)),
    )
    with pytest.raises(BakeError, match="not sound"):
        with_atlas(bare(sphere(8)), tmp_path / "a.obj", "balanced")


def test_the_report_tells_the_layout_s_quality(tmp_path: Path) -> None:
    path = tmp_path / "cube.obj"
    rows = [f"v {x} {y} {z}" for x, y, z in cube().positions.tolist()]
    path.write_text("\n".join(rows + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in cube().triangles.tolist()]))
    report = json.loads(json.dumps(bake_mesh(path, lods=1, atlas=True).report["layout"]))
    assert report["texels_per_m"][0] > 100 and report["stretch"] == 1.0


@pytest.mark.parametrize("setting", [{"resolution": 32}, {"padding": 1000}])
def test_settings_beyond_their_range_are_refused(setting: dict[str, int]) -> None:
    with pytest.raises(BakeError, match="expected 64 to 8192"):
        make_atlas(sphere(3), **setting)


def hang() -> None:
    time.sleep(60)


def crash() -> None:
    os.abort()


def fill() -> int:
    return len(np.zeros(1 << 34, np.uint8))


def refuse() -> None:
    raise SourceError("is not a mesh", file="a.obj")


@pytest.mark.deep
def test_a_hang_a_crash_and_a_memory_hog_become_errors_that_name_the_input() -> None:
    with pytest.raises(BakeError, match=r"a\.obj took longer than 0.5 s"):
        call_isolated("the atlas of a.obj", hang, {}, timeout_s=0.5)
    with pytest.raises(BakeError, match=r"a\.obj.*SIGABRT"):
        call_isolated("the atlas of a.obj", crash, {}, timeout_s=30)
    with pytest.raises(SourceError, match="memory"):
        call_isolated("the atlas of a.obj", fill, {}, timeout_s=30, memory_bytes=4 << 30)
    with pytest.raises(SourceError, match=r"a\.obj: is not a mesh"):
        call_isolated("the atlas of a.obj", refuse, {}, timeout_s=30)

"""Vertices as codes: closed where they were closed, as near as the file says, and no other file than the
standard allows."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.quantise import direction_deg_of, quantised_levels, quantised_terrain
from paradize.bakers.terrain.mesh import bake_terrain
from paradize.build.bake import bake
from paradize.build.manifest import mesh_facts
from paradize.build.options import BuildOptions
from paradize.checks import check_paths
from paradize.checks.meshes import check_mesh
from paradize.data import Heightfield, Lod, Mesh, QuantisationGrid
from paradize.errors import BakeError, FormatError
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.reader import decode_glb
from paradize.formats.glb.tiles import TilePatch, decode_tile, encode_tiles
from paradize.metrics.quantised import quantised_errors
from paradize.scene.baker_settings import TerrainSettings
from paradize.stages.quantise import (
    direction_bits,
    mesh_grid,
    quantise,
    quantise_levels,
    terrain_grid,
)
from paradize.stages.tangents import tangent_frames
from paradize.stages.terrain import pixels_mesh
from tests.pipeline.glb_json import document, with_document
from tests.pipeline.scenes import make_cove
from tests.pipeline.shapes import cube, sphere
from tests.sweeps import sweep


def ball(rings: int = 24, **place: Any) -> Mesh:
    return tangent_frames(sphere(rings, **place), "mikktspace")


def coded(*meshes: Mesh, direction_deg: float = 0.1) -> tuple[tuple[Lod, ...], bytes]:
    lods = quantised_levels([Lod(mesh, 0.0, 0.0) for mesh in meshes], direction_deg=direction_deg)
    return lods, encode_glb(lods, "coded")


def test_codes_come_back_as_they_went_in() -> None:
    lods, data = coded(ball(24), ball(12))
    back = decode_glb(data)
    for ours, found in zip(lods, back, strict=True):
        assert ours.quantised is not None
        assert found.quantised is not None
        assert found.quantised.grid == ours.quantised.grid
        for name in ("positions", "normals", "tangents", "uvs"):
            assert np.array_equal(getattr(found.quantised, name), getattr(ours.quantised, name)), name
        assert found.errors == ours.errors
    assert encode_glb(back, "coded") == data


def test_floats_stay_as_they_were_where_nothing_asks_for_codes() -> None:
    mesh = ball()
    (lod,) = decode_glb(encode_glb([Lod(mesh, 0.0, 0.0)], "ball"))
    assert lod.quantised is None
    assert np.array_equal(lod.mesh.positions, mesh.positions)


@pytest.mark.parametrize("scale", [1e30, 1.0, 1e-30])
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_no_vertex_moves_by_more_than_half_a_step_along_each_axis(scale: float, offset: float) -> None:
    shape = ball(20)
    mesh = replace(shape, positions=((shape.positions.astype(float) + offset) * scale).astype(np.float32))
    (lod,), data = coded(mesh)
    assert lod.quantised is not None
    step = lod.quantised.grid.step[0]
    size = 2.0 * scale
    assert step == pytest.approx(size / 65535, rel=1e-3)
    node = document(data)["nodes"][0]
    there = np.array(node["translation"]) + lod.quantised.positions.astype(float) * np.array(node["scale"])
    assert np.abs(there - mesh.positions.astype(float)).max() <= 0.5000001 * step
    assert 0.1 * step < lod.errors["quantise_max_m"] <= 0.87 * step
    assert list(check_mesh(data, "ball.glb")) == []


def test_what_is_told_is_what_the_file_holds() -> None:
    mesh = ball(30)
    (lod,), data = coded(mesh)
    back = decode_glb(data)[0].mesh
    off = np.sqrt(((back.positions.astype(float) - mesh.positions.astype(float)) ** 2).sum(axis=1))
    assert lod.errors["quantise_max_m"] == pytest.approx(off.max(), rel=0.02)
    assert lod.errors["quantise_max"] == pytest.approx(off.max() / 12**0.5, rel=0.02)
    assert mesh.normals is not None
    assert back.normals is not None
    dot = np.clip((back.normals.astype(float) * mesh.normals.astype(float)).sum(axis=1), -1, 1)
    assert lod.errors["quantise_normal_max_deg"] == pytest.approx(
        float(np.degrees(np.arccos(dot)).max()), abs=0.02
    )
    assert mesh.uvs is not None
    assert back.uvs is not None
    assert lod.errors["quantise_uv_max"] == pytest.approx(np.abs(back.uvs - mesh.uvs).max(), abs=1e-7)
    extras = document(data)["nodes"][0]["extras"]
    assert {key: extras[key] for key in lod.errors} == lod.errors


def test_every_level_s_errors_hold_the_farthest_that_codes_moved_any_vertex() -> None:
    meshes = ball(30), ball(9)
    given = [Lod(mesh, most, rms) for mesh, most, rms in zip(meshes, (0.0, 0.02), (0.0, 0.004), strict=True)]
    found = quantised_levels(given, direction_deg=0.1)
    moved = [lod.errors["quantise_max"] for lod in found]
    assert min(moved) < max(moved)
    for lod, was in zip(found, given, strict=True):
        assert lod.error_max == pytest.approx(was.error_max + max(moved), rel=1e-5)
        assert lod.error_rms == pytest.approx(was.error_rms + max(moved), rel=1e-5)


def test_of_two_budgets_for_directions_the_stricter_decides() -> None:
    limits = {"quantise_normal_max_deg": 0.5, "quantise_tangent_max_deg": 0.2}
    assert direction_deg_of(limits) == 0.2
    assert direction_deg_of(limits | {"quantise_normal_max_deg": 0.1}) == 0.1


def test_a_file_whose_codes_are_wrong_is_told_as_wrong() -> None:
    mesh = ball()
    _, data = coded(mesh)
    sound = quantised_errors(data, [mesh])[0]
    moved = document(data)
    moved["nodes"][0]["translation"][1] += 0.01
    worse = quantised_errors(with_document(data, moved), [mesh])[0]
    assert worse["quantise_max_m"] == pytest.approx(0.01, rel=0.01)
    assert worse["quantise_normal_max_deg"] == sound["quantise_normal_max_deg"]
    turned = bytearray(data)
    tree = document(data)
    at = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]]["bufferView"]
    (length,) = struct.unpack_from("<I", data, 12)
    start = 28 + length + tree["bufferViews"][at]["byteOffset"]
    turned[start : start + 6] = struct.pack("<3h", *(-x for x in struct.unpack_from("<3h", data, start)))
    assert quantised_errors(bytes(turned), [mesh])[0]["quantise_normal_max_deg"] > 179


def test_one_place_stays_one_place_in_every_level() -> None:
    fine, coarse = ball(24), ball(8)
    lods, _ = coded(fine, coarse)
    seen: dict[bytes, bytes] = {}
    for lod in lods:
        assert lod.quantised is not None
        for place, code in zip(lod.mesh.positions + np.float32(0), lod.quantised.positions, strict=True):
            assert seen.setdefault(place.tobytes(), code.tobytes()) == code.tobytes()
    assert len({lod.quantised.grid for lod in lods if lod.quantised}) == 1


def test_eight_bits_serve_where_they_are_near_enough() -> None:
    for direction_deg, kind in ((1.0, np.int8), (0.1, np.int16)):
        (lod,), data = coded(ball(), direction_deg=direction_deg)
        assert lod.quantised is not None
        assert lod.quantised.normals is not None
        assert lod.quantised.normals.dtype == kind
        assert lod.quantised.tangents is not None
        assert lod.quantised.tangents.dtype == kind
        assert 0 < lod.errors["quantise_normal_max_deg"] <= direction_deg
        assert 0 < lod.errors["quantise_tangent_max_deg"] <= direction_deg
        assert list(check_mesh(data, "ball.glb")) == []
    assert direction_deg_of({}) == 0.1
    assert direction_deg_of({"quantise_normal_max_deg": 0.6, "quantise_max": 0.1}) == 0.6


def test_texture_coordinates_beyond_the_image_stay_floats() -> None:
    mesh = ball()
    assert mesh.uvs is not None
    wide = replace(mesh, uvs=mesh.uvs * np.float32(3))
    grid = mesh_grid([wide])
    found = quantise(wide, grid).uvs
    assert found is not None
    assert np.array_equal(found, wide.uvs)
    assert found.dtype == np.float32
    inside = quantise(mesh, grid).uvs
    assert inside is not None
    assert inside.dtype == np.uint16


def test_colours_of_eight_bits_stay_exact_and_others_take_sixteen() -> None:
    mesh = cube()
    palette = (np.arange(32).reshape(8, 4) * 8 / 255).astype(np.float32)
    (exact,), data = coded(replace(mesh, colors=palette))
    assert exact.errors["quantise_color_max"] < 1e-6
    back = decode_glb(data)[0]
    assert back.quantised is not None
    assert back.quantised.colors is not None
    assert back.quantised.colors.dtype == np.uint8
    (other,), _ = coded(replace(mesh, colors=palette * np.float32(0.9)))
    assert other.quantised is not None
    assert other.quantised.colors is not None
    assert other.quantised.colors.dtype == np.uint16
    assert 1e-7 < other.errors["quantise_color_max"] < 1e-5


def test_a_constant_axis_and_a_single_triangle_keep_their_place() -> None:
    points = np.array([[0, 7.25, 0], [3, 7.25, 0], [0, 7.25, 3]], np.float32)
    mesh = Mesh(points, np.array([[0, 1, 2]], np.uint32))
    (lod,), data = coded(mesh)
    back = decode_glb(data)[0].mesh.positions
    assert np.array_equal(back[:, 1], points[:, 1])
    assert lod.errors["quantise_max_m"] <= 3 / 65535
    dot = replace(mesh, positions=np.tile(points[:1], (3, 1)))
    assert mesh_grid([dot]).step == (1.0, 1.0, 1.0)


def test_a_mesh_too_small_for_a_step_in_float32_is_refused() -> None:
    mesh = cube()
    with pytest.raises(BakeError, match="too small"):
        coded(replace(mesh, positions=mesh.positions * np.float32(1e-36)))


@pytest.mark.parametrize(("count", "component"), [(65535, 5123), (65536, 5125)])
def test_indices_keep_their_rule_and_every_code_of_65536_is_used(count: int, component: int) -> None:
    positions = np.zeros((count, 3), np.float32)
    positions[:, 0] = np.arange(count)
    mesh = Mesh(positions, np.array([[0, 1, count - 1]], np.uint32))
    (lod,), data = coded(mesh)
    found = document(data)
    assert found["accessors"][found["meshes"][0]["primitives"][0]["indices"]]["componentType"] == component
    assert lod.quantised is not None
    assert lod.quantised.positions[:, 0].max() == 65535
    assert len(np.unique(lod.quantised.positions[:, 0])) == count


def test_the_file_needs_the_extension_and_its_rows_start_at_multiples_of_four() -> None:
    _, data = coded(ball(), ball(10))
    found = document(data)
    assert found["extensionsRequired"] == ["KHR_mesh_quantization"]
    assert found["extensionsUsed"] == ["KHR_mesh_quantization", "MSFT_lod"]
    sizes = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5126: 4}
    widths = {"VEC2": 2, "VEC3": 3, "VEC4": 4}
    for mesh in found["meshes"]:
        for name, index in mesh["primitives"][0]["attributes"].items():
            entry = found["accessors"][index]
            view = found["bufferViews"][entry["bufferView"]]
            packed = sizes[entry["componentType"]] * widths[entry["type"]]
            stride = view.get("byteStride", packed)
            assert stride % 4 == 0
            assert packed <= stride < packed + 4
            assert view["byteLength"] == stride * entry["count"]
            assert entry.get("normalized", False) == (name != "POSITION")


def test_bounds_in_the_scene_are_metres() -> None:
    mesh = ball(radius=3.0, offset=(10, 20, 30))
    _, data = coded(mesh)
    facts = mesh_facts(data, "ball.glb")
    assert facts.center == pytest.approx((10, 20, 30), abs=1e-3)
    assert facts.radius_m == pytest.approx(27**0.5, abs=1e-3)


def _without(tree: dict[str, Any]) -> None:
    del tree["extensionsRequired"]


def _other_scale(tree: dict[str, Any]) -> None:
    tree["nodes"][1]["scale"] = [1.0, 1.0, 1.0]


def _no_scale(tree: dict[str, Any]) -> None:
    del tree["nodes"][0]["scale"]


def _zero_scale(tree: dict[str, Any]) -> None:
    tree["nodes"][0]["scale"][1] = 0


def _not_normalized(tree: dict[str, Any]) -> None:
    index = tree["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]
    del tree["accessors"][index]["normalized"]


def _no_stride(tree: dict[str, Any]) -> None:
    index = tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    del tree["bufferViews"][tree["accessors"][index]["bufferView"]]["byteStride"]


def _far(tree: dict[str, Any]) -> None:
    for node in tree["nodes"]:
        node["scale"] = [1e38, 1e38, 1e38]


@pytest.mark.parametrize(
    "spoil", [_without, _other_scale, _no_scale, _zero_scale, _not_normalized, _no_stride, _far]
)
def test_a_file_that_would_not_be_written_is_refused(spoil: Any) -> None:
    _, data = coded(ball(), ball(10))
    tree = document(data)
    spoil(tree)
    with pytest.raises(FormatError):
        decode_glb(with_document(data, tree))


def test_the_checker_sees_a_bad_normal_among_codes() -> None:
    mesh = ball()
    codes = quantise(mesh, mesh_grid([mesh]), direction_bits=8)
    assert codes.normals is not None
    short = codes.normals.copy()
    short[5] //= 2
    data = encode_glb([Lod(mesh, 0.0, 0.0, quantised=replace(codes, normals=short))], "ball")
    assert [finding.code for finding in check_mesh(data, "ball.glb")] == ["PZ203"]


def test_a_baked_mesh_states_what_its_codes_cost(tmp_path: Path) -> None:
    path = tmp_path / "thing.obj"
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/1\n"
    )
    plain = bake_mesh(path, lods=1)
    made = bake_mesh(path, lods=1, quantise={})
    level = made.report["lods"][0]
    assert plain.report["lods"][0]["error_max"] == 0.0
    assert "quantise_max" not in plain.report["lods"][0]
    assert level["quantise_max"] == level["error_max"] < 1e-5
    assert made.report["quantised"]
    extras = document(made.glb)["nodes"][0]["extras"]
    for key in ("error_p99", "normal_p99_deg", "uv_shift_max", "quantise_max_m", "quantise_uv_max"):
        assert extras[key] == level[key], key


# --- terrain ---


def dunes(rows: int = 65, columns: int = 97) -> Heightfield:
    z, x = np.mgrid[0:rows, 0:columns]
    heights = 6.0 * np.sin(x / 9.0) * np.cos(z / 7.0) + 3.0 * np.sin(x * z / 300.0)
    return Heightfield(heights.astype(np.float32), 0.5 * (columns - 1), 0.4 * (rows - 1))


def grid_of(field: Heightfield, max_error_m: float = 0.0) -> QuantisationGrid:
    heights = field.heights_m
    return terrain_grid(
        (heights.shape[0], heights.shape[1]),
        (field.size_x_m, field.size_z_m),
        (float(heights.min()), float(heights.max())),
        max_error_m,
    )


def part(field: Heightfield, rows: range, columns: range) -> tuple[Mesh, npt.NDArray[np.int64]]:
    """A grid of every pixel in a rectangle, and the pixels of its vertices."""
    row, column = (axis.ravel() for axis in np.meshgrid(rows, columns, indexing="ij"))
    number = np.arange(len(row)).reshape(len(rows), len(columns))
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    pixels = np.stack([row, column], axis=1)
    return pixels_mesh(field, pixels, faces, sand_repeat=10.0), pixels


@pytest.mark.parametrize("max_error_m", [0.0, 0.1])
def test_a_terrains_codes_are_its_pixels(max_error_m: float) -> None:
    field = dunes()
    grid = grid_of(field, max_error_m)
    mesh, pixels = part(field, range(65), range(97))
    _, codes = quantised_terrain(mesh, grid)
    assert np.array_equal(codes.positions[:, 0], pixels[:, 1])
    assert np.array_equal(codes.positions[:, 2], pixels[:, 0])
    heights = grid.origin[1] + codes.positions[:, 1].astype(float) * grid.step[1]
    assert np.abs(heights - field.heights_m.ravel().astype(float)).max() <= 0.5 * grid.step[1] + 1e-9


@pytest.mark.parametrize("max_error_m", [0.0, 0.1])
def test_both_sides_of_a_border_have_the_same_codes(max_error_m: float) -> None:
    field = dunes()
    grid = grid_of(field, max_error_m)
    (west, at_west), (east, at_east) = (
        part(field, range(65), range(41)),
        part(field, range(65), range(40, 97)),
    )
    seen, one = quantised_terrain(west, grid)
    also, other = quantised_terrain(east, grid)
    left, right = at_west[:, 1] == 40, at_east[:, 1] == 40
    assert left.sum() == right.sum() == 65
    for name in ("positions", "normals", "tangents", "uvs", "uvs1"):
        assert np.array_equal(getattr(one, name)[left], getattr(other, name)[right]), name
    assert np.array_equal(seen.positions[left], also.positions[right])


@pytest.mark.parametrize(("max_error_m", "bits"), [(0.0, 32), (0.1, 16)])
def test_a_viewer_that_follows_the_standard_sees_a_terrains_normals(max_error_m: float, bits: int) -> None:
    field = dunes()
    grid = grid_of(field, max_error_m)
    assert direction_bits(grid) == bits
    mesh, _ = part(field, range(65), range(97))
    seen, codes = quantised_terrain(mesh, grid)
    data = encode_glb([Lod(mesh, 0.0, 0.0, quantised=codes)], "terrain")
    found = quantised_errors(data, [mesh])[0]
    assert found["quantise_normal_max_deg"] < 0.1
    assert found["quantise_tangent_max_deg"] < 0.1
    assert list(check_mesh(data, "terrain.glb")) == []
    assert mesh.normals is not None
    assert seen.normals is not None
    assert np.abs(seen.normals - mesh.normals).max() < 2e-3
    assert np.array_equal(decode_glb(data)[0].mesh.positions, seen.positions)


def test_a_flat_terrain_and_one_of_65536_pixels_a_side_have_a_grid() -> None:
    flat = terrain_grid((2, 2), (1.0, 1.0), (5.0, 5.0))
    assert flat.step[1] > 0
    assert terrain_grid((2, 65536), (65535.0, 1.0), (0.0, 1.0)).step[0] == 1.0
    with pytest.raises(BakeError, match="65536 a side"):
        terrain_grid((2, 65537), (65535.0, 1.0), (0.0, 1.0))


def test_levels_need_one_grid() -> None:
    fine, coarse = ball(), ball(10)
    (a,) = quantise_levels([fine], mesh_grid([fine]))
    (b,) = quantise_levels([coarse], QuantisationGrid((1.0, 1.0, 1.0), (-1.0, -1.0, -1.0)))
    with pytest.raises(BakeError, match="one quantisation grid"):
        encode_glb([Lod(fine, 0, 0, quantised=a), Lod(coarse, 0, 0, quantised=b)], "two")
    with pytest.raises(BakeError, match="outside the grid"):
        quantise(fine, QuantisationGrid((1e-6, 1e-6, 1e-6), (0.0, 0.0, 0.0)))


def hills(tmp_path: Path) -> Path:
    z, x = np.mgrid[0:129, 0:161]
    codes = 32767 * (1.0 + np.sin(x / 17.0) * np.cos(z / 11.0))
    path = tmp_path / "hills.pgm"
    path.write_bytes(b"P5 161 129 65535\n" + codes.astype(">u2").tobytes())
    return path


@pytest.mark.parametrize("tier", ["fast", "balanced", "exact"])
def test_a_terrain_of_codes_keeps_the_bound_that_was_asked_for(tmp_path: Path, tier: str) -> None:
    size = {"size_m": (160.0, 128.0), "height_m": 20.0}
    plain = bake_terrain(hills(tmp_path), TerrainSettings(**size, max_error_m=0.1), tier=tier)
    made = bake_terrain(hills(tmp_path), TerrainSettings(**size, max_error_m=0.1, quantise=True), tier=tier)
    assert made.tier == tier
    assert 0 < made.max_error_m <= 0.1
    assert 0 < made.quantisation_errors["quantise_max_m"] <= 0.1 / 8
    assert made.quantisation_errors["quantise_normal_max_deg"] <= 0.1
    assert len(made.glb) / made.vertices < 0.8 * len(plain.glb) / plain.vertices
    assert list(check_mesh(made.glb, "terrain.glb")) == []
    node = document(made.glb)["nodes"][0]
    assert node["extras"]["quantise_max_m"] == made.quantisation_errors["quantise_max_m"]
    (lod,) = decode_glb(made.glb)
    assert lod.quantised is not None
    assert lod.quantised.positions.max(axis=0)[[0, 2]].tolist() == [160, 128]


def test_a_bound_finer_than_codes_is_refused_and_told(tmp_path: Path) -> None:
    settings = TerrainSettings(size_m=(160.0, 128.0), height_m=2000.0, max_error_m=0.0, quantise=True)
    with pytest.raises(BakeError, match="16-bit positions reach no less"):
        bake_terrain(hills(tmp_path), settings)


def tile_of(field: Heightfield, grid: QuantisationGrid | None) -> bytes:
    patches = []
    for index, columns in enumerate((range(41), range(40, 97))):
        mesh, _ = part(field, range(65), columns)
        codes = None if grid is None else quantised_terrain(mesh, grid)[1]
        patches.append(TilePatch(index, mesh, 0.25, True, codes))
    ((data, indices),) = encode_tiles(patches)
    assert indices == [0, 1]
    return data


def test_a_tile_of_codes_comes_back_and_its_patches_meet() -> None:
    field = dunes()
    grid = grid_of(field, 0.1)
    data = tile_of(field, grid)
    west, east = decode_tile(data)
    assert west.quantised is not None
    assert east.quantised is not None
    assert west.quantised.grid == east.quantised.grid == grid
    left, right = west.quantised.positions[:, 0] == 40, east.quantised.positions[:, 0] == 40
    assert left.sum() == right.sum() == 65
    assert np.array_equal(west.quantised.positions[left], east.quantised.positions[right])
    assert np.array_equal(west.mesh.positions[left], east.mesh.positions[right])
    assert np.array_equal(west.quantised.normals[left], east.quantised.normals[right])  # type: ignore[index]
    meshes = [part(field, range(65), columns)[0] for columns in (range(41), range(40, 97))]
    for errors in quantised_errors(data, meshes):
        assert 0 < errors["quantise_max_m"] <= 0.1 / 8
        assert errors["quantise_normal_max_deg"] < 0.1
    assert len(data) < 0.8 * len(tile_of(field, None))
    tree = document(data)
    del tree["nodes"][1]["scale"]
    with pytest.raises(FormatError):
        decode_tile(with_document(data, tree))


def test_patches_of_two_grids_are_no_terrain() -> None:
    field = dunes()
    mesh, _ = part(field, range(65), range(97))
    patches = [
        TilePatch(index, mesh, 0.0, True, quantised_terrain(mesh, grid_of(field, bound))[1])
        for index, bound in enumerate((0.0, 0.1))
    ]
    with pytest.raises(BakeError, match="one quantisation grid"):
        list(encode_tiles(patches))


@pytest.mark.parametrize(
    ("accepted", "kind"), sweep([(0.1, np.int16), (1.0, np.int8)], test=[(0.1, np.int16)])
)
def test_a_scenes_budget_decides_how_its_objects_codes_are_made(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    cove_store: Callable[[Path], Path],
    accepted: float,
    kind: type,
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    scene = make_cove(tmp_path / "scene")
    text = scene.read_text().replace("lods = 3", "lods = 3\nquantise = true")
    scene.write_text(f"{text}\n[budget]\nquantise_normal_max_deg = {accepted}\n")
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not report.errors
    manifest = json.loads((tmp_path / "out/scene.json").read_text())
    entry = manifest["artifacts"]["post_mesh"]
    assert 0 < entry["errors"]["quantise_normal_max_deg"] <= accepted
    assert entry["errors"]["quantise_max_m"] > 0
    assert all("quantise_max" in level for level in entry["levels"])
    codes = decode_glb((tmp_path / "out" / entry["file"]).read_bytes())[0].quantised
    assert codes is not None
    assert codes.normals is not None
    assert codes.normals.dtype == kind
    low, high = decode_glb((tmp_path / "out" / entry["file"]).read_bytes())[0].mesh.positions[[0, -1]]
    (post,) = manifest["objects"]
    center = np.array(post["center"])
    for corner in (low, high):
        assert np.sqrt(((corner - center) ** 2).sum()) <= post["radius_m"] * 1.0001
    assert list(check_paths([tmp_path / "out"])) == []

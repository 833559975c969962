"""Tiles of a terrain in a whole bake: as many files as it takes, told, published, kept and swept as one; what
scene.json says of them is held to, and checked."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.bakers.terrain.grow import Grower
from paradize.bakers.terrain.tiles import bake_tiles, floor_of
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.checks.paths import check_paths
from paradize.data import Heightfield, Mesh
from paradize.errors import BakeError, FormatError
from paradize.explain.facts import explain
from paradize.explain.words import render
from paradize.export.scene import export
from paradize.formats.glb import tiles as glb_tiles
from paradize.formats.glb.tiles import TILE_BYTES, TilePatch, decode_tile, encode_tiles
from paradize.formats.scene.manifest import decode_scene, encode_scene
from paradize.formats.scene.terrain_tables import check_tree
from paradize.readers.heightmap import read_heightmap
from paradize.scene.baker_settings import TileSettings
from paradize.stages.quantise import quantise, terrain_grid
from paradize.store.local import key_of
from paradize.visibility.query import plan_query
from tests.pipeline.bakes import bake_apart
from tests.pipeline.glb_json import document
from tests.pipeline.scenes import make_cove, write_image
from tests.pipeline.visibility.test_terrain_demand import flight_settings, flight_views_of
from tests.sweeps import sweep


def make_coast(folder: Path, tile_mb: float = 0.05) -> Path:
    """The cove with ground that is rough enough for several tiles, and not all of it near the flight."""
    scene = make_cove(folder)
    rng = np.random.default_rng(2)
    z, x = np.mgrid[0:100, 0:75] / 40.0
    hills = 0.5 + 0.3 * np.sin(3 * x) * np.cos(2 * z) + 0.02 * rng.standard_normal(x.shape)
    write_image(folder / "height.png", (np.clip(hills, 0, 1) * 65535).astype(np.uint16)[:, :, None])
    text = scene.read_text().replace("size_m = [20.0, 20.0]", "size_m = [300.0, 400.0]")
    text = text.replace("max_error_m = 0.05", f"max_error_m = 0.05\npatch_px = 16\ntile_mb = {tile_mb}")
    scene.write_text(text)
    return scene


def test_no_ground_is_higher_than_the_floor_says_of_its_cell() -> None:
    heights = np.random.default_rng(5).uniform(-9.0, 3.0, (40, 61)).astype(np.float32)
    floor = floor_of(Heightfield(heights, 120.0, 78.0), 20)
    columns, cells = floor["columns"], np.reshape(floor["highest_m"], (-1, floor["columns"]))
    assert floor["cell_m"] == [6.0, 6.0] and cells.shape == (13, 20) and columns == 20
    for row in range(40):
        for column in range(61):
            near = cells[max(0, (row - 1) // 3) : row // 3 + 1, max(0, (column - 1) // 3) : column // 3 + 1]
            assert (near[-1, -1] if row < 39 and column < 60 else near.min()) >= heights[row, column] - 1e-6
    assert (cells <= heights.max() + 0.1).all()


@pytest.fixture(scope="module")
def coast(
    tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]
) -> tuple[Path, Path, Path]:
    """(scene, folder of its bake, store)"""
    top = tmp_path_factory.mktemp("coast")
    cove_store(top / "store")
    scene = make_coast(top / "scene")
    bake_apart(scene, top)
    return scene, top / "out", top / "store"


@pytest.fixture
def copied(
    coast: tuple[Path, Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[Path, Path]:
    scene, _, store = coast
    shutil.copytree(scene.parent, tmp_path / "scene")
    shutil.copytree(store, tmp_path / "store")
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    again = tmp_path / "scene" / scene.name
    assert not bake(again, tmp_path / "out", BuildOptions()).errors
    return again, tmp_path / "out"


def manifest_of(out: Path) -> dict[str, Any]:
    return decode_scene((out / "scene.json").read_bytes())


def tiles_of(out: Path) -> list[Path]:
    manifest = manifest_of(out)
    return [out / manifest["artifacts"][name]["file"] for name in manifest["terrain"]["tiles"]]


def test_every_tile_is_an_artifact_and_together_they_hold_every_patch_once(coast: Any) -> None:
    _, out, _ = coast
    manifest = manifest_of(out)
    terrain = manifest["terrain"]
    assert len(terrain["tiles"]) > 3
    assert terrain["tiles"][:2] == ["terrain_mesh", "terrain_mesh_1"]
    row = 0
    for number, file in enumerate(tiles_of(out)):
        assert file.stat().st_size <= 50_000 or len(decode_tile(file.read_bytes())) == 1
        for node, patch in enumerate(decode_tile(file.read_bytes())):
            patches = terrain["patches"]
            assert (patch.index, patches["tile"][row], patches["node"][row]) == (row, number, node)
            assert patch.finest == (patches["diamond"][row] < 0)
            away = np.linalg.norm(patch.mesh.positions - np.array(patches["center"][row]), axis=1)
            assert away.max() <= patches["radius_m"][row] * (1 + 1e-5)
            row += 1
    assert row == len(terrain["patches"]["level"])


def test_the_scenes_of_all_tiles_are_the_whole_terrain_once(coast: Any) -> None:
    """The finest patches that are baked: their area from above is the terrain's."""
    _, out, _ = coast
    area = 0.0
    for file in tiles_of(out):
        for patch in decode_tile(file.read_bytes()):
            if patch.finest:
                a, b, c = (
                    patch.mesh.positions[patch.mesh.triangles[:, k]].astype(np.float64) for k in range(3)
                )
                u, v = b - a, c - a
                area += float(np.abs(u[:, 0] * v[:, 2] - u[:, 2] * v[:, 0]).sum()) / 2
    assert area == pytest.approx(300.0 * 400.0, rel=1e-6)


def test_an_export_holds_the_finest_ground_that_there_is_once(
    coast: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Coarse patches stay behind: seen from above the exported ground's triangles are as large as it is."""
    monkeypatch.setattr("paradize.export.heights.GROUND_TEXELS", 64)
    monkeypatch.setattr("paradize.export.scene.GROUND_TEXELS", 64)
    glb = export(coast[1], tmp_path / "coast.glb").file.read_bytes()
    tree, area = document(glb), 0.0
    binary = glb[28 + int.from_bytes(glb[12:16], "little") :]

    def read(accessor: int, kind: str, width: int) -> Any:
        result = tree["accessors"][accessor]
        start = tree["bufferViews"][result["bufferView"]]["byteOffset"] + result.get("byteOffset", 0)
        return np.frombuffer(binary, kind, width * result["count"], start).reshape(-1, width)

    for mesh in tree["meshes"]:
        if mesh["name"].startswith("terrain_mesh"):
            (primitive,) = mesh["primitives"]
            wide = tree["accessors"][primitive["indices"]]["componentType"] == 5125
            corners = read(primitive["attributes"]["POSITION"], "<f4", 3).astype(float)
            a, b, c = corners[
                read(primitive["indices"], "<u4" if wide else "<u2", 1).reshape(-1, 3)
            ].swapaxes(0, 1)
            u, v = b - a, c - a
            area += float(np.abs(u[:, 0] * v[:, 2] - u[:, 2] * v[:, 0]).sum()) / 2
    assert area == pytest.approx(300.0 * 400.0, rel=1e-5)


def test_coarse_tiles_come_first_and_seconds_are_those_of_the_flight(coast: Any) -> None:
    manifest = manifest_of(coast[1])
    terrain, artifacts = manifest["terrain"], manifest["artifacts"]
    assert artifacts[terrain["tiles"][0]]["first_needed_s"] == 0.0
    seconds = [artifacts[name]["first_needed_s"] for name in terrain["tiles"]]
    assert all(0.0 <= second <= manifest["flight"]["duration_s"] for second in seconds)
    order = [name for name in manifest["streaming"] if name in terrain["tiles"]]
    assert order == sorted(order, key=lambda name: artifacts[name]["first_needed_s"])
    assert order[0] == "terrain_mesh"


@pytest.mark.parametrize("seen", sweep([True, False], test=[True]))
def test_a_tile_is_needed_when_its_first_patch_is_and_errs_as_its_patches_do_by_area(
    tmp_path: Path, seen: bool
) -> None:
    path = make_coast(tmp_path).parent / "height.png"
    flight_views = flight_views_of(flight_settings(True)) if seen else None
    settings: dict[str, Any] = {"size_x_m": 60.0, "size_z_m": 80.0, "height_m": 4.0}
    tiles = TileSettings(
        size_m=(60.0, 80.0),
        height_m=4.0,
        max_error_m=0.05,
        patch_px=16,
        tile_mb=0.05,
        flight_views=flight_views,
    )
    made = bake_tiles(path, tmp_path / "room", tiles)
    ground, _ = read_heightmap(path, **settings)
    query = plan_query(flight_views) if flight_views else None
    grower = Grower(ground, max_error_m=0.05, leaf_px=16, sand_repeat=1.0, query=query)
    tree = grower.grow()
    spans, sizes = [], set()
    for tile in made.tiles:
        held = [tree.patches[patch.index] for patch in decode_tile(tile.file.read_bytes())]
        first = [patch.first_s for patch in held]
        assert tile.first_s == min(first)
        spans.append(max(first) - min(first))
        finest = [(patch.area_px, patch.error) for patch in held if patch.level == grower.shape.finest]
        known = [(area, error.rms_m**2) for area, error in finest if error is not None]
        if known:
            mean = sum(area * square for area, square in known) / sum(area for area, _ in known)
            assert tile.errors["terrain_rms_m"] == pytest.approx(mean**0.5, rel=1e-5)
            sizes |= {area for area, _ in known}
    assert len(spans) > 2 and (max(spans) > 0.0 if seen else len(sizes) > 1)


def test_only_tiles_with_patches_of_the_finest_level_claim_the_bound(coast: Any) -> None:
    manifest = manifest_of(coast[1])
    patches = manifest["terrain"]["patches"]
    finest = max(patches["level"])
    assert finest == 6  # 16 * 2^3 pixels hold the field
    claims = [manifest["artifacts"][name]["errors"] for name in manifest["terrain"]["tiles"]]
    for number, errors in enumerate(claims):
        rows = [k for k, tile in enumerate(patches["tile"]) if tile == number]
        errors_m = [patches["error_m"][k] for k in rows if patches["level"][k] == finest]
        assert errors["terrain_tile_max_m"] == max(patches["error_m"][k] for k in rows)
        assert ("terrain_max_m" in errors) == bool(errors_m)
        if errors_m:
            assert errors["terrain_max_m"] == pytest.approx(max(errors_m), rel=1e-4)
            assert errors["terrain_max_m"] <= 0.05
    assert 0 < sum("terrain_max_m" in errors for errors in claims) < len(claims)


def test_a_second_bake_reuses_every_tile_and_publishes_a_missing_one_again(
    copied: tuple[Path, Path],
) -> None:
    scene, out = copied
    before = {path.name: path.stat().st_mtime_ns for path in out.iterdir()}
    report = bake(scene, out, BuildOptions())
    assert report.count("reused") == len(report.rows) == len(manifest_of(out)["artifacts"])
    assert {path.name: path.stat().st_mtime_ns for path in out.iterdir()} == before
    lost = tiles_of(out)[1]
    was = lost.read_bytes()
    lost.unlink()
    assert bake(scene, out, BuildOptions()).count("baked") == 0
    assert lost.read_bytes() == was


def test_a_damaged_tile_in_the_store_is_baked_again(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    manifest = manifest_of(out)
    sha256 = manifest["artifacts"]["terrain_mesh_2"]["sha256"]
    blob = scene.parent.parent / "store" / "blobs" / sha256[:2] / sha256
    blob.write_bytes(blob.read_bytes()[:-1] + b"x")
    tiles_of(out)[2].unlink()
    report = bake(scene, out, BuildOptions())
    assert not report.errors
    assert {row["name"] for row in report.rows if row["status"] == "baked"} == set(
        manifest["terrain"]["tiles"]
    )
    assert manifest_of(out) == manifest
    assert all(file.is_file() for file in tiles_of(out))


def test_fewer_tiles_sweep_those_that_are_no_longer_there_and_what_a_kill_left_in_their_room(
    copied: tuple[Path, Path],
) -> None:
    scene, out = copied
    old = tiles_of(out)
    left = scene.parent.parent / "store" / "scratch" / key_of(str(out.resolve()))[:32]
    left.mkdir(parents=True)
    (left / "tile0.glb").write_bytes(b"half")
    scene.write_text(scene.read_text().replace("tile_mb = 0.05", "tile_mb = 64.0"))
    assert not bake(scene, out, BuildOptions()).errors
    (tile,) = tiles_of(out)
    assert not any(file.exists() for file in old)
    assert len(decode_tile(tile.read_bytes())) == len(manifest_of(out)["terrain"]["patches"]["level"])
    assert not list((scene.parent.parent / "store" / "scratch").iterdir())


@pytest.mark.deep
def test_bytes_do_not_depend_on_the_workers(copied: tuple[Path, Path], tmp_path: Path) -> None:
    scene, out = copied
    bake(scene, tmp_path / "again", BuildOptions(jobs=1, force=True))
    ours, theirs = ([file.read_bytes() for file in tiles_of(folder)] for folder in (out, tmp_path / "again"))
    assert ours == theirs
    assert (out / "scene.json").read_bytes() == (tmp_path / "again" / "scene.json").read_bytes()


def test_explain_names_the_second_that_asked_and_what_was_left_out(coast: Any) -> None:
    scene, out, _ = coast
    demand = manifest_of(out)["terrain"]["demand"]
    assert demand["left_out"] > 0
    explanation = explain(scene, "terrain_mesh_3", out)
    (result,) = explanation.artifacts
    assert result["demand"]["finest_s"] == demand["finest_s"]
    text = render(explanation)
    assert f"first needed at second {demand['finest_s']:g}" in text
    assert f"{demand['left_out']} patches that no second needs are left out" in text


@pytest.mark.deep
def test_a_scene_that_accepts_larger_errors_leaves_more_out(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    strict = manifest_of(out)["terrain"]["demand"]["left_out"]
    scene.write_text(scene.read_text().replace('name = "cove"', 'name = "cove"\nlod_error_px = 50.0', 1))
    assert not bake(scene, out, BuildOptions()).errors
    assert manifest_of(out)["terrain"]["demand"]["left_out"] > strict


# -- the format


def triangle(index: int, **changes: Any) -> TilePatch:
    positions = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0]], np.float32) + np.float32(index)
    arrays: dict[str, Any] = {
        "positions": positions,
        "triangles": np.array([[0, 1, 2]], np.uint32),
        "normals": np.array([[0, 1, 0]] * 3, np.float32),
        "tangents": np.array([[1, 0, 0, 1]] * 3, np.float32),
        "uvs": positions[:, [0, 2]].copy(),
        "uvs1": positions[:, [0, 2]].copy(),
    }
    return TilePatch(index, Mesh(**(arrays | changes)), 0.25 * index, index % 2 == 0)


def test_patches_come_back_from_a_tile_bit_by_bit() -> None:
    sent = [triangle(index) for index in range(3, 9)]
    ((data, indices),) = encode_tiles(sent)
    assert indices == list(range(3, 9))
    for patch, found in zip(sent, decode_tile(data), strict=True):
        assert (patch.index, patch.error_m, patch.finest) == (found.index, found.error_m, found.finest)
        for name in ("positions", "triangles", "normals", "tangents", "uvs", "uvs1"):
            ours, theirs = getattr(patch.mesh, name), getattr(found.mesh, name)
            assert ours.tobytes() == theirs.tobytes() and ours.shape == theirs.shape


def test_patches_whose_codes_differ_in_type_are_neither_written_nor_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A player draws a tile in one call, with one layout of vertices."""
    grid = terrain_grid((3, 3), (2.0, 2.0), (0.0, 1.0))
    first = triangle(0)
    floats, codes = (quantise(first.mesh, grid, float_uvs=kept) for kept in (True, False))
    same = [replace(first, index=index, quantised=floats) for index in range(2)]
    assert [len(decode_tile(data)) for data, _ in encode_tiles(same)] == [2]
    with pytest.raises(BakeError, match="same types"):
        list(encode_tiles([same[0], replace(same[1], quantised=codes)]))
    with monkeypatch.context() as patch:  # what an earlier version wrote
        patch.setattr(glb_tiles, "_layout", lambda patch: (grid, ()))
        ((mixed, _),) = encode_tiles([same[0], replace(same[1], quantised=codes)])
    with pytest.raises(FormatError, match="same types"):
        decode_tile(mixed)


def test_a_tile_is_closed_before_it_exceeds_its_limit() -> None:
    tiles = list(encode_tiles((triangle(index) for index in range(60)), 20_000))
    assert [k for _, indices in tiles for k in indices] == list(range(60))
    assert 1 < len(tiles) < 60
    assert all(len(data) <= 20_000 for data, _ in tiles)
    assert TILE_BYTES == 64_000_000


@pytest.mark.parametrize(
    "changes",
    [
        {"uvs1": None},
        {"normals": np.full((3, 3), np.nan, np.float32)},
        {"triangles": np.array([[0, 1, 3]], np.uint32)},
        {"triangles": np.empty((0, 3), np.uint32)},
        {"colors": np.ones((3, 4), np.float32)},
    ],
    ids=["a column missing", "not finite", "index out of range", "nothing", "colours"],
)
def test_what_is_no_patch_is_not_written(changes: dict[str, Any]) -> None:
    with pytest.raises(BakeError):
        list(encode_tiles([triangle(1, **changes)]))


def test_a_tile_with_any_byte_of_its_tables_changed_is_read_as_a_tile_or_refused() -> None:
    ((data, _),) = encode_tiles([triangle(0), triangle(1)])
    rng = np.random.default_rng(6)
    length = int.from_bytes(data[12:16], "little") + 28
    for _ in range(3000):
        at = int(rng.integers(0, length))
        broken = data[:at] + bytes([int(rng.integers(0, 256))]) + data[at + 1 :]
        try:
            decode_tile(broken)
        except FormatError as error:
            assert error.place is not None


# -- check


def changed_tile(out: Path, number: int, edit: Callable[[list[TilePatch]], list[TilePatch]]) -> None:
    """Writes a tile anew with other patches, and makes scene.json's hash fit."""
    file = tiles_of(out)[number]
    ((data, _),) = encode_tiles(edit(decode_tile(file.read_bytes())))
    file.write_bytes(data)
    manifest = manifest_of(out)
    entry = manifest["artifacts"][manifest["terrain"]["tiles"][number]]
    entry |= {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
    (out / "scene.json").write_bytes(encode_scene(manifest))


def lifted(patches: list[TilePatch]) -> list[TilePatch]:
    """One border vertex a little higher."""
    positions = patches[0].mesh.positions.copy()
    positions[0, 1] += 0.01
    mesh = replace(patches[0].mesh, positions=positions)
    return [TilePatch(patches[0].index, mesh, patches[0].error_m, patches[0].finest), *patches[1:]]


def inside_of(mesh: Mesh) -> npt.NDArray[np.bool_]:
    """Which vertices are not on the rim."""
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    rim, count = np.unique(edges, axis=0, return_counts=True)
    inner = np.ones(len(mesh.positions), bool)
    inner[rim[count == 1]] = False
    return inner


def moved_inside(patches: list[TilePatch], up_m: Callable[[TilePatch], float]) -> list[TilePatch]:
    """Moves the vertices inside the first patch that has some."""
    at = next(i for i, patch in enumerate(patches) if inside_of(patch.mesh).any())
    chosen = patches[at]
    positions = chosen.mesh.positions.copy()
    positions[inside_of(chosen.mesh), 1] += np.float32(up_m(chosen))
    moved = replace(chosen, mesh=replace(chosen.mesh, positions=positions))
    return [*patches[:at], moved, *patches[at + 1 :]]


def bulging(patches: list[TilePatch]) -> list[TilePatch]:
    """A patch far above the ground."""
    return moved_inside(patches, lambda _: 100.0)


def sunk(patches: list[TilePatch]) -> list[TilePatch]:
    """A patch lower than its error, and that of what replaces it, allows."""
    return moved_inside(patches, lambda patch: -2.0 * patch.error_m - 0.3)


def other_error(patches: list[TilePatch]) -> list[TilePatch]:
    first = patches[0]
    return [TilePatch(first.index, first.mesh, first.error_m + 1.0, first.finest), *patches[1:]]


TILE_FAULTS: list[tuple[str, str, Callable[[Path], Any]]] = [
    ("PZ404", "a tile of other errors", lambda out: changed_tile(out, 0, other_error)),
    ("PZ404", "a tile that lacks a patch", lambda out: changed_tile(out, -1, lambda tile: tile[:-1])),
    ("PZ405", "a lifted vertex", lambda out: changed_tile(out, 0, lifted)),
    ("PZ413", "a patch that bulges", lambda out: changed_tile(out, -1, bulging)),
    ("PZ413", "a patch that lies too low", lambda out: changed_tile(out, -1, sunk)),
]


ONE_OF_EACH_RULE = ("a tile of other errors", "a lifted vertex", "a patch that bulges")
QUICK = [fault for fault in TILE_FAULTS if fault[1] in ONE_OF_EACH_RULE]


def test_no_fault_is_found_in_sound_tiles(coast: Any) -> None:
    assert not [f for f in check_paths([coast[1]]) if f.code.startswith("PZ40") and f.code > "PZ403"]


@pytest.mark.parametrize(
    ("code", "fault", "plant"),
    sweep(TILE_FAULTS, test=QUICK),
    ids=[f for _, f, _ in TILE_FAULTS],
)
def test_a_fault_in_a_tile_is_found(
    coast: Any, tmp_path: Path, code: str, fault: str, plant: Callable[[Path], Any]
) -> None:
    shutil.copytree(coast[1], tmp_path / "out")
    plant(tmp_path / "out")
    found = check_paths([tmp_path / "out"])
    assert {finding.code for finding in found if finding.severity == "error"} == {code}


TABLES: list[tuple[str, Callable[[dict[str, Any]], Any]]] = [
    ("a column too short", lambda t: t["patches"]["node"].pop()),
    ("levels that fall", lambda t: t["patches"]["level"].reverse()),
    ("a tile that is not there", lambda t: t["patches"]["tile"].__setitem__(-1, 99)),
    ("a diamond of another level", lambda t: t["patches"]["made_by"].__setitem__(-1, 0)),
    ("a root below level 0", lambda t: t["patches"]["made_by"].__setitem__(-1, -1)),
    ("a diamond that nothing makes", lambda t: _grow(t["diamonds"])),
    ("an error that falls towards the root", lambda t: t["diamonds"]["error_m"].__setitem__(0, 0.0)),
    ("a sphere too small", lambda t: t["diamonds"]["radius_m"].__setitem__(0, 1.0)),
    ("no tiles", lambda t: t["tiles"].clear()),
]


def _grow(table: dict[str, list[Any]]) -> None:
    for column in table.values():
        column.append(column[-1])


@pytest.mark.parametrize(("fault", "edit"), TABLES, ids=[fault for fault, _ in TABLES])
def test_tables_that_make_no_tree_are_refused(coast: Any, fault: str, edit: Callable[[Any], Any]) -> None:
    manifest = manifest_of(coast[1])
    edit(manifest["terrain"])
    with pytest.raises(FormatError) as raised:
        decode_scene(json.dumps(manifest).encode())
    assert raised.value.place is not None and raised.value.place.startswith("terrain")


def test_the_example_of_the_tables_is_one() -> None:
    check_tree(json.loads((Path(__file__).parent / "tiles.json").read_text()))

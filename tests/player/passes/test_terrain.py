"""The terrain as patches: no cracks at any time, correct culling, few triangles where few suffice."""

from __future__ import annotations

import copy
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.data import Texture
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.stages.quantise import terrain_grid
from tests.player.patches import tiled
from tests.player.posed import Posed, differs
from tests.player.synthetic import identity, write_scene
from tests.sweeps import sweep

Player = Callable[..., "subprocess.CompletedProcess[str]"]
SIZE_M = 60.0
LEVELS = 9
FEW_LEVELS = 7
WIDTH, HEIGHT = 160, 90
FLIGHT_SIZE = "320x180"
FLIGHT = 24  # frames


def hills(x: npt.NDArray[np.float64], z: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Hills of up to 3 m, with small hills in one corner only."""
    small = np.exp(-((x - 15) ** 2 + (z - 15) ** 2) / 100) * np.sin(3 * x) * np.cos(2.5 * z)
    return np.asarray(2.4 * np.sin(x / 6) * np.cos(z / 8) + 0.6 * small)


def hills_in_a_sea(folder: Path, levels: int) -> Path:
    """In three tiles, with measured errors."""
    terrain = tiled(SIZE_M, hills, levels=levels, refine=4, tiles=3)
    write_scene(folder, terrain=terrain, objects=[], particles=[])
    manifest = json.loads((folder / "scene.json").read_text())
    manifest["terrain"] |= {"mix_low_m": -5.0, "mix_high_m": -4.0}
    (folder / "scene.json").write_text(json.dumps(manifest))
    return folder


@pytest.fixture(scope="module")
def hilly(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """254 patches."""
    return hills_in_a_sea(tmp_path_factory.mktemp("hilly"), FEW_LEVELS)


@pytest.fixture(scope="module")
def finer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """1022 patches."""
    return hills_in_a_sea(tmp_path_factory.mktemp("finer"), LEVELS)


def pose(manifest: dict[str, Any], eye: tuple[float, ...], target: tuple[float, ...]) -> dict[str, Any]:
    """A flight that stays at one pose."""
    out = copy.deepcopy(manifest)
    out["flight"]["segments"] = [
        {
            "eye": [[v, 0.0, 0.0, 0.0] for v in eye],
            "target": [[v, 0.0, 0.0, 0.0] for v in target],
            "roll": [0.0, 0.0, 0.0, 0.0],
        }
    ]
    out["flight"]["time_table"] = [[0.0, 0.0, 0.1], [10.0, 1.0, 0.1]]
    out["flight"]["waypoint_u"] = [0]
    return out


def place(folder: Path, source: Path, manifest: dict[str, Any]) -> Path:
    """A scene folder with another scene.json and the same artifacts."""
    folder.mkdir(parents=True)
    for artifact in manifest["artifacts"].values():
        (folder / artifact["file"]).symlink_to(source / artifact["file"])
    (folder / "scene.json").write_text(json.dumps(manifest))
    return folder


def draw(player: Player, folder: Path, *arguments: object) -> tuple[npt.NDArray[np.float32], dict[str, int]]:
    """The picture (90, 160, 3) in 0..1, and the counts of the terrain."""
    out = folder / "picture.png"
    options = ["--size", f"{WIDTH}x{HEIGHT}", "--screenshot", out, "--json", "--debug", "--check-finite"]
    result = player(folder, *options, *arguments)
    assert result.returncode == 0, result.stderr
    pixels = oiio.ImageBuf(str(out)).get_pixels(oiio.FLOAT)[..., :3]
    return np.asarray(pixels), json.loads(result.stdout)["terrain"]


EYES = {
    "above": ((0.5, 40.0, 0.0), (0.0, 0.0, 0.0)),
    "low": ((-8.0, 3.5, 4.0), (20.0, 0.0, 10.0)),
    "at the small hills": ((12.0, 3.0, 11.0), (18.0, 0.0, 20.0)),
    "at the rim": ((29.0, 4.0, -29.0), (0.0, -2.0, 0.0)),
}
FROM_EVERYWHERE = [(eye, "finer") for eye in EYES]


@pytest.mark.parametrize(
    ("eye", "ground"), sweep([("above", "hilly"), *FROM_EVERYWHERE], test=[("above", "hilly")])
)
def test_the_cut_looks_like_the_finest_level_with_fewer_triangles(
    eye: str, ground: str, request: pytest.FixtureRequest, player: Player, tmp_path: Path
) -> None:
    hilly, levels = request.getfixturevalue(ground), {"hilly": FEW_LEVELS, "finer": LEVELS}[ground]
    manifest = pose(json.loads((hilly / "scene.json").read_text()), *EYES[eye])
    cut, counts = draw(player, place(tmp_path / "cut", hilly, manifest))
    finest, most = draw(player, place(tmp_path / "fine", hilly, manifest | {"lod_error_px": 0.01}))
    assert most["cut_patches"] > 0.7 * 2 ** (levels // 2 * 2)
    assert counts["cut_triangles"] < 0.7 * most["cut_triangles"]
    assert counts["patches"] <= counts["cut_patches"]
    assert counts["triangles"] == 16 * counts["patches"]
    assert counts["arrived"] == counts["baked"] == 2 ** (levels + 1) - 2
    worse = np.abs(cut - finest).max(axis=2) > 0.1  # only silhouettes differ, by less than a pixel
    assert worse.mean() < 0.02


GROUND_ALONE = "water,reflection,refraction,shadow,sky,post"


def test_without_maps_the_ground_looks_as_with_maps_that_change_nothing(
    hilly: Path, player: Player, tmp_path: Path
) -> None:
    """A scene without a map of normals, or without an effect map, has a shader without them."""
    manifest = pose(json.loads((hilly / "scene.json").read_text()), *EYES["low"])
    pictures = []
    for i, maps in enumerate(
        (
            {},
            {"sand_normal": "effect_normal"},
            {"effect_color": "box_color"},
            {"effect_color": "box_color", "mix_low_m": 5.0, "mix_high_m": 6.0},
        )
    ):
        edited = manifest | {"terrain": manifest["terrain"] | maps}
        folder = place(tmp_path / str(i), hilly, edited)
        pictures.append(draw(player, folder, "--disable", GROUND_ALONE)[0])
    bare, flat, unseen, seen = pictures
    assert np.abs(bare - flat).max() < 1.5 / 255
    assert (np.abs(bare - unseen).max(axis=2) > 1.5 / 255).mean() < 1e-3  # highlights that rounding moves
    assert (np.abs(bare - seen).max(axis=2) > 10 / 255).mean() > 0.1, "the maps are read"


def test_patches_of_all_tiles_take_one_draw_call_for_each_kind(
    hilly: Path, player: Player, tmp_path: Path
) -> None:
    """Above, at and below the water. None fades: all are split."""
    manifest = pose(json.loads((hilly / "scene.json").read_text()), *EYES["above"])
    diamonds = manifest["terrain"]["diamonds"]
    diamonds["error_m"] = [1000.0] * len(diamonds["error_m"])
    folder = place(tmp_path / "scene", hilly, manifest)
    others = "environment,shadow,reflection,refraction,sky,water,shafts"
    calls = []
    for disabled in (others, others + ",terrain"):
        result = player(
            folder, "--size", "64x36", "--wait-resident", "--frames", 1, "--json", "--disable", disabled
        )
        assert result.returncode == 0, result.stderr
        calls.append(json.loads(result.stdout)["draw_calls"])
    assert 2 <= calls[0] - calls[1] <= 3


@pytest.mark.parametrize("swash_height_m", sweep([0.0, 0.5], test=[0.5]))
def test_the_waterline_and_its_swash_do_not_jump_when_a_diamond_splits(
    swash_height_m: float, hilly: Path, player: Player, tmp_path: Path
) -> None:
    """Few pixels change as its fade begins and as it ends, though many do on the way. The waves that run up
    the shore stand on the patches of both levels alike."""
    eye, target = EYES["low"]
    manifest = pose(json.loads((hilly / "scene.json").read_text()), eye, target)
    manifest["water"] |= {"swash_height_m": swash_height_m, "swash_waves": 2}
    diamonds, flight = manifest["terrain"]["diamonds"], manifest["flight"]
    away_m = np.linalg.norm(np.array(diamonds["center"]) - eye, axis=1) - diamonds["radius_m"]
    pixels_at_1m = HEIGHT / (2.0 * np.tan(flight["fov_rad"] / 2.0))
    errors_px = np.array(diamonds["error_m"]) * pixels_at_1m / np.maximum(flight["near_m"], away_m)
    # As above 1 px few diamonds are left, the largest changes are there.
    largest = np.sort(errors_px[errors_px < 50.0])[-1]
    pictures = []
    for accepted_px in (1.18 * largest, 1.174 * largest, 1.001 * largest, 0.999 * largest):
        edited = manifest | {"lod_error_px": float(accepted_px)}
        folder = place(tmp_path / f"{accepted_px:.6f}", hilly, edited)
        pictures.append(draw(player, folder, "--time", 1.5)[0])
    before, begun, shortly_before, after = pictures
    assert (np.abs(before - begun).max(axis=2) > 5 / 255).sum() < 8
    assert (np.abs(shortly_before - after).max(axis=2) > 5 / 255).sum() < 8
    assert (np.abs(before - after).max(axis=2) > 5 / 255).sum() > 50
    if swash_height_m > 0.0:
        manifest["water"]["swash_height_m"] = 0.0
        edited = manifest | {"lod_error_px": float(0.999 * largest)}
        calm, _ = draw(player, place(tmp_path / "calm", hilly, edited), "--time", 1.5)
        assert (np.abs(calm - after).max(axis=2) > 5 / 255).mean() > 0.02, "no wave runs up in the picture"


def ramp(x: npt.NDArray[np.float64], z: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """An even slope from the floor of the sea to 6 m above it."""
    return np.asarray(0.2 * z + 0.0 * x)


def test_patches_above_at_and_below_the_water_are_lit_as_one_that_reaches_through_it(
    player: Player, tmp_path: Path
) -> None:
    """Each kind has its own shader; all levels of an even slope are the same surface (but for refraction,
    which lifts vertices)."""
    terrain = tiled(SIZE_M, ramp, levels=7, error_m=0.05)
    folder = write_scene(tmp_path / "ramp", terrain=terrain, objects=[], particles=[])
    manifest = json.loads((folder / "scene.json").read_text())
    manifest["terrain"] |= {"mix_low_m": -5.0, "mix_high_m": -4.0, "wet_high_m": 0.6, "wet_darkness": 0.4}
    for name, eye in {"over the sea": (2.0, 8.0, -26.0), "under water": (1.0, -0.6, -9.0)}.items():
        manifest = pose(manifest, eye, (0.0, 0.0, 3.0))
        split = place(tmp_path / name / "split", folder, manifest | {"lod_error_px": 0.01})
        whole = place(tmp_path / name / "whole", folder, manifest | {"lod_error_px": 100.0})
        (many, most), (one, least) = (draw(player, one, "--disable", "water") for one in (split, whole))
        assert (most["cut_patches"], least["cut_patches"]) == (128, 2)
        assert (np.abs(many - one).max(axis=2) > 2 / 255).mean() < 0.002, name


@pytest.mark.parametrize(
    ("eye", "ground"), sweep([("low", "hilly"), *FROM_EVERYWHERE], test=[("low", "hilly")])
)
def test_nothing_that_a_view_sees_is_culled(
    eye: str, ground: str, request: pytest.FixtureRequest, player: Player, tmp_path: Path
) -> None:
    """All views give the same bytes as with bounding spheres that are always visible."""
    hilly = request.getfixturevalue(ground)
    manifest = pose(json.loads((hilly / "scene.json").read_text()), *EYES[eye]) | {"lod_error_px": 0.5}
    culled, counts = draw(player, place(tmp_path / "culled", hilly, manifest))
    patches = manifest["terrain"]["patches"]
    patches["radius_m"] = [1e6] * len(patches["radius_m"])
    whole, all_of_it = draw(player, place(tmp_path / "whole", hilly, manifest))
    assert np.array_equal(culled, whole)
    # Above the water, patches wholly under it are culled by their heights, whatever their spheres.
    assert all_of_it["cut_patches"] == counts["cut_patches"]
    assert all_of_it["patches"] < all_of_it["cut_patches"]
    assert counts["patches"] < (1.0 if eye in ("above", "at the rim") else 0.8) * all_of_it["patches"]


def test_the_sea_mirrors_no_ground_that_lies_below_it(player: Player, tmp_path: Path) -> None:
    """A reef ends 0.3 m below the surface, higher than the mirror image of the eye. Without the refraction
    nothing else of the ground is seen."""
    floor = tiled(SIZE_M, lambda x, z: 5.7 * np.exp(-((z / 3.0) ** 2)) + 0.0 * x, levels=5, refine=4)
    folder = write_scene(tmp_path / "reef", terrain=floor, objects=[], particles=[])
    posed = Posed(folder, player, tmp_path, size=(WIDTH, HEIGHT))
    scene = posed.scene()
    scene["water"] |= {"level_m": 6.0, "reflection_distortion": 0.0}
    mirrors, bare = (
        posed.render((0.0, 7.0, 15.0), (0.0, 6.8, 0.0), scene=scene, disable=f"refraction,post{off}")
        for off in ("", ",terrain")
    )
    assert not differs(mirrors, bare, 2.5 / 255).any()


def rock(x: npt.NDArray[np.float64], z: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """5 m high and 8 m wide, on flat ground, between the vertices of the coarsest patches."""
    return np.asarray(5.0 * np.exp(-((x - 4.0) ** 2 + (z - 4.0) ** 2) / 8.0))


def test_the_ground_casts_shadows_of_the_patches_that_are_drawn_whatever_was_drawn_before(
    player: Player, tmp_path: Path
) -> None:
    """From far away the ground is flat. The map of quality `fast` keeps its place."""
    none = {"water": None, "reflection": None, "refraction": None, "objects": [], "particles": []}
    folder = write_scene(tmp_path / "rock", terrain=tiled(SIZE_M, rock, levels=5, refine=4), **none)
    posed = Posed(folder, player, tmp_path, size=(WIDTH, HEIGHT))
    scene = posed.scene() | {"lod_error_px": 4.0}
    scene["sun"]["direction"] = [0.8, 0.36, 0.48]
    far, near = ((0.0, 400.0, 1.0), (0.0, 0.0, 0.0)), ((-7.0, 7.0, -5.0), (1.0, 0.0, 1.0))
    options: dict[str, Any] = {"scene": scene, "quality": "shadow=fast"}
    _, played = posed.views([far, near], **options)
    alone, unshaded = (posed.render(*near, time_s=1 / 30, **options, disable=off) for off in ("", "shadow"))
    assert differs(alone, unshaded).mean() > 0.02, "the rock casts a shadow"
    assert np.array_equal(played, alone)


def fly_over(
    folder: Path, player: Player, torn: bool, *limits: str, along: bool = False
) -> tuple[list[int], list[dict[str, Any]]]:
    """A low flight over the hills while they arrive, under a sky that is brighter than any ground and has no
    green. Of each frame the pixels that show some of it (a quarter of a pixel, one of its four samples, is
    enough to see); of runs of 1, 2 and all frames the counts of the terrain."""
    terrain = tiled(SIZE_M, hills, levels=LEVELS, refine=8, tiles=3, torn=torn)
    folder = write_scene(folder, terrain=terrain, objects=[], particles=[], water=None, shadow=None)
    # Only the visible sky is bright: terrain is lit by its coarse mips.
    sides = {8: [500.0, 0.0, 500.0, 1.0], 4: [0.3, 0.5, 0.9, 1.0], 2: [0.3, 0.5, 0.9, 1.0]}
    sides[1] = sides[2]
    levels = tuple(np.full((6, n, n, 4), v, dtype=np.float16).tobytes() for n, v in sides.items())
    glare = encode_ktx2(Texture("RGBA16F", 8, 8, levels, 6))
    (folder / "sky.ktx2").write_bytes(glare)
    manifest = json.loads((folder / "scene.json").read_text())
    manifest |= {"lod_error_px": 0.5, "reflection": None, "refraction": None, "fog": None}
    manifest["artifacts"]["sky"] |= identity(glare)
    still = [0.0, 0.0, 0.0]
    manifest["flight"] |= {
        "fov_rad": 0.6,
        "duration_s": FLIGHT / 30,
        "segments": [
            {
                "eye": [[-12.0, 24.0, 0.0, 0.0], [6.0, 18.0, 0.0, 0.0], [-9.0, 14.0, 0.0, 0.0]],
                "target": [[-7.0, 14.0, 0.0, 0.0], [0.0, *still], [-4.0, 8.0, 0.0, 0.0]],
                "roll": [0.0, 1.0, 0.0, 0.0],
            }
        ],
        "time_table": [[0.0, 0.0, 30.0 / FLIGHT], [FLIGHT / 30, 1.0, 30.0 / FLIGHT]],
        "waypoint_u": [0],
    }
    (folder / "scene.json").write_text(json.dumps(manifest))
    if along:  # close to the ground from rim to rim, so that other patches are needed all the time
        manifest["lod_error_px"] = 8.0
        segment = manifest["flight"]["segments"][0]
        segment["eye"][:2] = [[-20.0, 24.0, 0.0, 0.0], [6.0, *still]]
        segment["target"][0] = [-15.0, 24.0, 0.0, 0.0]
        (folder / "scene.json").write_text(json.dumps(manifest))
    arguments = ["--size", FLIGHT_SIZE, "--json", "--debug", *limits]
    counts = []
    for frames in (1, 2, FLIGHT):
        result = player(folder, "--frames", frames, "--screenshot", folder / "f.png", *arguments)
        assert result.returncode == 0, result.stderr
        report = json.loads(result.stdout)
        counts.append(report["terrain"] | report["streaming"])
    glaring = []
    for frame in range(FLIGHT):
        pixels = oiio.ImageBuf(str(folder / f"f_{frame:04d}.png")).get_pixels(oiio.FLOAT)
        glaring.append(int((pixels[..., 2] > pixels[..., 1] + 0.1).sum()))
    return glaring, counts


@pytest.mark.deep
def test_no_crack_opens_in_flight_while_tiles_stream_in(player: Player, tmp_path: Path) -> None:
    """No sample of the sky shows through the terrain. Patches that are a thousandth too narrow (gaps of a
    fortieth of a pixel) show that the test would find one."""
    glaring, counts = fly_over(tmp_path / "whole", player, torn=False)
    assert glaring == [0] * FLIGHT
    assert counts[0]["arrived"] < counts[1]["arrived"] < counts[2]["arrived"] == counts[2]["baked"]
    assert len({count["cut_patches"] for count in counts}) == 3
    torn, _ = fly_over(tmp_path / "torn", player, torn=True)
    assert min(torn) > 0


@pytest.mark.deep
def test_no_crack_opens_in_flight_while_patches_are_evicted(player: Player, tmp_path: Path) -> None:
    glaring, counts = fly_over(tmp_path / "limited", player, False, "--vram", "3", along=True)
    assert glaring == [0] * FLIGHT
    assert counts[2]["evictions"] > 0
    assert counts[2]["arrived"] < 0.5 * counts[2]["baked"]
    assert counts[2]["peak_bytes"] <= 3.3e6


@pytest.mark.deep
def test_a_quantised_terrain_is_drawn_like_floats_in_every_view(player: Player, tmp_path: Path) -> None:
    """Picture, mirror, refraction and shadow of the same patches: with codes a surface moves by no more than
    the grid says, so that pictures differ where an edge crosses a pixel, and there by little."""
    steps = 64
    grid = terrain_grid((steps + 1, steps + 1), (SIZE_M, SIZE_M), (-3.2, 3.2))
    assert grid.step[1] < 0.001  # heights err by up to half a step, metres; x and z fall on the grid
    kinds = {"floats": None, "codes": grid}
    pictures: dict[str, list[npt.NDArray[np.float32]]] = {}
    for name, kind in kinds.items():
        terrain = tiled(SIZE_M, hills, levels=LEVELS, refine=4, tiles=3, grid=kind)
        folder = write_scene(tmp_path / name, terrain=terrain, objects=[], particles=[])
        manifest = json.loads((folder / "scene.json").read_text())
        manifest["terrain"] |= {"mix_low_m": -5.0, "mix_high_m": -4.0}
        manifest["sun"]["direction"] = [0.9903, 0.139, 0.0]  # a low sun, so that hills cast shadows
        manifest["shadow"]["extent_m"] = 80.0
        shots = []
        for key, eye in EYES.items():
            shots.append(draw(player, place(tmp_path / f"{name} {key}", folder, pose(manifest, *eye)))[0])
        low = pose(manifest, *EYES["low"]) | {"shadow": None}
        shots.append(draw(player, place(tmp_path / f"{name} unshaded", folder, low))[0])
        low = pose(manifest, *EYES["low"]) | {"reflection": None, "refraction": None}
        shots.append(draw(player, place(tmp_path / f"{name} dull", folder, low))[0])
        pictures[name] = shots
    low_shot = list(EYES).index("low")
    for other in pictures["floats"][len(EYES) :]:  # shadows, reflection and refraction are visible
        assert (np.abs(pictures["floats"][low_shot] - other).max(axis=2) > 0.05).mean() > 0.002
    for floats, codes in zip(pictures["floats"], pictures["codes"], strict=True):
        off = np.abs(floats - codes).max(axis=2)
        assert off.mean() < 0.05 / 255
        assert (off > 4 / 255).mean() < 0.001


def test_terrain_in_no_view_is_loaded_after_what_is_seen_and_does_not_count_as_needed(
    player: Player, tmp_path: Path
) -> None:
    """The eye looks out over a corner."""
    terrain = tiled(SIZE_M, levels=7, refine=8, error_m=2.0)
    folder = write_scene(
        tmp_path / "flat", terrain=terrain, objects=[], particles=[], water=None, shadow=None
    )
    manifest = pose(json.loads((folder / "scene.json").read_text()), (15.0, 2.0, 15.0), (20.0, 2.0, 20.0))
    manifest |= {"reflection": None, "refraction": None, "lod_error_px": 0.5}
    scene = place(tmp_path / "scene", folder, manifest)
    pictures = []
    for vram_mb in (50, 2):
        picture = tmp_path / f"{vram_mb}.png"
        result = player(scene, "--vram", vram_mb, "--size", "96x54", "--json", "--screenshot", picture)
        report = json.loads(result.stdout)
        assert report["streaming"]["worst_error"] == 0.0
        if vram_mb == 50:
            assert report["resident_bytes"] > 2.3e6  # where there is room, the rest is loaded too
            assert report["streaming"]["needed_bytes"] < 0.75 * report["resident_bytes"]
        pictures.append(picture.read_bytes())
    assert pictures[0] == pictures[1]


@pytest.mark.parametrize(
    ("left_out", "size", "times"),
    sweep(
        [(7, "96x55", 1), (7, "200x54", 1), (7, "90x50", 0), (0, "96x55", 0)],
        test=[(7, "96x55", 1), (7, "90x50", 0)],
    ),
)
def test_a_window_larger_than_the_bake_covers_gives_one_warning(
    left_out: int, size: str, times: int, hilly: Path, player: Player, tmp_path: Path
) -> None:
    manifest = json.loads((hilly / "scene.json").read_text())
    manifest["terrain"]["demand"]["left_out"] = left_out
    scene = place(tmp_path / "left_out", hilly, manifest)
    result = player(scene, "--size", size, "--frames", 3)
    assert result.returncode == 0, result.stderr
    assert result.stderr.count("the scene was baked for at most 96 x 54") == times, result.stderr


def test_a_tile_that_differs_from_scene_json_is_rejected_by_name(
    hilly: Path, player: Player, tmp_path: Path
) -> None:
    manifest = json.loads((hilly / "scene.json").read_text())
    manifest["terrain"]["tiles"] = ["terrain_mesh_1", "terrain_mesh", "terrain_mesh_2"]
    result = player(place(tmp_path / "swapped", hilly, manifest))
    assert result.returncode == 1
    assert "terrain_mesh.glb: node patch0: scene.json says that it is patch85" in result.stderr
    manifest["terrain"]["tiles"] = ["terrain_mesh", "terrain_mesh_1", "sky"]
    result = player(place(tmp_path / "sky", hilly, manifest))
    assert result.returncode == 1
    assert 'terrain.tiles[2]: names "sky", which is not an artifact of the right kind' in result.stderr

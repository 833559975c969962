"""Scenes larger than the limit of device memory: what is kept, what is loaded, what is told."""

from __future__ import annotations

import json
import resource
import subprocess
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.pictures import load
from tests.player.boxes import row_of_boxes
from tests.player.synthetic import texture
from tests.sweeps import sweep

Player = Callable[..., "subprocess.CompletedProcess[str]"]
BOXES = 6
EDGE = 512
LITTLE = ["--ram", 1, "--vram", 4]
MAP_BYTES = EDGE * EDGE * 4 * 4 // 3


def six_boxes(folder: Path, *, unused: int = 0) -> Path:
    """Boxes 30 m apart, and a flight past them in six seconds. `unused`: cube maps that nothing refers to."""
    random = np.random.default_rng(5)
    maps = []
    for _ in range(BOXES):
        pixels = random.integers(0, 255, (EDGE, EDGE, 4), dtype=np.uint8)
        pixels[..., 3] = 255
        maps.append(texture("RGBA8_SRGB", pixels))
    cube = texture("RGBA16F", np.ones((6, 256, 256, 4), np.float16))
    return row_of_boxes(folder, maps, spacing_m=30.0, seconds=6.0, unused=[cube] * unused)


def report(result: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    assert result.returncode == 0, result.stderr
    out: dict[str, Any] = json.loads(result.stdout)
    return out


def test_a_scene_above_the_limit_plays_within_it_and_looks_the_same(player: Player, tmp_path: Path) -> None:
    scene = six_boxes(tmp_path / "scene")
    assert BOXES * MAP_BYTES > 8e6
    # Five seconds and a half of the flight. Each box is passed with the finest mip of its map.
    played = player(scene, "--frames", 165, "--vram", 4, "--disable", "post", "--json", "--debug")
    assert "cannot hold" not in played.stderr
    result = report(played)
    assert result["total_bytes"] > 8e6
    streaming = result["streaming"]
    assert streaming["peak_bytes"] <= 4.4e6
    assert streaming["evictions"] >= BOXES // 2
    assert streaming["worst_error"] == 0.0
    # A picture between the boxes' passing, with and without the limit.
    whole, limited = tmp_path / "whole.png", tmp_path / "limited.png"
    for second in (0.0, 2.4, 4.8):
        report(player(scene, "--time", second, "--screenshot", whole, "--json"))
        report(player(scene, "--time", second, "--screenshot", limited, "--vram", 4, "--json"))
        assert whole.read_bytes() == limited.read_bytes()
    # The scene's own limit counts where the command line names none.
    manifest = json.loads((scene / "scene.json").read_text())
    (scene / "scene.json").write_text(json.dumps(manifest | {"vram_mb": 1}))
    assert report(player(scene, "--wait-resident", "--json"))["streaming"]["worst_error"] > 1.0
    more = report(player(scene, "--wait-resident", "--json", "--vram", 4))
    assert more["streaming"]["worst_error"] == 0.0
    refused = player(scene, "--order", "file")
    assert refused.returncode == 1
    assert "scene.json: vram_mb: is 1: --order file uploads everything" in refused.stderr


def test_a_scene_of_more_files_than_a_process_may_have_open_plays_beyond_ram(
    player: Player, tmp_path: Path
) -> None:
    random = np.random.default_rng(6)
    maps = [texture("RGBA8_SRGB", random.integers(0, 255, (64, 64, 4), dtype=np.uint8)) for _ in range(100)]
    scene = row_of_boxes(tmp_path / "scene", maps, spacing_m=0.5, seconds=6.0)
    shots = ("--ram", 1, "--vram", 4, "--json", "--screenshot")
    report(player(scene, *shots, tmp_path / "many.png"))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (80, hard))
    try:
        played = player(scene, *shots, tmp_path / "few.png")
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    report(played)
    assert (tmp_path / "few.png").read_bytes() == (tmp_path / "many.png").read_bytes()


def test_the_second_that_playback_starts_at_is_loaded_first(player: Player, tmp_path: Path) -> None:
    scene = six_boxes(tmp_path / "scene")
    picture, first = tmp_path / "picture.png", tmp_path / "first.png"
    for second in (0.0, 4.8):
        report(player(scene, "--time", second, "--screenshot", picture, "--json"))
        report(player(scene, "--time", second, "--frames", 1, "--screenshot", first, "--json"))
        assert picture.read_bytes() == (tmp_path / "first_0000.png").read_bytes()


def test_what_nothing_refers_to_takes_no_device_memory(player: Player, tmp_path: Path) -> None:
    plain = report(player(six_boxes(tmp_path / "plain"), "--wait-resident", "--json"))
    more = report(player(six_boxes(tmp_path / "more", unused=20), "--wait-resident", "--json"))
    assert more["resident_bytes"] == more["total_bytes"] == plain["total_bytes"]
    assert more["streaming"]["peak_bytes"] == plain["streaming"]["peak_bytes"]


def test_an_impossible_limit_shows_something_of_everything_and_says_what_is_missing(
    player: Player, tmp_path: Path
) -> None:
    scene = six_boxes(tmp_path / "scene")
    played = player(scene, "--wait-resident", "--json", "--vram", 1, "--check-finite", "--frames", 3)
    assert played.stderr.count("--vram: 1 MB of device memory cannot hold the") == 1
    result = report(played)
    assert result["streaming"]["worst_error"] > 1.0
    assert result["resident_bytes"] <= 1e6
    assert result["streaming"]["needed_bytes"] > 1e6


def test_holes_are_as_fine_as_their_shadow_however_far_the_eye_is(player: Player, tmp_path: Path) -> None:
    scene = six_boxes(tmp_path / "scene")
    manifest = json.loads((scene / "scene.json").read_text())
    manifest["flight"] |= {"fov_rad": 0.9}
    for segment in manifest["flight"]["segments"]:
        segment["eye"][2] = [4.0, 0.0, 0.0, 0.0]
    shadow = {"size": 2048, "extent_m": 20.0, "center": [0.0, 0.0, 0.0], "blur_distance_m": 50.0}

    def needed(mode: str, *arguments: str, shadow: dict[str, Any] | None = shadow) -> int:
        for item in manifest["objects"]:
            for one in item["materials"].values():
                one["alpha_mode"] = mode
        (scene / "scene.json").write_text(json.dumps(manifest | {"shadow": shadow}))
        result = report(player(scene, "--wait-resident", "--vram", 50, "--json", *arguments))
        bytes_: int = result["streaming"]["needed_bytes"]
        return bytes_

    solid = needed("opaque")
    assert solid == needed("mask", shadow=None)
    whole = needed("mask", "--quality", "shadow=fast")  # half the map's size, one cascade
    finer = needed("blend")
    assert solid < whole < finer
    assert finer >= MAP_BYTES  # all mips of the box in the finer cascades


@pytest.mark.parametrize("option", ["--vram", "--ram"])
def test_limits_are_megabytes(player: Player, tmp_path: Path, option: str) -> None:
    result = player(tmp_path, option, "lots")
    assert result.returncode == 2
    assert f"{option} lots: must be megabytes, 1 to 1e9" in result.stderr


def test_little_memory_for_files_gives_the_same_picture(player: Player, tmp_path: Path) -> None:
    scene = six_boxes(tmp_path / "scene")
    pictures = []
    for name, limits in (("plenty", []), ("little", ["--ram", 1]), ("both", ["--ram", 1, "--vram", 4])):
        path = tmp_path / f"{name}.png"
        report(player(scene, "--time", 2.4, "--screenshot", path, "--json", *limits))
        pictures.append(load(path))
    assert np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(pictures[0], pictures[2])


@pytest.mark.parametrize("limits", sweep([[], ["--ram", 1], LITTLE], test=[LITTLE]))
def test_pictures_are_those_of_a_driver_without_buffers_that_stay_mapped(
    player: Player, tmp_path: Path, limits: list[object]
) -> None:
    """In every frame, while boxes come and go, and in as many uploads."""
    scene = six_boxes(tmp_path / "scene")
    flight = (scene, "--size", "64x36", "--frames", 160, "--disable", "post", "--json", "--debug", *limits)
    without = {"MESA_EXTENSION_OVERRIDE": "-GL_ARB_buffer_storage"}
    mapped = report(player(*flight, "--screenshot", tmp_path / "mapped.png"))["streaming"]
    plain = report(player(*flight, "--screenshot", tmp_path / "plain.png", env=without))["streaming"]
    assert mapped["uploads"] == plain["uploads"] and mapped["evictions"] == plain["evictions"]
    assert (mapped["evictions"] > 0) == ("--vram" in limits)
    for frame in range(160):
        ours, other = (load(tmp_path / f"{name}_{frame:04d}.png") for name in ("mapped", "plain"))
        assert np.array_equal(ours, other), frame


def test_json_tells_how_the_error_falls_while_the_scene_streams(player: Player, tmp_path: Path) -> None:
    scene = six_boxes(tmp_path / "scene")
    errors = {}
    for order in ("needs", "file"):
        output = report(player(scene, "--time", 4.8, "--frames", 4, "--order", order, "--json"))
        streaming = output["streaming"]
        frames = streaming["frames"]
        assert len(frames) == 4
        assert all(a[0] < b[0] for a, b in pairwise(frames))
        assert streaming["first_frame_s"] == frames[0][0] > 0.0
        assert streaming["uploaded_bytes"] == output["resident_bytes"]
        assert streaming["uploads"] > BOXES
        assert streaming["read_mb_s"] > 0.0
        uploaded = [b[3] - a[3] for a, b in pairwise([[0, 0, 0, 0], *frames])]
        assert sum(uploaded) == streaming["uploaded_bytes"]
        assert (
            max(uploaded[order == "needs" :]) <= 4 << 20
        )  # the first frame may upload more of what shows much
        assert uploaded[0] <= 16 << 20
        errors[order] = [error for _, error, *_ in frames]
        assert all(0.0 < stream_ms < 1e3 for _, _, stream_ms, _ in frames)
    # The last box stands before the camera. Its map is the last of scene.json.
    assert errors["needs"][0] == 0.0
    assert errors["file"][0] > 1.0
    assert errors["file"][-1] == 0.0
    result = player(scene, "--order", "size")
    assert result.returncode == 2
    assert "--order size: must be needs or file" in result.stderr


def test_checking_goes_on_after_the_picture_and_a_damaged_file_elsewhere_is_told(
    player: Player, tmp_path: Path
) -> None:
    scene = six_boxes(tmp_path / "scene")
    far = scene / f"color{BOXES - 1}.ktx2"
    data = bytearray(far.read_bytes())
    data[-1] ^= 1
    far.write_bytes(data)
    shot = tmp_path / "shot.png"
    result = player(scene, "--frames", 1, "--vram", 4, "--screenshot", shot)
    assert result.returncode == 1
    assert f"{far.name}: is damaged or was replaced" in result.stderr
    assert (tmp_path / "shot_0000.png").is_file()  # it needs other files only


def plain_objects(island: Path, folder: Path) -> Path:
    """The island's objects in the light of its poster, without the rest and its shaders, which take seconds.
    Its files are the island's own: those that were written just now are checked each time."""
    manifest = json.loads((island / "scene.json").read_text())
    for part in (manifest, *manifest["objects"]):
        for name in ("lights", "light_sets", "light_shafts"):
            part.pop(name, None)
    used = [name for name in manifest["streaming"] if not name.startswith("terrain_mesh")]
    manifest |= {"streaming": used, "artifacts": {name: manifest["artifacts"][name] for name in sorted(used)}}
    folder.mkdir()
    for artifact in manifest["artifacts"].values():
        (folder / artifact["file"]).symlink_to((island / artifact["file"]).resolve())
    none = dict.fromkeys(("terrain", "water", "shadow", "reflection", "refraction", "daytime"))
    (folder / "scene.json").write_text(json.dumps(manifest | none | {"particles": []}))
    return folder


@pytest.mark.parametrize("limits", sweep([[], ["--vram", 20]], test=[[]]))
def test_a_second_start_draws_the_frames_of_the_first(
    player: Player, island: Path, tmp_path: Path, limits: list[object]
) -> None:
    """Of files that the first has checked, the second reads pieces as they are needed. Under the limit a view
    of the objects alone is complete too early."""
    record = {"PARADIZE_CHECKED": str(tmp_path / "checked")}
    scene = island if limits else plain_objects(island, tmp_path / "scene")
    flight = [scene, "--time", 60, "--size", "64x36", "--frames", 5, *limits, "--json"]
    flight += ["--disable", "sky,shadow,reflection,refraction,water,shafts,post"]
    rows = []
    for name in ("first.png", "second.png"):
        result = report(player(*flight, "--screenshot", tmp_path / name, env=record))
        rows.append([(error, total) for _, error, _, total in result["streaming"]["frames"]])
        records = sorted((tmp_path / "checked").iterdir())
        assert len(records) == 1 and "paradize-player" in records[0].read_text()
    assert rows[0] == rows[1] and len({total for _, total in rows[0]}) > 2
    for frame in range(5):
        first, second = (tmp_path / f"{name}_{frame:04d}.png" for name in ("first", "second"))
        assert first.read_bytes() == second.read_bytes()

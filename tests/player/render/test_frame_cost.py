"""The cost of a frame: no allocation, and no more uploaded bytes than the budget."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.pictures import load
from tests.player.conftest import Counted
from tests.player.passes.test_point_lights import lamp
from tests.player.patches import tiled
from tests.player.streaming.test_streaming import six_boxes
from tests.player.synthetic import checker, identity, instance, texture, write_scene
from tests.sweeps import sweep

Player = Callable[..., "subprocess.CompletedProcess[str]"]
BUDGET_BYTES = 4 << 20
FIRST_BYTES = 16 << 20  # of what shows most


@pytest.mark.parametrize("arguments", sweep([[], ["--vram", "50"]], test=[["--vram", "50"]]), ids=" ".join)
def test_frames_of_every_pass_allocate_nothing(
    counted: Counted, tmp_path: Path, arguments: list[str]
) -> None:
    """Under a limit of device memory each frame plans anew. Each picture is larger than the bake allows."""
    scene = write_scene(tmp_path / "scene")
    manifest = json.loads((scene / "scene.json").read_text())
    manifest["artifacts"]["sky"]["required_detail"] = {"left_out": 1}
    (scene / "scene.json").write_text(json.dumps(manifest | {"largest_viewport": [16, 16]}))

    def allocations(frames: int, *options: str) -> int:
        return counted(scene, "--size", "48x27", "--frames", frames, "--wait-resident", *options)[1]

    many = allocations(26, *arguments)
    assert many > 100  # the counter works: loading allocates,
    assert allocations(6, *arguments) == many  # twenty more frames, no more allocations
    if not arguments:
        assert allocations(16, "--check-finite") >= many + 16  # and so does the check of each picture


def plain(folder: Path, seconds: float) -> Path:
    """A flat terrain of 2 MB, and a flight close above it from rim to rim."""
    terrain = tiled(60.0, levels=8, refine=8, error_m=1.0)
    scene = write_scene(folder, terrain=terrain, objects=[], particles=[], water=None, shadow=None)
    manifest = json.loads((scene / "scene.json").read_text())
    manifest |= {"reflection": None, "refraction": None, "lod_error_px": 4.0}
    manifest["flight"] |= {
        "duration_s": seconds,
        "segments": [
            {
                "eye": [[-30.0, 60.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [-12.0, 24.0, 0.0, 0.0]],
                "target": [[-25.0, 60.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [-10.0, 24.0, 0.0, 0.0]],
                "roll": [0.0, 0.0, 0.0, 0.0],
            }
        ],
        "time_table": [[0.0, 0.0, 1.0 / seconds], [seconds, 1.0, 1.0 / seconds]],
        "waypoint_u": [0],
    }
    (scene / "scene.json").write_text(json.dumps(manifest))
    return scene


@pytest.mark.parametrize("what", sweep(["maps", "patches"], test=["maps"]))
def test_frames_allocate_nothing_while_what_they_need_comes_and_goes(
    what: str, counted: Counted, player: Player, tmp_path: Path
) -> None:
    """Frames after the first second of a flight, on which a limit of device memory evicts. Without --json in
    the counted runs, because its text is longer for more frames."""
    scene = six_boxes(tmp_path / "boxes") if what == "maps" else plain(tmp_path / "plain", seconds=4.0)
    frames = 110
    vram_mb = 4 if what == "maps" else 2.7  # too little from second 0.8 on, which gives a message
    flight = ("--vram", vram_mb, "--disable", "post")
    assert counted(scene, *flight, "--frames", frames)[1] == counted(scene, *flight, "--frames", 30)[1]
    early, late = (
        json.loads(player(scene, *flight, "--frames", count, "--json").stdout)["streaming"]["evictions"]
        for count in (30, frames)
    )
    assert late - early >= 3


def large_scene(folder: Path) -> Path:
    """A scene whose colour map (21 MiB with mips) takes several frames to upload."""
    scene = write_scene(folder, bare=True)
    data = texture(
        "RGBA8_SRGB", np.kron(checker((200, 60, 40), (240, 220, 200)), np.ones((32, 32, 1), np.uint8))
    )
    (scene / "box_color.ktx2").write_bytes(data)
    manifest = json.loads((scene / "scene.json").read_text())
    manifest["artifacts"]["box_color"] |= identity(data)
    (scene / "scene.json").write_text(json.dumps(manifest))
    return scene


def test_streaming_keeps_to_its_budget_and_ends_with_the_same_picture(player: Player, tmp_path: Path) -> None:
    scene = large_scene(tmp_path / "scene")
    for frames in (1, 2, 8):
        result = player(scene, "--frames", frames, "--json")
        assert result.returncode == 0, result.stderr
        report = json.loads(result.stdout)
        assert 0 < report["resident_bytes"] <= FIRST_BYTES + (frames - 1) * BUDGET_BYTES
        assert (report["resident_bytes"] == report["total_bytes"]) == (frames == 8)
    # Numbered pictures show the streaming. The last one equals a picture with all data resident.
    close = json.loads((scene / "scene.json").read_text())
    close["flight"] |= {"fov_rad": 0.005}
    (scene / "scene.json").write_text(json.dumps(close))
    for order, more in (("needs", True), ("file", False)):
        report = json.loads(player(scene, "--frames", 1, "--order", order, "--json").stdout)
        assert (report["resident_bytes"] > BUDGET_BYTES) is more
    for name, waiting in (("whole.png", ["--wait-resident"]), ("stream.png", [])):
        arguments = [scene, "--frames", 8, "--size", "160x90", *waiting]
        result = player(*arguments, "--screenshot", tmp_path / name, "--debug")
        assert result.returncode == 0, result.stderr

    def picture(name: str) -> bytes:
        return (tmp_path / name).read_bytes()

    assert picture("stream_0000.png") != picture("whole_0000.png")
    assert picture("stream_0007.png") == picture("whole_0007.png")


def test_a_lit_crowd_takes_few_draw_calls_and_more_where_they_are_not_joined_for_the_same_picture(
    player: Player, tmp_path: Path
) -> None:
    """Three objects of two levels and two materials each, in three sets of lights. Five frames: in the first
    all is drawn, with the shadow map's cascades."""
    scene = write_scene(tmp_path / "scene")
    manifest = json.loads((scene / "scene.json").read_text())
    spots = np.linspace(-28.0, 28.0, 12)
    stands = [
        instance([float(x), 0.0, float(z)], float(x * z), 0.05 + 0.2 * (i % 3))
        for i, (x, z) in enumerate((x, z) for x in spots for z in spots)
    ]
    manifest["lights"] = [lamp([0.0, 2.0, 0.0]), lamp([4.0, 2.0, -4.0])]
    manifest["light_sets"] = [{"lights": lights, "glow": None} for lights in ([], [0], [0, 1])]
    box = manifest["objects"][0]
    box["lods"][1]["error_m"] = 1.0  # so that both levels are seen
    manifest["objects"] = [
        box
        | {
            "name": f"box{k}",
            "instances": stands[k::3],
            "light_sets": [i % 3 for i in range(len(stands[k::3]))],
        }
        for k in range(3)
    ]
    (scene / "scene.json").write_text(json.dumps(manifest))
    most = {}
    for name, env in (("joined", {}), ("single", {"MESA_EXTENSION_OVERRIDE": "-GL_ARB_multi_draw_indirect"})):
        arguments = ["--frames", 5, "--wait-resident", "--json", "--screenshot", tmp_path / f"{name}.png"]
        result = player(scene, *arguments, env=env)
        assert result.returncode == 0, result.stderr
        most[name] = json.loads(result.stdout)["most_draw_calls"]
    assert most["joined"] <= 30 and most["single"] > 40, most
    for i in range(5):
        joined, single = (load(tmp_path / f"{name}_{i:04}.png") for name in most)
        assert np.array_equal(joined, single), i
    assert joined.std() > 0.05


@pytest.mark.deep
def test_two_thousand_instances_take_as_many_draw_calls_as_a_few_and_allocate_nothing(
    counted: Counted, tmp_path: Path
) -> None:
    def crowd(side: int) -> Path:
        scene = write_scene(tmp_path / f"scene_{side}")
        manifest = json.loads((scene / "scene.json").read_text())
        spots = np.linspace(-28.0, 28.0, side)
        manifest["objects"][0]["instances"] = [
            instance([float(x), 0.0, float(z)], float(x * z), 0.05 + 0.2 * (i % 3))
            for i, (x, z) in enumerate((x, z) for x in spots for z in spots)
        ]
        (scene / "scene.json").write_text(json.dumps(manifest))
        return scene

    def run(scene: Path, frames: int) -> tuple[int, int]:
        result, allocations = counted(scene, "--frames", frames, "--wait-resident", "--json")
        return json.loads(result.stdout)["draw_calls"], allocations

    few, _ = run(crowd(4), 2)
    many = crowd(45)
    later, as_many = run(many, 12)
    calls, allocations = run(many, 2)
    # Two levels of detail and two materials, in three views and the shadow map's cascades, which are drawn
    # when they move.
    assert calls <= few + 2 * 2 * (3 + 2)
    assert later <= few + 2 * 2 * (3 + 2)
    assert as_many == allocations

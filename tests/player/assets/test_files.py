"""Only files as the bake wrote them are drawn. Damaged, replaced and shrinking files are rejected."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from paradize.build.bake import bake
from tests.conftest import ROOT
from tests.pipeline.kept_workers import keeping_workers
from tests.player.panel import make_panel
from tests.player.synthetic import checker, identity, sound, texture, write_scene
from tests.sweeps import sweep

Player = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def shrink(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shared library that truncates a file while it is read."""
    compiler = shutil.which("g++") or shutil.which("c++")
    assert compiler, "no C++ compiler"
    library = tmp_path_factory.mktemp("shrink") / "shrink.so"
    source = ROOT / "tests/player/preload/shrink.cpp"
    subprocess.run([compiler, "-std=c++17", "-shared", "-fPIC", "-O1", source, "-o", library], check=True)
    return library


def noisy_scene(folder: Path) -> Path:
    """A scene whose colour map of 5.6 MB is read in several parts and uploaded over two frames."""
    scene = write_scene(folder, bare=True)
    rows = np.kron(checker((200, 60, 40), (240, 220, 200)), np.ones((16, 16, 1), np.uint8))
    data = texture("RGBA8_SRGB", rows)
    (scene / "box_color.ktx2").write_bytes(data)
    manifest = json.loads((scene / "scene.json").read_text())
    manifest["artifacts"]["box_color"] |= identity(data)
    (scene / "scene.json").write_text(json.dumps(manifest))
    return scene


def refused(result: subprocess.CompletedProcess[str], *parts: str) -> None:
    assert result.returncode == 1, (result.returncode, result.stderr)
    assert result.stderr.count("\n") == 1, "one message"
    for part in parts:
        assert part in result.stderr


@pytest.mark.parametrize(
    ("moment", "part"),
    [
        ("open", "has {half} bytes, scene.json says {whole}; bake the scene again"),
        ("stat", "ended at byte {half} of {whole} while it was read; bake the scene again"),
        ("read", "ended at byte {half} of {whole} while it was read; bake the scene again"),
    ],
)
def test_a_file_that_shrinks_before_it_is_read_is_rejected_with_the_offset(
    player: Player, shrink: Path, tmp_path: Path, moment: str, part: str
) -> None:
    scene = noisy_scene(tmp_path / "scene")
    file = scene / "box_color.ktx2"
    whole = file.stat().st_size
    cut = {"LD_PRELOAD": str(shrink), "PARADIZE_SHRINK_AT": moment, "PARADIZE_SHRINK_FILE": str(file)}
    result = player(scene, "--size", "16x16", "--frames", 4, env=cut)
    refused(result, "box_color.ktx2: " + part.format(half=whole // 2, whole=whole))


def test_a_file_that_shrinks_after_it_is_read_changes_nothing(
    player: Player, shrink: Path, tmp_path: Path
) -> None:
    scene = noisy_scene(tmp_path / "scene")
    shots = ("--size", "64x36", "--frames", 4, "--debug", "--screenshot")
    assert player(scene, *shots, tmp_path / "whole.png").returncode == 0
    file = scene / "box_color.ktx2"
    whole = file.stat().st_size
    cut = {"LD_PRELOAD": str(shrink), "PARADIZE_SHRINK_AT": "close", "PARADIZE_SHRINK_FILE": str(file)}
    result = player(scene, *shots, tmp_path / "cut.png", env=cut)
    assert result.returncode == 0, result.stderr
    assert file.stat().st_size == whole // 2
    for frame in range(4):
        assert (tmp_path / f"cut_000{frame}.png").read_bytes() == (
            tmp_path / f"whole_000{frame}.png"
        ).read_bytes()


@pytest.mark.parametrize("at", [0, 80, -1])
def test_one_wrong_bit_anywhere_is_reported_with_both_hashes_and_the_remedy(
    player: Player, tmp_path: Path, at: int
) -> None:
    scene = write_scene(tmp_path / "scene", bare=True)
    for path in sorted(scene.glob("*.[gk]*")):
        whole = path.read_bytes()
        damaged = bytearray(whole)
        damaged[at] ^= 1
        path.write_bytes(damaged)
        found = f"its SHA-256 is {identity(bytes(damaged))['sha256'][:12]}..., "
        expected = f"scene.json says {identity(whole)['sha256'][:12]}...; "
        refused(
            player(scene), f"{path.name}: is damaged or was replaced: ", found + expected, "paradize bake"
        )
        path.write_bytes(whole)


def test_a_file_that_no_bake_wrote_is_refused_with_the_remedy(player: Player, tmp_path: Path) -> None:
    """Its hash is that of scene.json: the fault is found by what reads it."""
    scene = write_scene(tmp_path / "scene", bare=True)
    manifest = json.loads((scene / "scene.json").read_text())
    color, mesh = ((scene / name).read_bytes() for name in ("box_color.ktx2", "box_mesh.glb"))
    infinite = np.full((64, 64, 4), np.inf, np.float16)
    for name, data, said in (
        ("box_color", color[:12] + b"\x8f" + color[13:], "vkFormat 143 is not among"),
        ("box_color", color[:-1], "level 0: 16384 bytes from byte "),
        ("box_color", texture("RGBA16F", infinite), "level 0, texel "),
        ("box_mesh", mesh[:4] + b"\x03" + mesh[5:], "header: version 3, must be 2"),
    ):
        artifact = manifest["artifacts"][name]
        (scene / artifact["file"]).write_bytes(data)
        changed = manifest | {"artifacts": manifest["artifacts"] | {name: artifact | identity(data)}}
        (scene / "scene.json").write_text(json.dumps(changed))
        refused(
            player(scene), f"{artifact['file']}: ", said, "; bake the scene again: paradize bake SCENE.toml\n"
        )
        (scene / artifact["file"]).write_bytes(color if name == "box_color" else mesh)


def test_the_first_damaged_file_in_streaming_order_is_reported_whatever_the_threads_do(
    player: Player, tmp_path: Path
) -> None:
    scene = write_scene(tmp_path / "scene")
    manifest = json.loads((scene / "scene.json").read_text())
    for entry in manifest["artifacts"].values():
        path = scene / entry["file"]
        path.write_bytes(path.read_bytes()[:-1] + b"?")
    for first in manifest["streaming"][::3]:
        manifest["streaming"] = [first]
        (scene / "scene.json").write_text(json.dumps(manifest))
        refused(player(scene), manifest["artifacts"][first]["file"])


@pytest.mark.parametrize("value", ["", "0" * 63, "0" * 65, "A" * 64, "g" * 64, None])
def test_an_artifact_without_a_hash_is_rejected(player: Player, tmp_path: Path, value: str | None) -> None:
    scene = write_scene(tmp_path / "scene", bare=True)
    manifest = json.loads((scene / "scene.json").read_text())
    manifest["artifacts"]["box_mesh"]["sha256"] = value
    (scene / "scene.json").write_text(json.dumps(manifest))
    refused(player(scene), "artifacts.box_mesh.sha256: ")


def test_a_damaged_sound_is_rejected_like_any_artifact(player: Player, tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene", bare=True)
    manifest = json.loads((scene / "scene.json").read_text())
    manifest["artifacts"]["ocean"] = {"file": "ocean.ogg", "kind": "sound", **identity(b"sea")}
    manifest["sounds"] = [sound("ocean")]
    (scene / "scene.json").write_text(json.dumps(manifest))
    (scene / "ocean.ogg").write_bytes(b"pea")
    refused(player(scene), "ocean.ogg: is damaged or was replaced")
    (scene / "ocean.ogg").write_bytes(b"sea")
    assert player(scene).returncode == 0


def rewritten(scene: Path, name: str, change: Callable[[bytearray], None]) -> str:
    """Changes an artifact's file and its entry in scene.json, as a faulty bake would. Returns its name."""
    manifest = json.loads((scene / "scene.json").read_text())
    entry = manifest["artifacts"][name]
    data = bytearray((scene / entry["file"]).read_bytes())
    change(data)
    (scene / entry["file"]).write_bytes(data)
    entry |= identity(bytes(data))
    (scene / "scene.json").write_text(json.dumps(manifest))
    return str(entry["file"])


def set_binary(values: bytes, at: int) -> Callable[[bytearray], None]:
    """Writes into a GLB's binary chunk."""

    def change(data: bytearray) -> None:
        start = 28 + int.from_bytes(data[12:16], "little") + at
        data[start : start + len(values)] = values

    return change


@pytest.mark.parametrize("value", sweep(["nan", "inf", "1e30", "-1e30"], test=["nan", "1e30"]))
def test_a_mesh_with_an_invalid_number_is_rejected_with_its_vertex(
    player: Player, tmp_path: Path, value: str
) -> None:
    for name in ("box_mesh", "terrain_mesh"):
        scene = write_scene(tmp_path / name)
        bits = np.float32(value).tobytes()
        file = rewritten(scene, name, set_binary(bits, 0))  # the first position of the coarsest level
        refused(
            player(scene, "--size", "16x16"), f"{file}: node ", "POSITION, vertex 0: is (", "paradize bake"
        )


def test_a_sky_with_a_nan_is_rejected_with_its_texel(player: Player, tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene")

    def spoil(data: bytearray) -> None:
        data[-2:] = np.float16("nan").tobytes()  # level 0 is the last in the file

    rewritten(scene, "sky", spoil)
    place = "sky.ktx2: level 0, face 5, texel (7, 7), channel 3: is nan, must be finite"
    refused(player(scene, "--size", "16x16"), place, "paradize bake")


def test_baking_again_repairs_a_damaged_file_as_the_message_says(
    player: Player, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene, out = make_panel(tmp_path / "panel"), tmp_path / "out"
    with keeping_workers():
        assert not bake(scene, out).errors
        damaged = next(iter(sorted(out.glob("*.ktx2"))))
        whole = damaged.read_bytes()
        damaged.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
        refused(
            player(out, "--size", "16x16"), damaged.name, "bake the scene again: paradize bake SCENE.toml"
        )
        assert not bake(scene, out).errors
        assert damaged.read_bytes() == whole
        assert player(out, "--size", "16x16").returncode == 0

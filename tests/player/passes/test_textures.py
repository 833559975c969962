"""Compressed files, BC7 and 16-bit maps look like their plain counterparts."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.data import Texture
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.layout import full_level_count
from paradize.formats.ktx2.reader import decode_ktx2
from tests.pictures import load
from tests.player.synthetic import identity, texture, write_scene
from tests.sweeps import sample

Player = Callable[..., "subprocess.CompletedProcess[str]"]
COLOR = (201, 61, 41)  # odd, so that one parity bit fits all channels


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scene(tmp_path_factory.mktemp("scene") / "full")


def variant(scene: Path, folder: Path, files: dict[str, bytes]) -> Path:
    """The scene with some artifacts replaced."""
    shutil.copytree(scene, folder)
    manifest = json.loads((folder / "scene.json").read_text())
    for name, data in files.items():
        entry: dict[str, Any] = manifest["artifacts"][name]
        (folder / entry["file"]).write_bytes(data)
        entry |= identity(data)
    (folder / "scene.json").write_text(json.dumps(manifest))
    return folder


def picture(player: Player, folder: Path, out: Path, *options: object) -> bytes:
    result = player(folder, "--screenshot", out, "--debug", "--check-finite", *options)
    assert result.returncode == 0, result.stderr
    return out.read_bytes()


def solid_bc7(color: tuple[int, int, int], size: int) -> bytes:
    """A BC7_SRGB file of one opaque colour, odd in each channel: blocks of mode 6, both ends alike."""
    bits, at = 1 << 6, 7
    for channel in (*color, 255):
        for _ in range(2):
            bits |= channel >> 1 << at
            at += 7
    bits |= 0b11 << at  # the last bit of every channel of both ends
    block = bits.to_bytes(16, "little")
    levels = tuple(block * (max(1, (size >> k) // 4) ** 2) for k in range(full_level_count(size, size)))
    return encode_ktx2(Texture("BC7_SRGB", size, size, levels))


@pytest.mark.parametrize("level", sample([19, 1], every=2))
def test_a_compressed_scene_looks_like_the_plain_one(
    player: Player, scene: Path, tmp_path: Path, level: int
) -> None:
    entries = json.loads((scene / "scene.json").read_text())["artifacts"]
    packed = {
        name: encode_ktx2(decode_ktx2((scene / entry["file"]).read_bytes()), zstd_level=level)
        for name, entry in entries.items()
        if entry["kind"] != "mesh"
    }
    assert len(packed) >= 5
    zstd = variant(scene, tmp_path / "zstd", packed)
    plain = picture(player, scene, tmp_path / "plain.png")
    assert picture(player, zstd, tmp_path / "zstd.png") == plain
    # Also every frame while the scene streams in.
    for folder in (scene, zstd):
        picture_name = tmp_path / folder.name / "frame.png"
        result = player(folder, "--frames", 3, "--screenshot", picture_name)
        assert result.returncode == 0, result.stderr
    for number in range(3):
        name = f"frame_{number:04d}.png"
        assert (tmp_path / scene.name / name).read_bytes() == (tmp_path / "zstd" / name).read_bytes()


def test_bc7_shows_the_colour_that_it_holds(player: Player, scene: Path, tmp_path: Path) -> None:
    plain = texture("RGBA8_SRGB", np.full((64, 64, 4), (*COLOR, 255), np.uint8))
    shown = {"plain": plain, "bc7": solid_bc7(COLOR, 64)}
    others = "reflection,refraction,terrain,water,particles"
    shown["packed"] = encode_ktx2(decode_ktx2(shown["bc7"]), zstd_level=3)
    pictures = {}
    for name, data in shown.items():
        path = tmp_path / f"{name}.png"
        picture(player, variant(scene, tmp_path / name, {"box_color": data}), path, "--disable", others)
        pictures[name] = load(path)
    picture(player, scene, tmp_path / "other.png", "--disable", others)
    assert np.array_equal(pictures["bc7"], pictures["packed"])
    # Rasterisers decode sRGB differently for plain and for block formats.
    assert np.abs(pictures["bc7"] - pictures["plain"]).max() <= 1.01 / 255
    assert np.abs(pictures["bc7"] - load(tmp_path / "other.png")).max() > 20 / 255


def test_without_bc7_the_message_has_a_remedy(player: Player, scene: Path, tmp_path: Path) -> None:
    folder = variant(scene, tmp_path / "bc7", {"box_color": solid_bc7(COLOR, 64)})
    without = {"MESA_EXTENSION_OVERRIDE": "-GL_ARB_texture_compression_bptc"}
    result = player(folder, "--screenshot", tmp_path / "a.png", env=without)
    assert result.returncode == 1
    assert "box_color.ktx2: this driver does not support BC7 textures" in result.stderr
    assert "bake the scene at another tier than exact" in result.stderr
    assert not (tmp_path / "a.png").exists()


def test_sixteen_bit_normals_and_dudv_look_like_eight_bit_ones(
    player: Player, scene: Path, tmp_path: Path
) -> None:
    """Uses only 0 and the ends, where 8-bit and 16-bit SNORM are equal."""
    y, x = np.mgrid[0:16, 0:16]
    signs = np.dstack([(x // 4 + y // 4) % 3 - 1, (x // 8) % 2]).astype(np.int16)
    eight = texture("RG8_SNORM", (127 * signs).astype(np.int8))
    sixteen = texture("RG16_SNORM", 32767 * signs)
    shown = {}
    for name, data in {"eight": eight, "sixteen": sixteen}.items():
        folder = variant(scene, tmp_path / name, {"water_dudv": data, "effect_normal": data})
        shown[name] = picture(player, folder, tmp_path / f"{name}.png")
    assert shown["eight"] == shown["sixteen"]
    assert shown["eight"] != picture(player, scene, tmp_path / "other.png")


@pytest.mark.parametrize("damage", ["header", "end", "cut"])
def test_a_damaged_level_ends_playback_with_the_file_name(
    player: Player, scene: Path, tmp_path: Path, damage: str
) -> None:
    noise = np.random.default_rng(3).integers(0, 256, (64, 64, 4), dtype=np.uint8)
    packed = bytearray(encode_ktx2(decode_ktx2(texture("RGBA8_SRGB", noise)), zstd_level=3))
    first, size = (int.from_bytes(packed[at : at + 8], "little") for at in (80, 88))
    if damage == "header":
        packed[first] ^= 0xFF
    elif damage == "end":
        packed[first + 9 : first + 12] = b"\xff\xff\xff"  # the first block has an invalid type
    else:
        packed[88:96] = (size - 1).to_bytes(8, "little")
    folder = variant(scene, tmp_path / "bad", {"box_color": bytes(packed)})
    result = player(folder, "--screenshot", tmp_path / "a.png")
    assert result.returncode == 1, result.stderr
    assert "box_color.ktx2: level 0: " in result.stderr
    assert "Zstandard" in result.stderr
    assert "terminate" not in result.stderr

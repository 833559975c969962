"""A scene that asks for supercompressed textures: smaller files, and the same picture to the last bit."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from paradize.formats.ktx2.reader import decode_ktx2
from tests.pipeline.scenes import make_cove, write_image
from tests.sweeps import sweep

Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module", params=sweep(["cove", "island"], test=["cove"]))
def folders(
    request: pytest.FixtureRequest, root: Path, paradize: Run, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path]:
    """A scene that is baked as it is, and with `zstd = true`."""
    top = tmp_path_factory.mktemp("zstd")
    environment = {**os.environ, "PARADIZE_STORE": str(top / "store")}

    def baked(scene: Path, name: str) -> Path:
        result = paradize("bake", scene, "-o", top / name, "--json", env=environment)
        assert result.returncode == 0, result.stderr
        return top / name

    if request.param == "island":
        plain = request.getfixturevalue("island")
        shutil.copytree(root / "raw_assets", top / "raw", ignore=shutil.ignore_patterns("make"))
        scene = top / "raw/island.toml"
    else:
        scene = make_cove(top / "raw")
        for seed, name in enumerate(("sand.png", "wood.png")):
            tiles = np.random.default_rng(seed).integers(40, 220, (16, 16, 3), np.uint8)
            write_image(scene.parent / name, tiles.repeat(8, axis=0).repeat(8, axis=1))
        ripples = 32768 + 20000 * np.sin(np.arange(128) * np.pi / 16)
        write_image(scene.parent / "waves.png", np.tile(ripples, (128, 1)).astype(np.uint16)[:, :, None])
        plain = baked(scene, "plain")
    text = scene.read_text()
    assert text.count("[scene]\n") == 1
    scene.write_text(text.replace("[scene]\n", "[scene]\nzstd = true\n"))
    return plain, baked(scene, "packed")


@pytest.mark.deep
def test_every_texture_is_smaller_and_holds_the_same_texels(folders: tuple[Path, Path]) -> None:
    unpacked, packed = folders
    plain = json.loads((unpacked / "scene.json").read_text())["artifacts"]
    small = json.loads((packed / "scene.json").read_text())["artifacts"]
    assert plain.keys() == small.keys()
    textures = [name for name, entry in plain.items() if entry["kind"] in ("texture", "cubemap")]
    assert len(textures) > 10
    for name in textures:
        data = (packed / small[name]["file"]).read_bytes()
        assert int.from_bytes(data[44:48], "little") == 2, name
        assert decode_ktx2(data) == decode_ktx2((unpacked / plain[name]["file"]).read_bytes()), name
        assert small[name]["bytes"] < plain[name]["bytes"], name
        assert small[name]["errors"] == plain[name]["errors"], name
    total = [sum(entry["bytes"] for entry in scene.values()) for scene in (plain, small)]
    assert total[1] < 0.6 * total[0]


@pytest.mark.deep
def test_check_finds_nothing_in_it(folders: tuple[Path, Path], paradize: Run) -> None:
    result = paradize("check", folders[1])
    assert result.returncode == 0, result.stdout


@pytest.mark.deep
@pytest.mark.parametrize("share", [0.25, 0.7])
def test_the_player_draws_the_same_picture(
    folders: tuple[Path, Path], player: Run, tmp_path: Path, share: float
) -> None:
    time_s = share * json.loads((folders[0] / "scene.json").read_text())["flight"]["duration_s"]
    pictures = []
    for folder in folders:
        out = tmp_path / f"{folder.name}.png"
        result = player(folder, "--time", time_s, "--size", "320x180", "--screenshot", out)
        assert result.returncode == 0, result.stderr
        pictures.append(out.read_bytes())
    assert pictures[0] == pictures[1]

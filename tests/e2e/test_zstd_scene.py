"""A scene that asks for supercompressed textures: smaller files, and the same picture to the last bit."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from paradize.formats.ktx2.reader import decode_ktx2

Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def packed(root: Path, paradize: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The island, baked with `zstd = true`."""
    folder = tmp_path_factory.mktemp("zstd")
    shutil.copytree(root / "raw_assets", folder / "raw", ignore=shutil.ignore_patterns("make"))
    scene = folder / "raw/island.toml"
    text = scene.read_text()
    assert text.count("[scene]\n") == 1
    scene.write_text(text.replace("[scene]\n", "[scene]\nzstd = true\n"))
    environment = {**os.environ, "PARADIZE_STORE": str(folder / "store")}
    result = paradize("bake", scene, "-o", folder / "baked", "--json", env=environment)
    assert result.returncode == 0, result.stderr
    return folder / "baked"


def test_every_texture_is_smaller_and_holds_the_same_texels(island: Path, packed: Path) -> None:
    plain = json.loads((island / "scene.json").read_text())["artifacts"]
    small = json.loads((packed / "scene.json").read_text())["artifacts"]
    assert plain.keys() == small.keys()
    textures = [name for name, entry in plain.items() if entry["kind"] in ("texture", "cubemap")]
    assert len(textures) > 10
    for name in textures:
        data = (packed / small[name]["file"]).read_bytes()
        assert int.from_bytes(data[44:48], "little") == 2, name
        assert decode_ktx2(data) == decode_ktx2((island / plain[name]["file"]).read_bytes()), name
        assert small[name]["bytes"] < plain[name]["bytes"], name
        assert small[name]["errors"] == plain[name]["errors"], name
    total = [sum(entry["bytes"] for entry in scene.values()) for scene in (plain, small)]
    assert total[1] < 0.6 * total[0]


@pytest.mark.deep
def test_check_finds_nothing_in_it(packed: Path, paradize: Run) -> None:
    result = paradize("check", packed)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize("time_s", [62, 165])
def test_the_player_draws_the_same_picture(
    island: Path, packed: Path, player: Run, tmp_path: Path, time_s: int
) -> None:
    pictures = []
    for folder in (island, packed):
        out = tmp_path / f"{folder.name}.png"
        result = player(folder, "--time", time_s, "--size", "320x180", "--screenshot", out)
        assert result.returncode == 0, result.stderr
        pictures.append(out.read_bytes())
    assert pictures[0] == pictures[1]

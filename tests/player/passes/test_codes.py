"""A quantised mesh is drawn like the same mesh in floats."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from paradize.bakers.quantise import quantised_levels
from paradize.data import Lod, Mesh
from paradize.formats.glb.encode import encode_glb
from tests.player import synthetic


def picture(folder: Path, player: Callable[..., Any], glb: bytes) -> np.ndarray:
    synthetic.write_scene(folder)
    scene = json.loads((folder / "scene.json").read_text())
    (folder / "box_mesh.glb").write_bytes(glb)
    scene["artifacts"]["box_mesh"] |= synthetic.identity(glb)
    (folder / "scene.json").write_text(json.dumps(scene))
    out = folder / "a.png"
    result = player(folder, "--time", 2.5, "--size", "192x108", "--screenshot", out, "--debug")
    assert result.returncode == 0, result.stderr
    return np.asarray(oiio.ImageBuf(str(out)).get_pixels(oiio.FLOAT)[..., :3], np.float32)


def tilted() -> Mesh:
    """The box on one of its edges, because quantised normals along an axis would be exact."""
    box = synthetic.box()
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    assert box.normals is not None
    assert box.tangents is not None
    tangents = box.tangents.copy()
    tangents[:, :3] = box.tangents[:, :3] @ turn.T
    positions = (box.positions - [0, 1, 0]) @ turn.T + [0, 1, 0]
    return replace(
        box,
        positions=positions.astype(np.float32),
        normals=(box.normals @ turn.T).astype(np.float32),
        tangents=tangents,
    )


LODS = [Lod(tilted(), 0.0, 0.0), Lod(tilted(), 0.02, 0.01)]


@pytest.fixture(scope="module")
def floats(tmp_path_factory: pytest.TempPathFactory, player: Callable[..., Any]) -> np.ndarray:
    """The picture of the mesh in floats."""
    return picture(tmp_path_factory.mktemp("floats"), player, encode_glb(LODS, "box"))


@pytest.mark.parametrize(("direction_deg", "kind"), [(0.1, np.int16), (1.0, np.int8)])
def test_a_quantised_mesh_is_drawn_like_floats(
    tmp_path: Path, player: Callable[..., Any], floats: np.ndarray, direction_deg: float, kind: type
) -> None:
    codes = quantised_levels(LODS, direction_deg=direction_deg)
    assert codes[0].quantised is not None
    assert codes[0].quantised.normals is not None
    assert codes[0].quantised.normals.dtype == kind
    drawn = picture(tmp_path / "codes", player, encode_glb(codes, "box"))
    off = np.abs(drawn - floats).max(axis=2)
    assert off.mean() < 0.5 / 255
    assert (off > 4 / 255).sum() <= 0.002 * off.size


def test_the_box_of_these_pictures_is_seen(
    tmp_path: Path, player: Callable[..., Any], floats: np.ndarray
) -> None:
    other = picture(tmp_path / "other", player, encode_glb([Lod(synthetic.box(), 0.0, 0.0)] * 2, "box"))
    assert (np.abs(floats - other).max(axis=2) > 0.05).sum() > 200

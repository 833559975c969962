"""The light of a fixed sky on surfaces. Without the pass `sky` it is all that the sky gives the picture."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt

from paradize.data import Texture
from paradize.formats.ktx2.encode import encode_ktx2
from tests.pictures import load
from tests.player.conftest import Player
from tests.player.synthetic import identity, write_scene

F32 = npt.NDArray[np.float32]
SIZE = 64
FLAT = np.full((6, SIZE, SIZE, 3), 0.4, np.float32)


def sky(folder: Path, light: F32, finest: F32 | None = None) -> Path:
    """A scene without water under a sky of these texels (6, SIZE, SIZE, 3) and their means; finest: other
    texels in level 0 alone."""
    levels = [light if finest is None else finest]
    while light.shape[1] > 1:
        light = light.reshape(6, light.shape[1] // 2, 2, light.shape[2] // 2, 2, 3).mean(axis=(2, 4))
        levels.append(light)
    opaque = [np.concatenate([level, np.ones_like(level[..., :1])], axis=-1) for level in levels]
    data = tuple(level.astype(np.float16).tobytes() for level in opaque)
    cube = encode_ktx2(Texture("RGBA16F", SIZE, SIZE, data, 6))
    write_scene(folder, water=None, reflection=None, refraction=None)
    (folder / "sky.ktx2").write_bytes(cube)
    manifest = json.loads((folder / "scene.json").read_text())
    manifest["artifacts"]["sky"] |= identity(cube)
    (folder / "scene.json").write_text(json.dumps(manifest))
    return folder


def test_surfaces_see_the_sky_blurred_and_no_detail_of_it(player: Player, tmp_path: Path) -> None:
    """Details: every second texel of the finest level is twice as bright, or black."""
    detailed = FLAT * (2 * (np.indices((SIZE, SIZE)).sum(axis=0) % 2))[None, :, :, None].astype(np.float32)
    sides = FLAT.copy()
    sides[[0, 1, 4, 5]] *= 2.5  # all but up and down
    pictures = {}
    for name, scene in {
        "flat": sky(tmp_path / "flat", FLAT),
        "detailed": sky(tmp_path / "detailed", FLAT, detailed),
        "brighter at the sides": sky(tmp_path / "sides", sides),
    }.items():
        for passes in ("sky", "post"):
            picture = tmp_path / f"{name} {passes}.png"
            done = player(scene, "--disable", passes, "--time", 1, "--wait-resident", "--screenshot", picture)
            assert done.returncode == 0, done.stderr
            pictures[name, passes] = load(picture)
    assert np.array_equal(pictures["flat", "sky"], pictures["detailed", "sky"])
    assert not np.array_equal(pictures["flat", "post"], pictures["detailed", "post"]), (
        "the sky itself shows it"
    )
    brighter = pictures["brighter at the sides", "sky"].astype(float) - pictures["flat", "sky"]
    assert (brighter >= -1e-3).all() and brighter.max() > 0.05

"""Scenes for the streaming bench, and runs of the player over them."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from paradize.data import Texture
from paradize.formats.ktx2.encode import encode_ktx2
from tests.conftest import SOFTWARE_RENDERING
from tests.places import ROOT

PLAYER = ROOT / "build/bin/paradize-player"


def play(scene: Path, *arguments: object) -> dict[str, Any]:
    """The player's output of a headless run."""
    command = [str(PLAYER), str(scene), "--headless", "--mute", "--json", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, check=True, env={**os.environ, **SOFTWARE_RENDERING})
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def colored(edge: int, seed: int) -> bytes:
    """A KTX2 of RGBA8, (edge, edge), of soft squares in colours of their own; its mips are means."""
    random = np.random.default_rng(seed)
    texels = np.kron(random.integers(0, 256, (64, 64, 4), dtype=np.uint8), np.ones((edge // 64,) * 2 + (1,)))
    levels = [texels.astype(np.uint8)]
    levels[0][..., 3] = 255
    while levels[-1].shape[0] > 1:
        half = levels[-1].shape[0] // 2
        blocks = levels[-1].reshape(half, 2, half, 2, 4).astype(np.uint16)
        levels.append((blocks.sum(axis=(1, 3)) // 4).astype(np.uint8))
    return encode_ktx2(Texture("RGBA8_SRGB", edge, edge, tuple(level.tobytes() for level in levels), 1))


def without_data(scene: Path, folder: Path) -> Path:
    """The same scene with every texture of one texel: the same shaders and draw calls, next to nothing to
    read or to upload."""
    shutil.copytree(scene, folder)
    manifest: dict[str, Any] = json.loads((folder / "scene.json").read_text())
    for entry in manifest["artifacts"].values():
        if entry["kind"] not in ("texture", "cubemap"):
            continue
        faces = 6 if entry["kind"] == "cubemap" else 1
        texel = Texture("RGBA8_UNORM", 1, 1, (bytes([128, 128, 128, 255]) * faces,), faces)
        data = encode_ktx2(texel)
        (folder / entry["file"]).write_bytes(data)
        entry |= {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
    (folder / "scene.json").write_text(json.dumps(manifest))
    return folder

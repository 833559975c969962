"""Pictures that the player draws of a baked folder, without a window."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

from paradize.errors import BakeError
from paradize.files import open_file, resolved

PLAYER = "paradize-player"
_PATIENCE_S = 300.0  # a picture that takes longer is an error


def find_player() -> Path | None:
    """The player beside this command, in build/bin of the same checkout, or on the path; None without one."""
    near = [Path(sys.argv[0]).parent, Path(sys.executable).parent, Path(sys.prefix).parent / "bin"]
    for folder in near:
        if os.access(folder / PLAYER, os.X_OK):
            return resolved(folder / PLAYER)
    found = shutil.which(PLAYER)
    return None if found is None else Path(found)


def read_picture(file: Path) -> npt.NDArray[np.float32]:
    """A screenshot, (h, w, 3), sRGB 0..1."""
    from PIL import Image

    with open_file(file) as stream, Image.open(stream) as image:
        return np.asarray(image.convert("RGB"), np.float32) / np.float32(255)


def run_player(player: Path, folder: Path, *options: str, timeout_s: float = _PATIENCE_S) -> str:
    """Runs the player on a baked folder; returns its standard output. Raises BakeError if it fails."""
    command = [str(player), str(folder), "--headless", "--mute", *options]
    try:
        done = subprocess.run(
            command, check=True, stdin=subprocess.DEVNULL, capture_output=True, timeout=timeout_s
        )
    except subprocess.CalledProcessError as failed:
        lines = failed.stderr.decode(errors="replace").strip().splitlines()
        raise BakeError(f"drew nothing: {lines[-1] if lines else failed}", file=player) from None
    except (OSError, subprocess.TimeoutExpired) as failed:
        raise BakeError(f"drew nothing: {failed}", file=player) from None
    return done.stdout.decode(errors="replace")

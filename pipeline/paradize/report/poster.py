"""The picture of a baked scene that its report begins with, drawn by the player."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from paradize.documents import SCENE_FILE
from paradize.errors import ParadizeError
from paradize.files import open_file, read_file
from paradize.formats.scene.manifest import read_scene
from paradize.preview.player import run_player
from paradize.store.atomic import write_report

# No artifact has a dash in its name, so these files are no contact sheets.
WIDTH = 1100  # pixels
FILE, KEY_FILE = "the-scene.jpg", "the-scene.key"
_QUALITY = 88  # of JPEG


@dataclass(frozen=True)
class Poster:
    """picture: a JPEG, or None; missing: why there is none, in a sentence."""

    picture: bytes | None
    missing: str = ""


def draw_poster(
    baked: Path,
    folder: Path,
    player: Path | None,
    on_progress: Callable[[str, int, int], None] | None = None,
) -> Poster:
    """The scene in `baked` at its poster_s, drawn by `player` and kept in `folder` until the scene changes.

    A report does not need it: whatever fails is in `missing`."""
    if player is None:
        return Poster(None, "There is no picture of the scene, because paradize-player was not found.")
    picture = folder / FILE
    try:
        key = hashlib.sha256(read_file(baked / SCENE_FILE) + str(player.stat().st_mtime_ns).encode())
        known = read_file(folder / KEY_FILE) if (folder / KEY_FILE).is_file() else b""
        if known == key.hexdigest().encode() and picture.is_file():
            return Poster(read_file(picture))
        if on_progress:
            on_progress("the scene's picture", 0, 1)
        scene = read_scene(baked / SCENE_FILE)
        width, height = scene["viewport"]
        size = f"{WIDTH}x{max(1, round(WIDTH * height / width))}"
        view = ("--size", size, "--time", f"{scene['poster_s']:g}")
        out = io.BytesIO()
        with TemporaryDirectory(prefix="paradize-poster-") as scratch:
            drawn = Path(scratch) / "poster.png"
            run_player(player, baked, *view, "--screenshot", str(drawn))
            with open_file(drawn) as stream, Image.open(stream) as image:
                image.convert("RGB").save(out, "JPEG", quality=_QUALITY)
        write_report(picture, out.getvalue())
        write_report(folder / KEY_FILE, key.hexdigest().encode())
    except (OSError, ValueError, ParadizeError) as error:
        return Poster(None, f"There is no picture of the scene: {error}")
    return Poster(out.getvalue())

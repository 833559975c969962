"""A rule for the sky: its sun stands where the scene's sun casts its light from."""

from __future__ import annotations

from collections.abc import Iterator
from math import acos, asin, atan2, cos, degrees, radians
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.checks.rules import Finding
from paradize.data import Texture
from paradize.errors import ParadizeError
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.scene.manifest import read_entry
from paradize.vectors import cube_vectors, lengths

F64 = npt.NDArray[np.float64]
IntOrInts = int | npt.NDArray[np.int64]

_SIDE = 64  # texels: 1.4 degrees each, of which the sun's disc fills a tenth
_SUN = 30.0  # times the sky's mean: clouds and pictures without light beyond white stay below 10
_SECOND = 0.1  # of the brightest light: rooms have others of 0.1 to 1, clear skies none above 0.03
_APART_DEG = 10.0
_BT709 = np.array([0.2126, 0.7152, 0.0722])


def check_sky(manifest: dict[str, Any], folder: Path, file: str) -> Iterator[Finding]:
    """The finding about the sky of a scene whose light stands still. Other rules report files that cannot be
    read, or lack levels."""
    sun, sky = manifest["sun"], manifest["sky"]
    if sky is None or manifest["daytime"] or sun["intensity"] * max(sun["color"]) == 0.0:
        return
    name = sky["cubemap"]
    try:
        texture = decode_ktx2(read_entry(folder, manifest["artifacts"][name]))
    except (OSError, ParadizeError):
        return
    if texture.format != "RGBA16F" or texture.faces != 6:
        return
    sides = [texture.width >> level for level in range(len(texture.levels))]
    coarse = next((level for level, side in enumerate(sides) if side <= _SIDE), None)
    if coarse is None:  # of levels that are missing
        return
    light = _light(texture, coarse)
    if not light.max() > _SUN * light.mean():
        return
    face, row, column = (int(k) for k in np.unravel_index(int(light.argmax()), light.shape))
    if _elsewhere(light, face, row, column) > _SECOND * light.max():
        return
    for level in range(coarse - 1, -1, -1):
        finer = _light(texture, level, face)[2 * row : 2 * row + 2, 2 * column : 2 * column + 2]
        down, across = divmod(int(finer.argmax()), 2)
        row, column = 2 * row + down, 2 * column + across
    toward = _directions(face, row, column, sides[0])
    apart_deg = degrees(acos(float(np.clip(toward @ np.array(sun["direction"]), -1.0, 1.0))))
    if apart_deg <= _APART_DEG:
        return
    azimuth, elevation = degrees(atan2(toward[0], -toward[2])), degrees(asin(toward[1]))
    what = f"the sky's brightest light stands {apart_deg:.0f} degrees from [sun]: shadows fall the wrong way"
    place = f"azimuth_deg = {azimuth:.1f} and elevation_deg = {elevation:.1f}"
    yield Finding(
        "PZ427", file, what, "sun", mend=f"write {place} in [sun], or turn the picture", artifact=name
    )


def _light(texture: Texture, level: int, face: int | None = None) -> F64:
    """The luminance of a level: of all faces (6, n, n), or of one (n, n)."""
    side = texture.width >> level
    texels = np.frombuffer(texture.levels[level], np.float16).reshape(6, side, side, 4)
    chosen = texels if face is None else texels[face]
    return np.asarray(chosen[..., :3].astype(np.float64) @ _BT709, np.float64)


def _elsewhere(light: F64, face: int, row: int, column: int) -> float:
    """The most luminance of a level, (6, n, n), that lies apart from a texel of it; 0 without any."""
    side = light.shape[1]
    toward = _directions(face, row, column, side)
    rows, columns = np.indices((side, side))
    near = cos(radians(_APART_DEG))
    return max(
        float(texels[_directions(k, rows, columns, side) @ toward < near].max(initial=0.0))
        for k, texels in enumerate(light)
    )


def _directions(face: int, rows: IntOrInts, columns: IntOrInts, side: int) -> F64:
    """The unit vectors to the middles of texels of a cube map, (..., 3)."""
    s, t = ((2.0 * np.asarray(k) + 1.0) / side - 1.0 for k in (columns, rows))
    way = cube_vectors(face, s, t)
    return np.asarray(way / lengths(way)[..., None])

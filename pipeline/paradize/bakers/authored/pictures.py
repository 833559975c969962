"""The pictures of a material's maps by role, each as the texels that its role takes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.errors import BakeError, SourceError
from paradize.readers.heightmap import color_warnings
from paradize.readers.image import read_image

Values = npt.NDArray[Any]
CHANNELS = ("rgb", "r", "g", "b", "a", "luminance")


@dataclass(frozen=True)
class RolePicture:
    """The texels that a role uses of its picture. values: (h, w, 3) of a normal map, else (h, w); codes uint8
    or uint16, or finite floats. cast: made of the model at `path`, not authored. warnings: of its reader."""

    path: Path
    values: Values
    cast: bool = False
    warnings: Sequence[str] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.values.shape[0], self.values.shape[1]


def read_pictures(
    sources: Mapping[str, Path], roles: Iterable[str], channels: Mapping[str, str]
) -> dict[str, RolePicture]:
    """The pictures of the roles that have one. Each file is read once, whatever its profile of colours says.
    Raises SourceError for what cannot be read, BakeError for a channel that there is not."""
    found: dict[str, RolePicture] = {}
    wanted = [role for role in roles if role in sources]
    for path in dict.fromkeys(sources[role] for role in wanted):
        image = read_image(path, color_space="data")
        values: Values = image.values
        for role in (role for role in wanted if sources[role] == path):
            channel, warnings = channels.get(role, "luminance"), image.warnings(path)
            texels = _colored(values, path) if role == "normal" else _plane(values, channel, path, role)
            if role not in ("normal", "specular") and channel == "luminance":
                warnings += color_warnings(image, path, role)
            found[role] = RolePicture(path, texels, warnings=warnings)
    return found


def _colored(values: Values, path: Path) -> Values:
    if values.shape[2] < 3:
        mend = "give the normal map, or heights as the height"
        raise SourceError("is grey; a normal map has red, green and blue", file=path, mend=mend)
    return np.ascontiguousarray(values[:, :, :3])


def _plane(values: Values, channel: str, path: Path, role: str) -> Values:
    if channel not in CHANNELS:
        raise BakeError(f"no channel {channel!r}", mend=f"one of {', '.join(CHANNELS)}")
    count = values.shape[2]
    if channel == "a":
        if count not in (2, 4):
            mend = "name another channel, or save it with alpha"
            raise SourceError(f"has no alpha, where {role} is read from", file=path, mend=mend)
        return np.ascontiguousarray(values[:, :, -1])
    if count < 3:
        return np.ascontiguousarray(values[:, :, 0])
    if channel in ("r", "g", "b"):
        return np.ascontiguousarray(values[:, :, "rgb".index(channel)])
    red, green, blue = (values[:, :, k] for k in range(3))
    if np.array_equal(red, green) and np.array_equal(green, blue):
        return np.ascontiguousarray(red)
    top = 1.0 if values.dtype == np.float32 else float(np.iinfo(values.dtype).max)
    bright = np.empty(values.shape[:2], np.float32)
    for row in range(len(values)):  # Rec. 709, of numbers as they are
        bright[row] = (0.2126 * red[row] + 0.7152 * green[row] + 0.0722 * blue[row]) / top
    return bright

"""Texels of authored maps -> unit normals, and shares of 1.

Normals follow glTF: component = 2 v / 255 - 1, times the material's scale along x and y, made unit. The
Khronos Group, "glTF 2.0 Specification", 2021, 3.9.3. Codes 127 and 128 are both 0, and so are 32767 and 32768
of 16 bits, so that a flat map is flat. Nothing that a texture of x and y can hold points into the surface:
z below 0 counts as 0. What has no direction, and black texels (the ground between UV islands), are (0, 0, 1).
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from functools import cache
from operator import add
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    Values = npt.NDArray[Any]

UNIT_WITHIN = 0.1  # of length 1: how far JPEG and resizing ordinarily leave it


@dataclass(frozen=True)
class NormalCoding:
    """How a picture holds normals. signed: floats are -1..1 themselves, else 0..1 (codes always are).
    without_z: blue is 0 everywhere, and z follows from x and y. green_down: green points down. scale: of x
    and y, -1e6..1e6."""

    signed: bool = False
    without_z: bool = False
    green_down: bool = False
    scale: float = 1.0


@dataclass(frozen=True)
class NormalSurvey:
    """Statistics of a normal map's texels, black ones left out. texels: how many were looked at. black: black
    ones. grey: red, green and blue are equal. below: z is below 0. off: length farther from 1 than
    UNIT_WITHIN. side, up: the sums of x + iy and of z. largest: the largest distance of a length from 1."""

    texels: int = 0
    black: int = 0
    grey: int = 0
    below: int = 0
    off: int = 0
    side: complex = 0j
    up: float = 0.0
    largest: float = 0.0

    def __add__(self, other: NormalSurvey) -> NormalSurvey:
        *sums, _ = map(add, astuple(self), astuple(other))
        return NormalSurvey(*(*sums, max(self.largest, other.largest)))


@cache
def _components(kind: str) -> F64:
    """The component of every code of uint8 or uint16."""
    top = int(np.iinfo(kind).max)
    table = 2.0 * np.arange(top + 1, dtype=np.float64) / top - 1.0
    table[top // 2 : top // 2 + 2] = 0.0
    return table


def _vectors(texels: Values, coding: NormalCoding) -> F64:
    """x, y, z (n, w, 3) as they are stored."""
    shown = texels[:, :, :3]
    if shown.dtype != np.float32:
        vectors = _components(shown.dtype.name)[shown]
    else:
        vectors = shown.astype(np.float64)
        if not coding.signed:
            vectors = 2.0 * vectors - 1.0
    if coding.without_z:
        rest = 1.0 - vectors[:, :, 0] ** 2 - vectors[:, :, 1] ** 2
        vectors[:, :, 2] = np.sqrt(np.maximum(rest, 0.0))
    return np.asarray(vectors, np.float64)


def _black(texels: Values, coding: NormalCoding) -> npt.NDArray[np.bool_]:
    """Texels (n, w) that hold no normal: black ones; of signed floats and of maps without blue there are
    none."""
    if coding.without_z or (coding.signed and texels.dtype == np.float32):
        return np.zeros(texels.shape[:2], np.bool_)
    return np.asarray(~texels[:, :, :3].any(axis=2), np.bool_)


def decoded_normals(texels: Values, coding: NormalCoding) -> F32:
    """Unit normals (n, w, 3), green up, of texels (n, w, 3 or 4): codes or finite floats."""
    vectors = _vectors(texels, coding)
    vectors[:, :, 0] *= coding.scale
    vectors[:, :, 1] *= -coding.scale if coding.green_down else coding.scale
    vectors[:, :, 2] = np.maximum(vectors[:, :, 2], 0.0)
    vectors[_black(texels, coding)] = 0.0
    largest = np.abs(vectors).max(axis=2, keepdims=True)
    none = largest[:, :, 0] == 0.0
    vectors /= np.where(largest == 0.0, 1.0, largest)  # no square is too large or too small
    length = np.sqrt(vectors[:, :, 0] ** 2 + vectors[:, :, 1] ** 2 + vectors[:, :, 2] ** 2)
    vectors[none] = (0.0, 0.0, 1.0)
    length[none] = 1.0
    return (vectors / length[:, :, None]).astype(np.float32)


def survey_normals(texels: Values, coding: NormalCoding, inside: npt.NDArray[np.bool_]) -> NormalSurvey:
    """Counts the texels (n, w, 3 or 4) of a normal map where inside (n, w) is true."""
    black = _black(texels, coding) & inside
    kept = inside & ~black
    shown = texels[kept][:, None, :]
    vectors = _vectors(shown, coding)[:, 0]
    length = np.sqrt((vectors * vectors).sum(axis=1))
    apart = np.abs(length - 1.0)
    equal = (shown[:, 0, 0] == shown[:, 0, 1]) & (shown[:, 0, 1] == shown[:, 0, 2])
    x, y, z = vectors.sum(axis=0)
    counted = (inside, black, equal, vectors[:, 2] < 0.0, apart > UNIT_WITHIN)
    counts: Any = (int(np.count_nonzero(each)) for each in counted)
    return NormalSurvey(*(*counts, complex(x, y), float(z), float(apart.max(initial=0.0))))


def is_signed(texels: Values) -> bool:
    """Whether floats (n, w, 3 or 4) hold -1..1 themselves: read so, their lengths are nearer to 1."""
    if texels.dtype != np.float32:
        return False
    step = max(1, max(texels.shape[:2]) // 512)  # a sample says enough
    vectors = texels[::step, ::step, :3].astype(np.float64)
    apart = [
        float(np.median(np.abs(np.sqrt((v * v).sum(axis=2)) - 1.0))) for v in (vectors, 2.0 * vectors - 1.0)
    ]
    return apart[0] < apart[1]


def shares(plane: Values, *, gain: float, offset: float = 0.0) -> F32:
    """offset + gain * the values of a plane (n, w) as shares of 1, codes or finite floats, within 0..1."""
    if plane.dtype == np.float32:
        wide = plane.astype(np.float64)
    else:
        top = int(np.iinfo(plane.dtype).max)
        wide = plane.astype(np.float64) / top
    return np.clip(offset + gain * wide, 0.0, 1.0).astype(np.float32)

"""Rows of the metrics of maps and pictures: closed forms at every extreme."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import HeightMap, Image, Texture
from paradize.metrics.filters import taps
from paradize.metrics.levels import color_levels, value_levels, vector_error
from paradize.metrics.panorama import panorama_errors
from paradize.metrics.picture import flip_errors
from paradize.metrics.source import true_heights
from paradize.metrics.texels import decode_texels
from paradize.metrics.texels_bc7 import decode_bc7
from paradize.stages.cubemap import HALF_MAX, encode_cube
from tests.extremes.map_rows import ground_of
from tests.extremes.planes import EVEN_SKIES, HEIGHTS, NO_SIDES, pictures, read_picture
from tests.extremes.table import Row
from tests.pipeline import map_truth as truth

F32 = npt.NDArray[np.float32]
_TILT = 1.0  # degrees
_OFFSET = 2.0**-6


def _ground(heights: F32) -> HeightMap:
    return ground_of(heights, "fourth", 1.0)


def _tilted(heights: F32) -> dict[str, float]:
    """Of normals that are one degree nearer the vertical than the ground's, or past it."""
    ground, known = _ground(heights), taps("eighth")
    assert known is not None
    if not heights.size or not np.isfinite(heights).all():
        return vector_error(np.zeros((*heights.shape, 2), np.float32), ground)
    n = truth.normals(heights, known, scale=ground.slope_scale, wrap=(True, True))
    upright = (np.abs(n[:, :, :2]).max(axis=2) < 1e-9)[:, :, None]
    side = np.where(upright, [1.0, 0, 0], [0, 0, 1.0] - n * n[:, :, 2:])
    side /= np.linalg.norm(side, axis=2, keepdims=True)
    turn = np.radians(_TILT)
    tilted = np.cos(turn) * n + np.sin(turn) * side
    return vector_error(tilted[:, :, :2].astype(np.float32), ground)


def _offset(picture: F32) -> tuple[dict[str, float], float, float]:
    """The result of value_levels for floats that are off by 2^-6, and the largest and the mean square of
    that."""
    moved = (picture.astype(np.float64) + _OFFSET).astype(np.float32)[:, :, :1]
    texture = Texture("R32F", picture.shape[1], picture.shape[0], (moved.tobytes(),))
    (found,) = value_levels(texture, np.ascontiguousarray(picture[:, :, :1]))
    off = np.abs(moved.astype(np.float64) - picture[:, :, :1])
    return found, float(off.max()), float((off * off).mean())


def _offset_error(picture: F32, made: tuple[dict[str, float], float, float]) -> float:
    found, most, squares = made
    wanted = min(120.0, -10 * np.log10(max(squares, 1e-300)))
    return float(max(abs(found["max"] - most), abs(found["psnr_db"] - wanted) / 100))


def _two_codes(picture: F32) -> tuple[dict[str, float], float, float]:
    """The result of color_levels for 8-bit colours that are two codes off, but for those that would pass
    255."""
    if not np.isfinite(picture).all():
        nothing = bytes(picture[:, :, :1].nbytes)
        texture = Texture("RGBA8_SRGB", picture.shape[1], picture.shape[0], (nothing,))
        color_levels(texture, picture, encoded=True, alpha_cutoff=None)
    codes = np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)
    moved = np.minimum(codes.astype(int) + 2, 255)
    alpha = np.full((*codes.shape[:2], 1), 255)
    data = np.concatenate([moved, alpha], axis=2).astype(np.uint8).tobytes()
    texture = Texture("RGBA8_SRGB", codes.shape[1], codes.shape[0], (data,))
    (found,) = color_levels(texture, codes, encoded=True, alpha_cutoff=None)
    off = (moved - codes) / 255.0
    return found, float(off.max()), float((off * off).mean())


def _flipped(picture: F32) -> dict[str, float]:
    return flip_errors([picture], [picture.copy()])


def _inside(channels: int) -> dict[str, Any]:
    """Pictures whose values lie in 0 to 1, as screens show them, but for what is not finite."""
    made = pictures(channels)
    names = ("huge", "far")
    return {
        name: (lambda make=make: np.clip(make(), 0, 1)) if name in names or name == "tiny" else make
        for name, make in made.items()
    }


_FORMATS = {
    "R8_UNORM": (np.uint8, 1, 255.0),
    "RG8_UNORM": (np.uint8, 2, 255.0),
    "RG8_SNORM": (np.int8, 2, 127.0),
    "RGBA8_SRGB": (np.uint8, 4, 255.0),
    "R16_UNORM": (np.uint16, 1, 65535.0),
    "RG16_SNORM": (np.int16, 2, 32767.0),
}


def _code_planes() -> dict[str, Any]:
    """Bytes of textures (height, width): every byte that there is, one value, the ends of the range."""
    rng = np.random.default_rng(3)

    def of(height: int, width: int, fill: Any = None) -> Any:
        count = height * width * 8
        return lambda: (
            height,
            width,
            rng_bytes[:count] if fill is None else np.full(count, fill, np.uint8).tobytes(),
        )

    rng_bytes = rng.integers(0, 256, 4 * 2048 * 8, dtype=np.uint8).tobytes()
    return {
        "zero": of(0, 0),
        "one": of(1, 1),
        "many": of(64, 64),
        "constant": of(8, 8, 77),
        "huge": of(4, 4, 255),
        "tiny": of(4, 4, 1),
        "opposite": of(4, 4, 128),
        "parallel": of(4, 4, 127),
        "degenerate": of(1, 64),
        "mirrored": of(64, 1),
        "sliver": of(2, 2048),
        "largest": lambda: (2048, 2048, np.tile(np.arange(256, dtype=np.uint8), 131072).tobytes()),
    }


def _decoded(given: tuple[int, int, bytes]) -> list[F32]:
    height, width, data = given
    out = []
    for fmt, (kind, channels, _) in _FORMATS.items():
        size = height * width * channels * np.dtype(kind).itemsize
        out.append(decode_texels(Texture(fmt, width, height, (data[:size],))))
    return out


def _decoded_error(given: tuple[int, int, bytes], made: list[F32]) -> float:
    """From codes over the top code, in float64, -128 as -127."""
    height, width, data = given
    worst = 0.0
    for found, (kind, channels, top) in zip(made, _FORMATS.values(), strict=True):
        codes = np.frombuffer(data, kind, height * width * channels).astype(np.float64)
        wanted = np.maximum(codes / top, -1.0).reshape(height, width, channels)
        worst = max(worst, float(np.abs(found - wanted).max(initial=0.0)))
    return worst


def _mode_six(count: int, seed: int, ends: tuple[int, int] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Blocks (n, 16) of BC7's mode 6 that are packed here bit by bit, and their texels (n, 16, 4)."""
    rng = np.random.default_rng(seed)
    weights = [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64]
    blocks, texels = np.zeros((count, 16), np.uint8), np.zeros((count, 16, 4), np.uint8)
    for k in range(count):
        pair = rng.integers(0, 128, (4, 2)) if ends is None else np.array([ends] * 4)
        low = rng.integers(0, 2, 2) if ends is None else np.array([e > 63 for e in ends], int)
        index = rng.integers(0, 16, 16)
        index[0] &= 7
        bits, at = 1 << 6, 7
        for value in pair.ravel().tolist():
            bits, at = bits | value << at, at + 7
        for value in low.tolist():
            bits, at = bits | value << at, at + 1
        for texel, value in enumerate(index.tolist()):
            bits, at = bits | value << at, at + (3 if texel == 0 else 4)
        blocks[k] = np.frombuffer(bits.to_bytes(16, "little"), np.uint8)
        a, b = (2 * pair[:, end] + low[end] for end in (0, 1))
        for texel, value in enumerate(index.tolist()):
            texels[k, texel] = (a * (64 - weights[value]) + b * weights[value] + 32) >> 6
    return blocks, texels


def _lit(picture: F32) -> F32:
    """Heights of a picture in sRGB, as metrics/source.py has them."""
    read_picture(picture)
    return true_heights(Image(picture, "srgb", 32), "color", None)


def _lit_error(picture: F32, made: F32) -> float:
    """Beside IEC 61966-2-1 and BT.709 in numbers of 64 bits or more."""
    wide = picture.astype(np.longdouble)
    bent = ((np.maximum(wide, 0.04045) + np.longdouble("0.055")) / np.longdouble("1.055")) ** np.longdouble(
        "2.4"
    )
    shown = np.where(wide > 0.04045, bent, wide / np.longdouble("12.92"))
    bright = (shown * [0.2126, 0.7152, 0.0722]).sum(axis=2)
    return float(np.abs(np.clip(bright, 0.0, 1.0) - made).max(initial=0.0))


def _darker(light: F32) -> dict[str, float]:
    """Of a sky a sixteenth darker than an even panorama."""
    read_picture(light)
    faces = np.full((6, 4, 4, 3), light[:1, :1].sum() / 3 * (1 - 2.0**-4), np.float32)
    return panorama_errors(encode_cube([faces]), light, encoded=False)


def _darker_error(light: F32, made: dict[str, float]) -> float:
    """A sixteenth, but for half floats, and relative to 1e-4 where it is darker than that."""
    value = float(light[0, 0, 0])
    shown = float(np.float16(min(np.float32(value * (1 - 2.0**-4)), np.float32(HALF_MAX))))
    wanted = abs(shown - value) / max(value, 1e-4)
    return max(abs(found - wanted) for found in made.values())


_WHOLE = dict.fromkeys(
    ("far", "denormal", "nan", "inf"), "codes are whole numbers: there is no such one among them"
)
_SHOWN = {"nan": "not finite", "inf": "not finite", "zero": "cannot be compared"}
ROWS = [
    Row(
        "metrics.levels",
        HEIGHTS,
        _tilted,
        lambda heights, made: max(abs(value - _TILT) for value in made.values()),
        "degrees",
        1e-3,
        part="normals",
        refused={"zero": "no vectors", "nan": "not finite", "inf": "not finite"},
    ),
    Row(
        "metrics.levels",
        pictures(1),
        _offset,
        _offset_error,
        "of 1, 100 dB",
        1e-5,
        part="values",
        refused={"zero": "texels", "nan": "finite", "inf": "finite"},
    ),
    Row(
        "metrics.levels",
        _inside(3),
        _two_codes,
        _offset_error,
        "of 1, 100 dB",
        1e-5,
        part="colours",
        refused={"zero": "texels", "nan": "pixels are not finite", "inf": "pixels are not finite"},
    ),
    Row(
        "metrics.source",
        pictures(3),
        _lit,
        _lit_error,
        "of 1",
        1e-7,
        refused={"nan": "need finite numbers", "inf": "need finite numbers"},
    ),
    Row(
        "metrics.panorama",
        EVEN_SKIES,
        _darker,
        _darker_error,
        "of the light",
        1e-6,
        absent=NO_SIDES,
        refused={"zero": "no panorama", "nan": "need finite numbers", "inf": "need finite numbers"},
    ),
    Row(
        "metrics.picture",
        _inside(3),
        _flipped,
        lambda picture, made: max(made.values()),
        "FLIP",
        1e-6,
        refused=_SHOWN,
    ),
    Row(
        "metrics.texels",
        _code_planes(),
        _decoded,
        _decoded_error,
        "of 1",
        1e-7,
        absent=_WHOLE,
        refused={"zero": "a texture of 0 x 0 texels"},
    ),
    Row(
        "metrics.texels_bc7",
        {
            "zero": lambda: _mode_six(0, 1),
            "one": lambda: _mode_six(1, 2),
            "many": lambda: _mode_six(500, 3),
            "constant": lambda: _mode_six(4, 4, (50, 50)),
            "tiny": lambda: _mode_six(4, 5, (0, 0)),
            "huge": lambda: _mode_six(4, 6, (127, 127)),
            "opposite": lambda: _mode_six(4, 7, (0, 127)),
            "largest": lambda: _mode_six(2000, 8),
        },
        lambda given: decode_bc7(given[0]),
        lambda given, made: np.abs(made.astype(int) - given[1]).max(initial=0),
        "codes",
        0,
        absent=_WHOLE
        | dict.fromkeys(("parallel", "degenerate", "mirrored", "sliver"), "blocks are read one by one"),
    ),
]

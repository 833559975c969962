"""Rows of the stages and the metric of authored maps, held to numpy's longest floats and to area matrices."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.metrics.authored import true_normals, true_resized
from paradize.stages.authored import NormalCoding, decoded_normals, shares
from paradize.stages.green import guess_green
from paradize.stages.resample import placed, resized
from tests.extremes.map_rows import NOT_READ, UNIT_ONLY, VECTORS
from tests.extremes.planes import HEIGHTS, pictures, read_picture, unit_of
from tests.extremes.table import Row
from tests.pipeline import map_truth as truth

F32 = npt.NDArray[np.float32]
CODINGS = (NormalCoding(), NormalCoding(signed=True, green_down=True), NormalCoding(scale=1e6))
GAIN, OFFSET = -0.75, 1.0
NO_SIZE = {"zero": "no texels"}


def _texels(picture: F32) -> list[npt.NDArray[Any]]:
    """The picture as floats, and as codes of 8 and 16 bits."""
    inside = np.clip(picture, 0.0, 1.0)
    return [picture, np.rint(inside * 255).astype(np.uint8), np.rint(inside * 65535).astype(np.uint16)]


def _normals(picture: F32) -> list[F32]:
    read_picture(picture)
    return [decoded_normals(texels, coding) for texels in _texels(picture) for coding in CODINGS]


def _reference_normals(picture: F32) -> list[F32]:
    read_picture(picture)
    return [true_normals(texels, **vars(coding)) for texels in _texels(picture) for coding in CODINGS]


def _normal_error(picture: F32, made: list[F32]) -> float:
    """Radians, as chords, from glTF's formula in numbers of more bits."""
    wanted = []
    for texels in _texels(picture):
        codes = texels.dtype != np.float32
        top = np.iinfo(texels.dtype).max if codes else 1
        for coding in CODINGS:
            v = texels.astype(np.longdouble)
            if codes or not coding.signed:
                v = 2 * v / top - 1
            if codes:
                v[np.abs(v) < 1.5 / top] = 0
            v = v * [coding.scale, -coding.scale if coding.green_down else coding.scale, 1]
            v[:, :, 2] = np.maximum(v[:, :, 2], 0)
            black = (texels == 0).all(axis=2) & (codes | (not coding.signed))
            v[black | (v == 0).all(axis=2)] = [0, 0, 1]
            wanted.append(v / np.sqrt((v * v).sum(axis=2, keepdims=True)))
    return max(
        float(np.sqrt(((a - b) ** 2).sum(axis=2)).max(initial=0.0)) for a, b in zip(made, wanted, strict=True)
    )


def _shares(plane: F32) -> F32:
    read_picture(plane[:, :, None])
    return shares(plane, gain=GAIN, offset=OFFSET)


def _share_error(plane: F32, made: F32) -> float:
    wanted = np.clip(OFFSET + GAIN * plane.astype(np.longdouble), 0, 1)
    return float(np.abs(made - wanted).max(initial=0.0))


def _other_sizes(plane: F32) -> list[tuple[int, int]]:
    """Larger along one axis, smaller along the other; and smaller along both."""
    rows, columns = plane.shape
    return [(2 * rows + 1, -(-columns // 3)), (-(-rows // 2), max(0, columns - 1) or columns)]


def _resized(plane: F32) -> list[F32]:
    read_picture(plane[:, :, None])
    return [resized(plane, *size, (False, True)) for size in _other_sizes(plane)]


def _resize_error(plane: F32, made: list[F32]) -> float:
    wide = plane.astype(np.float64)
    wanted = [true_resized(wide, *size, (False, True)) for size in _other_sizes(plane)]
    off = max(float(np.abs(a - b).max()) for a, b in zip(made, wanted, strict=True))
    return off / max(unit_of(plane), float(np.finfo(np.float32).tiny))


ON = ((2.0, 0.25), (1.5, -0.1))  # scale and offset along u and v


def _placed_size(plane: F32) -> tuple[int, int]:
    rows, columns = plane.shape
    return -(-3 * rows // 2), 2 * columns


def _placed(plane: F32) -> F32:
    read_picture(plane[:, :, None])
    return placed(plane[:, :, None], *_placed_size(plane), ON, ("repeat", "repeat"))[:, :, 0]


def _place_error(plane: F32, made: F32) -> float:
    """From numpy's interpolation of the plane beside copies of itself."""
    sizes = _placed_size(plane)
    wanted = plane.astype(np.float64)
    for axis, (scale, offset) in ((0, ON[1]), (1, ON[0])):
        size, to = plane.shape[axis], sizes[axis]
        at = np.arange(-size, 3 * size) + 0.5
        own = ((np.arange(to) + 0.5) / to * scale + offset) * size
        beside = np.concatenate([wanted] * 4, axis=axis)
        wanted = np.apply_along_axis(lambda line, at=at, own=own: np.interp(own, at, line), axis, beside)
    return float(np.abs(made - wanted).max()) / max(unit_of(plane), float(np.finfo(np.float32).tiny))


def _reference_resized(plane: F32) -> Any:
    read_picture(plane[:, :, None])
    if not plane.size:
        raise ValueError("no texels")
    return true_resized(plane.astype(np.float64), *_other_sizes(plane)[1], (True, True))


def _reference_resize_error(plane: F32, made: Any) -> float:
    """From the shares that texels have in areas."""
    rows, columns = made.shape
    across = plane.astype(np.float64) @ truth.area_matrix(plane.shape[1], columns).T
    wanted = truth.area_matrix(plane.shape[0], rows) @ across
    return float(np.abs(made - wanted).max()) / unit_of(plane)


def _green(vectors: F32) -> list[str]:
    read_picture(vectors)
    down = vectors * np.array([1, -1, 1], np.float32)
    return [str(guess_green(vectors)), str(guess_green(down))]


def _green_error(vectors: F32, made: list[str]) -> float:
    """1 where the flipped map does not say the opposite."""
    return float(made not in (["up", "down"], ["down", "up"], ["None", "None"]))


ROWS = [
    Row(
        "stages.authored",
        pictures(3),
        _normals,
        _normal_error,
        "radians",
        1e-6,
        part="normals",
        refused=NOT_READ,
    ),
    Row("stages.authored", HEIGHTS, _shares, _share_error, "of 1", 1e-7, part="shares", refused=NOT_READ),
    Row(
        "stages.green",
        VECTORS,
        _green,
        _green_error,
        "guesses",
        0,
        absent=UNIT_ONLY,
        refused=NOT_READ,
    ),
    Row(
        "stages.resample",
        HEIGHTS,
        _resized,
        _resize_error,
        "of the largest",
        2e-7,
        refused=NO_SIZE | NOT_READ,
    ),
    Row(
        "stages.resample",
        HEIGHTS,
        _placed,
        _place_error,
        "of the largest",
        2e-7,
        part="placed",
        refused=NO_SIZE | NOT_READ,
    ),
    Row(
        "metrics.authored",
        pictures(3),
        _reference_normals,
        _normal_error,
        "radians",
        1e-6,
        part="normals",
        refused=NOT_READ,
    ),
    Row(
        "metrics.authored",
        HEIGHTS,
        _reference_resized,
        _reference_resize_error,
        "of the largest",
        1e-9,
        part="resized",
        refused=NO_SIZE | NOT_READ,
    ),
]

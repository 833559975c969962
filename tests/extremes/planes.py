"""Height fields and pictures at the extremes: the inputs of map stages and metrics."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

from paradize.errors import SourceError
from paradize.readers.image import read_image

F32 = npt.NDArray[np.float32]
SCALES = {"tiny": 1e-30, "huge": 1e30, "denormal": 1e-40}
_SIDE = 1024  # of the largest


def field(rows: int = 48, columns: int = 64) -> npt.NDArray[np.float64]:
    """Hills within -1 to 1 that repeat along both axes, float64."""
    y, x = np.mgrid[0:rows, 0:columns] * (2 * np.pi / np.array([rows, columns])[:, None, None])
    return np.asarray(0.5 * np.sin(3 * x + np.cos(2 * y)) + 0.4 * np.cos(2 * y - x), np.float64)


def with_value(values: F32, value: float) -> F32:
    """One texel replaced."""
    out = values.copy()
    out[out.shape[0] // 2, out.shape[1] // 3] = value
    return out


def heights() -> dict[str, Callable[[], F32]]:
    """Planes (h, w)."""
    slope = np.add.outer(np.arange(48.0), 0.5 * np.arange(64.0)) / 80.0
    chess = np.indices((48, 64)).sum(axis=0) % 2 * 2.0 - 1.0
    made: dict[str, Any] = {
        "zero": np.zeros((0, 0)),
        "one": np.full((1, 1), 0.5),
        "many": field(192, 256),
        "constant": np.full((48, 64), 0.7),
        "far": field() + 1e6,
        "parallel": slope,
        "opposite": chess,
        "degenerate": field(1, 64),
        "mirrored": -field()[:, ::-1],
        "sliver": field(3, 4096),
    }
    made |= {name: field() * scale for name, scale in SCALES.items()}
    out: dict[str, Callable[[], F32]] = {
        name: partial(np.ascontiguousarray, values, np.float32) for name, values in made.items()
    }
    ordinary = field().astype(np.float32)
    return out | {
        "nan": partial(with_value, ordinary, np.nan),
        "inf": partial(with_value, ordinary, np.inf),
        "largest": lambda: field(_SIDE, _SIDE).astype(np.float32),
    }


HEIGHTS: Mapping[str, Callable[[], F32]] = heights()


def unit_of(values: npt.NDArray[Any]) -> float:
    """The largest magnitude of a plane, 1 where there is none: what its errors are told in."""
    finite = np.abs(values[np.isfinite(values)].astype(np.float64))
    return float(finite.max(initial=0.0)) or 1.0


def pictures(channels: int) -> dict[str, Callable[[], F32]]:
    """Pictures (h, w, channels) of the same planes: in 0 to 1 where the extreme is not about that."""

    def picture(make: Callable[[], F32], shift: float, share: float) -> F32:
        plane = make()
        shifted = plane if not shift else (plane * np.float32(share) + np.float32(shift))
        return np.ascontiguousarray(np.stack([np.roll(shifted, 5 * c) for c in range(channels)], axis=2))

    sizes = (*SCALES, "far", "nan", "inf", "zero")  # these stay as they are
    return {
        name: partial(picture, make, 0.0 if name in sizes else 0.5, 0.45) for name, make in HEIGHTS.items()
    }


def _even(value: float, rows: int = 8) -> Callable[[], F32]:
    return lambda: np.full((rows, 2 * rows, 3), value, np.float32)


# Panoramas of one light, and why the other extremes are none of theirs.
EVEN_SKIES: Mapping[str, Callable[[], F32]] = {
    "zero": _even(1.0, 0),
    "one": _even(0.5, 1),
    "many": _even(0.3, 256),
    "constant": _even(0.7),
    "tiny": _even(1e-30),
    "huge": _even(1e30),
    "denormal": _even(1e-40),
    "nan": _even(np.nan),
    "inf": _even(np.inf),
    "largest": _even(0.3, 700),
}
NO_SIDES = dict.fromkeys(
    ("far", "parallel", "opposite", "degenerate", "mirrored", "sliver"),
    "an even sky looks alike from all sides; tests/pipeline/bakers/test_panorama.py turns others",
)


def read_picture(values: F32) -> None:
    """Raises what the reader of pictures says to a file of these texels (h, w, c), where they are not finite:
    no stage of maps sees what it refuses."""
    if np.isfinite(values).all():
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], "float")
        out = oiio.ImageOutput.create(str(path))
        assert out is not None and out.open(str(path), spec) and out.write_image(values) and out.close()
        try:
            read_image(path)
        except SourceError as error:  # the message without a folder that is another each time
            raise SourceError(error.what, place=error.place, mend=error.mend) from None

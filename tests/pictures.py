"""Comparing pictures: the two-fold rule that neither a faint drift nor a small hole survives."""

from __future__ import annotations

from pathlib import Path

import flip_evaluator
import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

TILE = 32
# Of an approved picture. Who needs the slack: other CPUs. llvmpipe takes its reciprocals from the CPU (rcpps,
# rsqrtps differ between makers), and older instruction sets move about 0.1 % of the pixels by one to three
# steps of 255.
MAX_OUTLIERS = 0.001
MAX_FLIP = 0.01
MAX_TILE_FLIP = 0.1


def load(path: Path) -> NDArray[np.float32]:
    """An 8-bit picture as (h, w, 3) float32 in 0..1, still sRGB-encoded."""
    picture = oiio.ImageBuf(str(path))
    assert not picture.has_error, picture.geterror()
    return np.ascontiguousarray(picture.get_pixels(oiio.FLOAT)[..., :3], dtype=np.float32)


def save(path: Path, pixels: NDArray[np.float32]) -> None:
    """Writes (h, w, 3) float32 in 0..1 as an 8-bit PNG."""
    picture = oiio.ImageBuf(np.ascontiguousarray(pixels, dtype=np.float32))
    assert picture.write(str(path), "uint8"), picture.geterror()


def flip_map(reference: NDArray[np.float32], test: NDArray[np.float32]) -> NDArray[np.float32]:
    """FLIP per pixel, (h, w) (Andersson et al., FLIP: A Difference Evaluator, 2020)."""
    error, _, _ = flip_evaluator.evaluate(reference, test, "LDR", applyMagma=False)
    return np.asarray(error, dtype=np.float32)[..., 0]


def worst_tile(error: NDArray[np.float32]) -> float:
    """The largest mean over 32 x 32 tiles; the mean over the picture is blind to a small hole."""
    h, w = error.shape
    tiles = error[: h - h % TILE, : w - w % TILE].reshape(h // TILE, TILE, w // TILE, TILE)
    return float(tiles.mean(axis=(1, 3)).max())


def difference(reference: Path, test: Path) -> dict[str, float]:
    """Share of pixels that differ by more than 5/255, FLIP mean, and the worst tile's FLIP."""
    a, b = load(reference), load(test)
    assert a.shape == b.shape, f"{test}: {b.shape}, reference {a.shape}"
    error = np.zeros(a.shape[:2], np.float32) if np.array_equal(a, b) else flip_map(a, b)
    outliers = (np.abs(a - b).max(axis=2) > 5.5 / 255.0).mean()
    return {"outliers": float(outliers), "flip": float(error.mean()), "tile": worst_tile(error)}


def require_like(golden: Path, rendered: Path) -> None:
    """Fails where a picture is not as a person approved it."""
    assert golden.is_file(), f"no golden picture {golden}: look at {rendered} and copy it there"
    error = difference(golden, rendered)
    message = f"{rendered} differs from {golden}: {error}"
    assert error["outliers"] <= MAX_OUTLIERS, message
    assert error["flip"] <= MAX_FLIP, message
    assert error["tile"] <= MAX_TILE_FLIP, message


def changed(a: Path, b: Path, threshold: float = 8.5 / 255.0) -> NDArray[np.bool_]:
    """(h, w): where two pictures differ by more than the threshold in any channel."""
    difference = np.abs(load(a) - load(b)).max(axis=2)
    return np.asarray(difference > threshold)

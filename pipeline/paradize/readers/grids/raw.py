"""Reads raw heights (`.raw`, `.r16`, `.r32`), as Unity, Unreal, World Machine and Gaea write them: the
numbers of a square, row by row, and nothing else.

The file says neither its size nor its order of bytes. A square of integers of 8 bits has s^2 bytes, of 16
bits 2 s^2, one of floats 4 s^2. Data that may be floats or 8 bits are floats where these have the size of
heights and neighbouring bytes differ much. Of the two orders of bytes the one counts in which neighbouring
integers differ less, or floats have the size of heights. A note says what was taken.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

_MEND = "save the heights as a PNG or TIFF of 16 bits and one grey channel, which every terrain tool writes"
_LESS = 0.5  # share of the other order's doubt that tells the order
_SMOOTH = 0.3  # of their mean: neighbours of 8 bits differ less, bytes of floats more
_KINDS = {".r16": "u2", ".r32": "f4 u2"}  # of numbers, by the file's name
_BYTES = "1 or 2 bytes (integers) or 4 (floats)"
_NORTH = "; the first row lies north, at -Z"


def read_raw(data: bytes, path: Path, max_side: int) -> Image:
    """Heights (s, s, 1): uint8 or uint16 integers, or float32 metres. Raises SourceError for data that are no
    square of 2 to max_side pixels on a side."""
    kinds = _KINDS.get(path.suffix.lower(), "f4 u2 u1").split()
    sides = {kind: math.isqrt(len(data) // int(kind[1])) for kind in kinds}
    fit = [
        kind
        for kind, side in sides.items()
        if len(data) == int(kind[1]) * side * side and 2 <= side <= max_side
    ]
    if not fit:
        what = (
            f"has {len(data)} bytes; only squares of 2 to {max_side} pixels on a side are read of raw heights"
        )
        raise SourceError(f"{what}, with {_BYTES} a pixel", file=path, mend=_MEND)
    letters = fit[-1] if len(fit) > 1 and _is_of_8_bits(data, sides) else fit[0]
    side = sides[letters]
    low, high = (np.frombuffer(data, order + letters).reshape(side, side) for order in "<>")
    note = f"raw heights, read as {side} x {side} "
    if letters == "u1":
        note += "unsigned integers of 8 bits (guessed from its size and its numbers)"
        return Image(low[:, :, None].copy(), "data", 8, 255, notes=(note + _NORTH,))
    doubt = _doubt(low), _doubt(high)
    swapped = doubt[1] < _LESS * doubt[0]
    note += "floats (metres)" if letters == "f4" else "unsigned integers of 16 bits"
    sure = swapped or doubt[0] < _LESS * doubt[1]
    why = "guessed from its size and its numbers" if sure else "guessed from its size; the order is not sure"
    note += f", {'high' if swapped else 'low'} byte first ({why}){_NORTH}"
    values = (high if swapped else low)[:, :, None]
    if letters == "f4":
        return Image(values.astype(np.float32), "data", 32, notes=(note,))
    return Image(values.astype(np.uint16), "data", 16, 65535, notes=(note,))


def _is_of_8_bits(data: bytes, sides: dict[str, int]) -> bool:
    """Whether numbers that may be floats are rather integers of 8 bits. sides: of the squares."""
    floats = (np.frombuffer(data, order + "f4").reshape(sides["f4"], -1) for order in "<>")
    if min(map(_doubt, floats)) > _LESS:
        return True
    rows = _sampled(np.frombuffer(data, np.uint8).reshape(sides["u1"], -1))
    return bool(np.abs(np.diff(rows, axis=1)).sum() < _SMOOTH * rows.sum())


def _sampled(values: npt.NDArray[np.generic]) -> npt.NDArray[np.float64]:
    """Some 64 rows."""
    with np.errstate(invalid="ignore"):  # floats in the wrong order may be signalling NaN
        return values[:: max(1, len(values) // 64)].astype(np.float64)


def _doubt(values: npt.NDArray[np.generic]) -> float:
    """How little numbers look like heights: of integers the mean difference of neighbours in a row as a share
    of their range, of floats other than 0 and NaN the share that has no size that heights have."""
    rows = _sampled(values)
    if values.dtype.kind == "f":
        sizes = np.abs(rows[np.isfinite(rows) & (rows != 0.0)])
        return float(((sizes < 1e-6) | (sizes > 1e7)).sum() / max(sizes.size, 1))
    return float(np.abs(np.diff(rows, axis=1)).mean() / max(np.ptp(rows), 1.0))

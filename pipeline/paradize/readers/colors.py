"""Colours of vertices and faces as files write them, read as linear light."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.kernels.math import srgb_to_linear

if TYPE_CHECKING:
    import numpy.typing as npt

_CODES, _WIDE_CODES = 255.0, 65535.0  # what stands for 1 in colours of 8 and of 16 bits


def linear_colors(
    rows: npt.NDArray[Any], kinds: Sequence[str], what: str, path: Path, warnings: list[str]
) -> npt.NDArray[np.float32]:
    """Colours of a file (n, 3), or with alpha (n, 4), as linear light with alpha (n, 4). Those who write them
    (Blender, MeshLab) write sRGB; alpha is linear. kinds: numpy's code of each column. what: names them.

    Whole numbers up to 255 of floats and of wide types are codes of 8 bits, as scripts write them; a warning
    says so. Values outside 0..1 stay: the baker clamps them, and says so.
    """
    tops = np.ones(len(kinds), rows.dtype)
    told = 0.0
    for name, columns in ((what, slice(0, 3)), (f"the alpha of {what}", slice(3, 4))):
        for kind in dict.fromkeys(kinds[columns]):
            own = np.array([k for k in range(len(kinds))[columns] if kinds[k] == kind])
            tops[own], note = _top(rows[:, own], kind)
            if note and tops[own[0]] != told:
                warnings.append(f"{path}: {name} {note}")
                told = float(tops[own[0]])
    colors = np.ones((len(rows), 4), np.float32)
    colors[:, : len(kinds)] = rows / tops
    rgb = colors[:, :3]
    encoded = (rgb > 0.0) & (rgb < 1.0)
    rgb[encoded] = srgb_to_linear(rgb[encoded])
    return colors


def _top(values: npt.NDArray[Any], kind: str) -> tuple[float, str]:
    """The number that stands for 1 in values of a type, and a note where it is not the largest of the type (1
    of floats)."""
    declared = float(np.iinfo(kind).max) if kind[0] in "iu" else 1.0
    largest = float(values.max(initial=0.0))
    whole = bool((values >= 0.0).all() and (values == np.rint(values)).all())
    narrow = kind[1] == "1" and largest <= declared
    if kind[0] in "iu" and 0.0 < largest <= 1.0 and not (narrow and whole):
        return 1.0, f"are numbers up to {largest:g} of {declared:g}; read as shares of 1"
    if whole and not narrow and largest > 1.0:
        for top in (_CODES, _WIDE_CODES):
            if largest <= top and (top == _CODES or top < declared):
                return top, f"are whole numbers up to {largest:g}; read as codes, {top:g} is 1"
    return declared, ""

"""A plane or vectors at another size: area means where it becomes smaller, as mips are made, and between
texels what a sampler shows where it becomes larger (linear along both axes, between texel centres)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.material import Placed, Wrap, texels_within
from paradize.stages.sweep import bands_of, run

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    Taps = list[tuple[npt.NDArray[np.int64], F64]]

_ON_TEXEL = 1e-6  # texels


def resized(values: F32, rows: int, columns: int, wrap: tuple[bool, bool]) -> F32:
    """Values (h, w) or (h, w, c), finite, at rows x columns texels. wrap: whether they repeat along (x, y);
    otherwise the texel at the edge continues beyond it. Raises ValueError where there is no texel."""
    if min(*values.shape[:2], rows, columns) < 1:
        raise ValueError(f"no texels of {values.shape[1]} x {values.shape[0]} at {columns} x {rows}")
    down, across = _taps(values.shape[0], rows, wrap[1]), _taps(values.shape[1], columns, wrap[0])
    out = np.empty((rows, columns, *values.shape[2:]), np.float32)
    rest = (1,) * (values.ndim - 2)

    def work(band: tuple[int, int]) -> None:
        part = slice(*band)
        lines = sum(
            values[at[part]].astype(np.float64) * share[part].reshape(-1, 1, *rest) for at, share in down
        )
        assert isinstance(lines, np.ndarray)
        texels = sum(lines[:, at] * share.reshape(-1, *rest) for at, share in across)
        out[part] = texels

    run(work, bands_of(rows, max(columns, values.shape[1])))
    return out


def _taps(size: int, to: int, wrap: bool) -> Taps:
    """The weights with which each of `to` texels is made from `size`: pairs of (index, share), each (to,)."""
    ratio = size / to
    places = np.arange(to, dtype=np.float64)
    if ratio <= 1.0:
        centre = (places + 0.5) * ratio - 0.5
        first = np.floor(centre).astype(np.int64)
        part = centre - first
        found = [(first, 1.0 - part), (first + 1, part)]
    else:
        begin, end = places * ratio, (places + 1.0) * ratio
        first = np.floor(begin).astype(np.int64)
        found = []
        for k in range(int(np.ceil(ratio)) + 1):
            inside = np.minimum(end, first + k + 1.0) - np.maximum(begin, first + k)
            found.append((first + k, np.maximum(inside, 0.0) / ratio))
    return [(at % size if wrap else np.clip(at, 0, size - 1), share) for at, share in found]


def placed(values: F32, rows: int, columns: int, on: Placed, wrap: tuple[Wrap, Wrap]) -> F32:
    """Resamples values (h, w, c), finite, at rows x columns places of other texture coordinates: its own are
    scale * t + offset of their t, 0..1. on: (scale, offset) along u and v. wrap: what lies beyond the edges.
    Texels that fall on each other are kept as they are. Raises ValueError where there is no texel."""
    if min(*values.shape[:2], rows, columns) < 1:
        raise ValueError(f"no texels of {values.shape[1]} x {values.shape[0]} at {columns} x {rows}")
    down = _placed_taps(values.shape[0], rows, on[1], wrap[1])
    across = _placed_taps(values.shape[1], columns, on[0], wrap[0])
    out = np.empty((rows, columns, values.shape[2]), np.float32)

    def work(band: tuple[int, int]) -> None:
        part = slice(*band)
        lines = sum(values[at[part]].astype(np.float64) * share[part].reshape(-1, 1, 1) for at, share in down)
        assert isinstance(lines, np.ndarray)
        texels = sum(lines[:, at] * share.reshape(-1, 1) for at, share in across)
        out[part] = texels

    run(work, bands_of(rows, max(columns, values.shape[1])))
    return out


def _placed_taps(size: int, to: int, on: tuple[float, float], wrap: Wrap) -> Taps:
    centre = ((np.arange(to, dtype=np.float64) + 0.5) / to * on[0] + on[1]) * size - 0.5
    near = np.rint(centre)
    centre = np.where(np.abs(centre - near) < _ON_TEXEL, near, centre)
    first = np.floor(centre)
    part = centre - first
    return [(texels_within(first + k, size, wrap), share) for k, share in ((0.0, 1.0 - part), (1.0, part))]

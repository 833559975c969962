"""The loss of loading: float32 positions of a mesh, with its origin, against the numbers in the file's text.

The reference is each decimal of the text as the nearest float64. If coordinates are so large relative to the
model that this rounding matters, one float64 step is added to the error. The kernel shares no code with the
reader or a stage (`reference/loading.hpp`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, SourcePositions, rounded, rounded_up
from paradize.kernels.reference import loading
from paradize.vectors import lengths

# The rounding of the text to float64 is added above this share of the diagonal; six digits hide less.
_TEXT_ROUNDING = 1e-10
# Rounding that moves a vertex by more than this share of the diagonal is reported.
MAX_LOSS = 1e-6
# The same for a connected part and its own diagonal. Models near the origin lose at most a third of it.
MAX_PART_LOSS = 1e-4


@dataclass(frozen=True)
class Part:
    """The loss of a connected part: the largest distance of a vertex from its source position, in metres
    (largest_m) and relative to the part's diagonal (largest). triangle: the first of the part."""

    largest_m: float
    largest: float
    triangle: int


@dataclass(frozen=True)
class LoadingError:
    """largest_m, largest: largest distance of a vertex from its source position, in metres and relative to
    the diagonal of the source positions that triangles use. turned_p99_deg: 99th percentile over the area of
    the angle by which normals turned. collapsed, first_collapsed: triangles with an area in the source and
    none in the mesh, their number and the first. coordinate_m: the largest coordinate of the source. part:
    the part with the largest relative loss, if above MAX_PART_LOSS."""

    largest_m: float
    largest: float
    turned_p99_deg: float
    collapsed: int
    first_collapsed: int | None
    coordinate_m: float
    part: Part

    @property
    def errors(self) -> dict[str, float]:
        """The errors by the names of the report."""
        return {
            "load_max": rounded_up(self.largest),
            "load_max_m": rounded_up(self.largest_m),
            "load_normal_p99_deg": rounded(self.turned_p99_deg),
        }


def loaded(mesh: Mesh, source: SourcePositions) -> LoadingError:
    """Measures a mesh as it was read, before any stage. source: the positions of its file."""
    error = loading(mesh.positions, mesh.origin, source.positions, mesh.triangles)
    firsts = [source.first_merged] * bool(source.merged) + [error.first_collapsed] * bool(error.collapsed)
    low, high = np.array(error.low), np.array(error.high)
    diagonal = _length(high - low)
    extent = np.maximum(np.abs(low), np.abs(high))
    rounding = _length(np.spacing(extent))
    largest_m = error.most + (rounding if rounding > _TEXT_ROUNDING * diagonal else 0.0)
    return LoadingError(
        largest_m=largest_m,
        largest=largest_m / diagonal if diagonal > 0.0 else 0.0,
        turned_p99_deg=error.turned_p99_deg,
        collapsed=error.collapsed + source.merged,
        first_collapsed=min(firsts, default=None),
        coordinate_m=float(extent.max()),
        part=_worst_part(mesh, source),
    )


def _worst_part(mesh: Mesh, source: SourcePositions) -> Part:
    corners = mesh.triangles.T
    off = (mesh.positions.astype(np.float64) + np.asarray(mesh.origin)) - source.positions
    gap = lengths(off)
    ends = [source.positions[corner] for corner in corners]
    longest = np.maximum(lengths(ends[1] - ends[0]), lengths(ends[2] - ends[0]))
    if (gap[mesh.triangles].max(axis=1) <= MAX_PART_LOSS * longest).all():
        return Part(0.0, 0.0, 0)  # sufficient: a part is at least as large as its triangles
    part = _parts(mesh.triangles, len(gap))[corners[0]]
    largest = np.zeros(len(gap))
    low, high = np.full((len(gap), 3), np.inf), np.full((len(gap), 3), -np.inf)
    for corner, end in zip(corners, ends, strict=True):
        np.maximum.at(largest, part, gap[corner])
        np.minimum.at(low, part, end)
        np.maximum.at(high, part, end)
    used = np.unique(part)
    size = lengths(high[used] - low[used])
    share = largest[used] / np.where(size > 0.0, size, np.inf)
    worst = used[int(share.argmax())]
    return Part(float(largest[worst]), float(share.max()), int(np.argmax(part == worst)))


def _parts(triangles: npt.NDArray[np.uint32], vertices: int) -> npt.NDArray[np.intp]:
    """(n,): a label for each vertex, equal for all vertices that triangles connect."""
    labels = np.arange(vertices)
    while True:
        smallest = labels[triangles].min(axis=1)
        if (labels[triangles] == smallest[:, None]).all():
            return labels
        for corner in triangles.T:  # the labelled vertex is connected as well
            np.minimum.at(labels, labels[corner], smallest)
        while (labels[labels] != labels).any():
            labels = labels[labels]


def _length(v: npt.NDArray[np.float64]) -> float:
    x, y, z = (float(part) for part in v)
    return math.sqrt(x * x + y * y + z * z)


def loading_warnings(error: LoadingError, lines: npt.NDArray[np.uint32] | None) -> list[str]:
    """Warnings about the loss. lines: (m,) line of each triangle in the file; None where it has no lines."""

    def place(triangle: int) -> str:
        return f"triangle {triangle}" if lines is None else f"line {int(lines[triangle])}"

    cause = f"coordinates reach {error.coordinate_m:g} m, and rounding moves vertices"
    text = f"{cause} by up to {error.largest_m:.3g} m ({error.largest:.2g} of the diagonal)"
    if not error.collapsed and error.largest <= MAX_LOSS:
        part = error.part
        if part.largest <= MAX_PART_LOSS:
            return []
        text = f"{cause} of the part at {place(part.triangle)} by up to {part.largest_m:.3g} m "
        text += f"({part.largest:.2g} of its own diagonal)"
    if error.first_collapsed is not None:
        first = place(error.first_collapsed)
        text += f"; {error.collapsed} triangles lose their area (first: {first})"
    return [f"{text}; move distant parts into separate files, or nearer to the origin"]

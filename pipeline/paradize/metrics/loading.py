"""What loading cost: the float32 positions of a mesh, at their place, against those in the file's text.

The reference is the text as float64 numbers, each the nearest to its decimal; where coordinates are
so large beside the model that this rounding counts, a step of them is in the figure too. The kernel shares no
code with the reader or a stage (`reference/loading.hpp`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, SourcePlaces, six, six_up
from paradize.kernels.reference import loading

# Above this share of the diagonal the rounding of the text to float64 is counted: below, six digits hide it.
_TEXT_ROUNDING = 1e-10
# Rounding that moves a vertex by more than this share of the diagonal is reported.
KEPT = 1e-6
# The same of a connected part and its diagonal; parts of models near the origin lose a third of it at most.
PART_KEPT = 1e-4


@dataclass(frozen=True)
class Part:
    """A connected part: how far one of its vertices lies at most from its place in the text, in metres and of
    the part's own diagonal; its first triangle."""

    largest_m: float
    largest: float
    triangle: int


@dataclass(frozen=True)
class Loaded:
    """largest_m, largest: how far a vertex lies at most from its place in the text, in metres and of the
    diagonal of the box of the text's positions that triangles use. turned_p99_deg: 99 % of the surface was
    turned by no more. collapsed: triangles with an area in the text and none as loaded, and the first.
    coordinate_m: the largest in the text. part: the part that lost most for its size, if PART_KEPT."""

    largest_m: float
    largest: float
    turned_p99_deg: float
    collapsed: int
    first_collapsed: int | None
    coordinate_m: float
    part: Part

    @property
    def errors(self) -> dict[str, float]:
        """By the names of the report."""
        return {
            "load_max": six_up(self.largest),
            "load_max_m": six_up(self.largest_m),
            "load_normal_p99_deg": six(self.turned_p99_deg),
        }


def loaded(mesh: Mesh, text: SourcePlaces) -> Loaded:
    """mesh: as it was read, before anything was done to it."""
    found = loading(mesh.positions, mesh.origin, text.places, mesh.triangles)
    firsts = [text.first_merged] * bool(text.merged) + [found.first_collapsed] * bool(found.collapsed)
    low, high = np.array(found.low), np.array(found.high)
    diagonal = _length(high - low)
    reach = np.maximum(np.abs(low), np.abs(high))
    rounding = _length(np.spacing(reach))
    most = found.most + (rounding if rounding > _TEXT_ROUNDING * diagonal else 0.0)
    return Loaded(
        largest_m=most,
        largest=most / diagonal if diagonal > 0.0 else 0.0,
        turned_p99_deg=found.turned_p99_deg,
        collapsed=found.collapsed + text.merged,
        first_collapsed=min(firsts, default=None),
        coordinate_m=float(reach.max()),
        part=_worst_part(mesh, text),
    )


def _worst_part(mesh: Mesh, text: SourcePlaces) -> Part:
    corners = mesh.triangles.T
    off = (mesh.positions.astype(np.float64) + np.asarray(mesh.origin)) - text.places
    gap = _lengths(off)
    ends = [text.places[corner] for corner in corners]
    longest = np.maximum(_lengths(ends[1] - ends[0]), _lengths(ends[2] - ends[0]))
    if (gap[mesh.triangles].max(axis=1) <= PART_KEPT * longest).all():
        return Part(0.0, 0.0, 0)  # a part is at least as large as its triangles
    part = _parts(mesh.triangles, len(gap))[corners[0]]
    most = np.zeros(len(gap))
    low, high = np.full((len(gap), 3), np.inf), np.full((len(gap), 3), -np.inf)
    for corner, end in zip(corners, ends, strict=True):
        np.maximum.at(most, part, gap[corner])
        np.minimum.at(low, part, end)
        np.maximum.at(high, part, end)
    used = np.unique(part)
    size = _lengths(high[used] - low[used])
    share = most[used] / np.where(size > 0.0, size, np.inf)
    worst = used[int(share.argmax())]
    return Part(float(most[worst]), float(share.max()), int(np.argmax(part == worst)))


def _parts(triangles: npt.NDArray[np.uint32], vertices: int) -> npt.NDArray[np.intp]:
    """(n,): of each vertex one that stands for all that triangles tie to it."""
    known = np.arange(vertices)
    while True:
        least = known[triangles].min(axis=1)
        if (known[triangles] == least[:, None]).all():
            return known
        for corner in triangles.T:  # what stands for a corner is tied too
            np.minimum.at(known, known[corner], least)
        while (known[known] != known).any():
            known = known[known]


def _lengths(v: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.sqrt(v[:, 0] * v[:, 0] + v[:, 1] * v[:, 1] + v[:, 2] * v[:, 2])


def _length(v: npt.NDArray[np.float64]) -> float:
    x, y, z = (float(part) for part in v)
    return math.sqrt(x * x + y * y + z * z)


def loading_messages(found: Loaded, lines: npt.NDArray[np.uint32]) -> list[str]:
    """What a person must know of it, in sentences. lines: (m,) of each triangle in the file."""
    where = f"coordinates reach {found.coordinate_m:g} m, and rounding moves vertices"
    told = f"{where} by up to {found.largest_m:.3g} m ({found.largest:.2g} of the diagonal)"
    if not found.collapsed and found.largest <= KEPT:
        part = found.part
        if part.largest <= PART_KEPT:
            return []
        line = int(lines[part.triangle])
        told = (
            f"{where} of the part at line {line} by up to {part.largest_m:.3g} m ({part.largest:.2g} of its "
        )
        told += "own diagonal)"
    if found.first_collapsed is not None:
        first = f"line {int(lines[found.first_collapsed])}"
        told += f"; {found.collapsed} triangles lose their area by it (first: {first})"
    return [f"{told}; move parts that lie far apart into files of their own, or nearer to the origin"]

"""What loading cost: the float32 positions of a mesh, at their place, against those in the file's text.

The reference is the text as float64 numbers, each the nearest to its decimal; where coordinates are
so large beside the model that this rounding counts, a step of them is in the figure too. The kernel shares no
code with the reader or a stage (`reference_loading.hpp`).
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
# DESIGN's promise: more than this share of the diagonal is told.
KEPT = 1e-6


@dataclass(frozen=True)
class Loaded:
    """largest_m, largest: how far a vertex lies at most from its place in the text, in metres and of the
    diagonal of the box of the text's positions that triangles use. turned_p99_deg: 99 % of the surface was
    turned by no more. collapsed: triangles with an area in the text and none as loaded, and the first.
    coordinate_m: the largest in the text."""

    largest_m: float
    largest: float
    turned_p99_deg: float
    collapsed: int
    first_collapsed: int | None
    coordinate_m: float

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
    )


def _length(v: npt.NDArray[np.float64]) -> float:
    x, y, z = (float(part) for part in v)
    return math.sqrt(x * x + y * y + z * z)


def loading_messages(found: Loaded, lines: npt.NDArray[np.uint32]) -> list[str]:
    """What a person must know of it, in sentences. lines: (m,) of each triangle in the file."""
    if not found.collapsed and found.largest <= KEPT:
        return []
    where = f"coordinates reach {found.coordinate_m:g} m, and rounding moves vertices by up to "
    told = f"{where}{found.largest_m:.3g} m ({found.largest:.2g} of the diagonal)"
    if found.first_collapsed is not None:
        first = f"line {int(lines[found.first_collapsed])}"
        told += f"; {found.collapsed} triangles lose their area by it (first: {first})"
    return [f"{told}; move parts that lie far apart into files of their own, or nearer to the origin"]

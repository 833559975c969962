"""Which metrics of a budget a bake can measure, known before it bakes anything."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from paradize.scene.budget import METRICS

# The first words of the metrics that the products of a maker have; maps have those of their own names.
_OWNERS = {
    "mesh": ("surface", "load", "lod", "uv_shift", "tangent"),
    "terrain": ("terrain",),
    "color": ("color", "alpha"),
    "cubemap": ("sky",),
    "flight": ("path",),
}


def measured_by(baker: str, products: Iterable[str], settings: Mapping[str, Any]) -> set[str]:
    """The metrics that a maker ("mesh", "maps", ...) measures of these products."""
    owners = [*_OWNERS.get(baker, ()), *(products if baker == "maps" else ())]
    if settings.get("quantise") not in (None, False):
        owners.append("quantise")
    return {metric for metric in METRICS if metric.startswith(tuple(f"{owner}_" for owner in owners))}


def of_single_files(metrics: Collection[str]) -> set[str]:
    """Those that one file alone can have: `lod_mapped_*` needs the scene, which has the normal map."""
    return {metric for metric in metrics if not metric.startswith("lod_mapped_")}


def unmeasured(budget: Iterable[str], known: Collection[str]) -> tuple[list[str], str]:
    """The metrics that nothing measures, and how to mend that, in words."""
    mend = f"leave it out, or limit one of {', '.join(metric for metric in METRICS if metric in known)}"
    return [metric for metric in dict.fromkeys(budget) if metric not in known], mend

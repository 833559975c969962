"""Lists the metrics that a bake can measure, before anything is baked."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from paradize.bakers.registry import BUDGET_FORMATS
from paradize.scene.budget import METRICS

# First words of the metrics that a baker measures. The metrics of maps begin with the map's name.
_OWNERS = {
    "mesh": ("surface", "load", "lod", "uv_shift", "tangent"),
    "terrain": ("terrain",),
    "cubemap": ("sky",),
    "occlusion": ("occlusion",),
    "flight": ("path",),
}
# Of normals that are derived from heights alone.
_OF_SLOPES = {metric for metric in METRICS if metric.startswith(("normal_filter_", "normal_open_"))}

# Of occlusion that is cast from a mesh alone.
_OF_RAYS = {metric for metric in METRICS if metric.startswith("occlusion_cast_")}


def measured_by(baker: str, products: Iterable[str], settings: Mapping[str, Any]) -> set[str]:
    """Returns the metrics that a baker ("mesh", "maps", ...) measures for these products."""
    maps = [*products] if baker in BUDGET_FORMATS else []
    owners = [*_OWNERS.get(baker, ()), *maps, *(["alpha"] if "color" in maps else [])]
    if settings.get("quantise") not in (None, False):
        owners.append("quantise")
    known = {metric for metric in METRICS if metric.startswith(tuple(f"{owner}_" for owner in owners))}
    if baker == "authored":
        known -= _OF_SLOPES
        if not settings.get("occlusion_cast"):
            known -= _OF_RAYS
    return known


def of_single_files(metrics: Collection[str]) -> set[str]:
    """The metrics that one file alone can have: `lod_mapped_*` and `lod_seen_*` need a scene's maps."""
    return {metric for metric in metrics if not metric.startswith(("lod_mapped_", "lod_seen_"))}


def unmeasured(budget: Iterable[str], known: Collection[str]) -> tuple[list[str], str]:
    """Returns the metrics that nothing measures, and how to mend that, as text."""
    mend = f"leave it out, or limit one of {', '.join(metric for metric in METRICS if metric in known)}"
    return [metric for metric in dict.fromkeys(budget) if metric not in known], mend

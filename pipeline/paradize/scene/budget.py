"""What may be limited: the metrics with their units, and which errors are beyond a scene's limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from paradize.maps import MAPS
from paradize.scene.schema import Limit, Limits

FAR = 1e6

METRICS = {
    "surface_max": Limit("of the diagonal", True, 1.0, "bound of the two-sided surface distance of a LOD"),
    "surface_rms": Limit("of the diagonal", True, 1.0, "RMS of the two-sided surface distance of a LOD"),
    "load_max": Limit("of the diagonal", True, 1.0, "how far float32 moved a vertex of the source, at most"),
    "load_max_m": Limit("m", True, FAR, "the same in metres"),
    "load_normal_p99_deg": Limit("degrees", True, 180.0, "99 % of the source's surface it turned by no more"),
    "tangent_max_deg": Limit("degrees", True, 180.0, "largest angle of a tangent from MikkTSpace's"),
    "tangent_p99_deg": Limit("degrees", True, 180.0, "99 of 100 tangents are this near to MikkTSpace's"),
    "tangent_mean_deg": Limit("degrees", True, 180.0, "mean angle of the tangents from MikkTSpace's"),
    "lod_normal_p99_deg": Limit("degrees", True, 180.0, "99 of 100 normals of a LOD are this near"),
    "lod_normal_mean_deg": Limit("degrees", True, 180.0, "mean angle of a LOD's normals from the mesh's"),
    "lod_mapped_p99_deg": Limit("degrees", True, 180.0, "99 of 100, turned by the normal map, are this near"),
    "lod_mapped_mean_deg": Limit("degrees", True, 180.0, "mean angle of a LOD's normals turned by the map"),
    "quantise_max": Limit("of the diagonal", True, 1.0, "how far 16-bit positions moved a vertex, at most"),
    "quantise_max_m": Limit("m", True, FAR, "the same in metres"),
    "quantise_normal_max_deg": Limit("degrees", True, 180.0, "how far codes turned a vertex's normal"),
    "quantise_tangent_max_deg": Limit("degrees", True, 180.0, "how far codes turned a vertex's tangent"),
    "quantise_uv_max": Limit("of the side", True, 1.0, "how far codes moved a texture along a side, at most"),
    "uv_shift_max": Limit("of the diagonal", True, 1.0, "largest slide of a LOD's texture that samples find"),
    "uv_shift_p99": Limit("of the diagonal", True, 1.0, "99 of 100 places of a LOD's texture slid less"),
    "terrain_max_m": Limit("m", True, FAR, "largest vertical distance of the terrain from its heightmap"),
    "terrain_rms_m": Limit("m", True, FAR, "RMS of the vertical distance of the terrain from its heightmap"),
    "normal_p99_deg": Limit("degrees", True, 180.0, "99 of 100 normals are this near to the true slopes'"),
    "normal_mean_deg": Limit("degrees", True, 180.0, "mean angle of the normals from the true slopes'"),
    "normal_max_deg": Limit("degrees", True, 180.0, "largest angle of a normal from the true slopes'"),
    "normal_filter_deg": Limit("degrees", True, 180.0, "what the slope filter alone costs, on average"),
    "normal_filter_p99_deg": Limit("degrees", True, 180.0, "99 of 100 normals it costs no more"),
    "normal_filter_max_deg": Limit("degrees", True, 180.0, "the most that it costs a normal"),
    "normal_open_deg": Limit("degrees", True, 180.0, "what the source's half steps leave open, on average"),
    "normal_open_p99_deg": Limit("degrees", True, 180.0, "of 99 of 100 normals they leave no more open"),
    "normal_open_max_deg": Limit("degrees", True, 180.0, "the most that they leave open of a normal"),
    "dudv_p99_deg": Limit("degrees", True, 180.0, "99 of 100 du/dv texels are this near to the reference"),
    "dudv_mean_deg": Limit("degrees", True, 180.0, "mean angle of the du/dv texels from the reference"),
    "dudv_max_deg": Limit("degrees", True, 180.0, "largest angle of a du/dv texel from the reference"),
    **{
        f"{name}_psnr_db": Limit("dB", False, 1000.0, f"PSNR of a {one.label} texture against its reference")
        for name, one in MAPS.items()
        if not one.is_direction
    },
    "alpha_psnr_db": Limit("dB", False, 1000.0, "PSNR of a texture's alpha against its source"),
    "gloss_width_p99_deg": Limit("degrees", True, 33.0, "99 of 100 highlights are this near in width"),
    "gloss_width_mean_deg": Limit("degrees", True, 33.0, "mean error of a highlight's half-width"),
    "gloss_width_max_deg": Limit("degrees", True, 33.0, "largest error of a highlight's half-width"),
    "sky_max_relative": Limit("of the texel", True, 1.0, "largest error of a sky texel"),
    "path_miss_m": Limit("m", True, FAR, "farthest that the camera passes from a waypoint"),
    "path_ripple_max": Limit("of the speed", True, 10.0, "largest deviation of 20,000 moments' speed"),
    "path_ripple_p99": Limit("of the speed", True, 10.0, "99 of 100 moments deviate less"),
    "path_time_s": Limit("s", True, FAR, "deviation from the asked duration"),
    "folder_mb": Limit("MB", True, FAR, "the files of all artifacts together"),
    "gpu_mb": Limit("MB", True, FAR, "what textures and meshes take on the device, all resident"),
}


@dataclass(frozen=True)
class Excess:
    """An error beyond its limit. hard: whether that fails a check; else it warns."""

    metric: str
    value: float
    limit: float
    hard: bool

    def __str__(self) -> str:
        kind = "" if self.hard else "soft "
        return f"{self.metric} is {self.value:g} {METRICS[self.metric].unit}, {kind}budget {self.limit:g}"


def is_beyond(metric: str, value: float, limit: float) -> bool:
    """Whether a metric's value is worse than a limit."""
    return value > limit if METRICS[metric].less_is_better else value < limit


def excesses(budget: Limits, errors: Mapping[str, float]) -> list[Excess]:
    """The errors beyond their hard limit, else beyond their soft one; in the budget's order."""
    found = []
    for metric in dict.fromkeys((*budget.hard, *budget.soft)):
        for limits, hard in ((budget.hard, True), (budget.soft, False)):
            if metric in errors and metric in limits and is_beyond(metric, errors[metric], limits[metric]):
                found.append(Excess(metric, errors[metric], limits[metric], hard))
                break
    return found

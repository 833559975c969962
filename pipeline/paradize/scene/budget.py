"""The metrics that a budget may limit, with units and meanings, and the errors that exceed a budget."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from paradize.map_table import MAPS
from paradize.scene.schema import FAR, Limit, Limits

METRICS = {
    "surface_max": Limit(
        "of the diagonal", True, 1.0, "largest distance between a level of detail and the source, both ways"
    ),
    "surface_rms": Limit(
        "of the diagonal", True, 1.0, "RMS distance between a level of detail and the source, both ways"
    ),
    "load_max": Limit("of the diagonal", True, 1.0, "how far float32 moved a vertex of the source"),
    "load_max_m": Limit("m", True, FAR, "how far float32 moved a vertex of the source"),
    "load_normal_p99_deg": Limit(
        "degrees", True, 180.0, "how far float32 turned a normal, for 99 % of the surface"
    ),
    "tangent_max_deg": Limit("degrees", True, 180.0, "largest angle between a tangent and MikkTSpace's"),
    "tangent_p99_deg": Limit(
        "degrees", True, 180.0, "angle between a tangent and MikkTSpace's, for 99 of 100 corners"
    ),
    "tangent_mean_deg": Limit("degrees", True, 180.0, "mean angle between the tangents and MikkTSpace's"),
    "lod_normal_p99_deg": Limit(
        "degrees", True, 180.0, "angle between a level's normals and the source's, for 99 % of the surface"
    ),
    "lod_normal_mean_deg": Limit(
        "degrees", True, 180.0, "mean angle between a level's normals and the source's"
    ),
    "lod_mapped_p99_deg": Limit(
        "degrees",
        True,
        180.0,
        "angle between a level's and the source's normals under the normal map, for 99 % of the surface",
    ),
    "lod_mapped_mean_deg": Limit(
        "degrees", True, 180.0, "mean angle between a level's and the source's normals under the normal map"
    ),
    "lod_seen_p99_deg": Limit(
        "degrees",
        True,
        180.0,
        "angle between a level's and the finest level's normals as pixels show them where it takes over, for "
        "99 % of what it covers",
    ),
    "lod_seen_mean_deg": Limit(
        "degrees", True, 180.0, "mean angle of normals as pixels show them where a level takes over"
    ),
    "lod_seen_silhouette": Limit(
        "of its box", True, 1.0, "pixels that only one of a level and the finest covers, where it takes over"
    ),
    "lod_seen_flip": Limit(
        "FLIP", True, 1.0, "what the switch to a level changes of its box, where the level takes over"
    ),
    "quantise_max": Limit("of the diagonal", True, 1.0, "how far 16-bit positions moved a vertex"),
    "quantise_max_m": Limit("m", True, FAR, "how far 16-bit positions moved a vertex"),
    "quantise_normal_max_deg": Limit("degrees", True, 180.0, "how far quantisation turned a vertex normal"),
    "quantise_tangent_max_deg": Limit("degrees", True, 180.0, "how far quantisation turned a vertex tangent"),
    "quantise_uv_max": Limit(
        "of the image's side", True, 1.0, "how far quantisation moved a texture coordinate"
    ),
    "uv_shift_max": Limit(
        "of the diagonal", True, 1.0, "how far the texture slides on a level, the largest of the samples"
    ),
    "uv_shift_p99": Limit(
        "of the diagonal", True, 1.0, "how far the texture slides on a level, for 99 of 100 samples"
    ),
    "terrain_max_m": Limit("m", True, FAR, "largest vertical distance between terrain and heightmap"),
    "terrain_rms_m": Limit("m", True, FAR, "RMS of the vertical distance between terrain and heightmap"),
    "normal_p99_deg": Limit(
        "degrees", True, 180.0, "angle between baked and true normals, for 99 of 100 texels"
    ),
    "normal_mean_deg": Limit("degrees", True, 180.0, "mean angle between baked and true normals"),
    "normal_max_deg": Limit("degrees", True, 180.0, "largest angle between a baked and the true normal"),
    "normal_filter_deg": Limit("degrees", True, 180.0, "mean angle that the slope filter alone adds"),
    "normal_filter_p99_deg": Limit(
        "degrees", True, 180.0, "angle that the slope filter alone adds, for 99 of 100 texels"
    ),
    "normal_filter_max_deg": Limit("degrees", True, 180.0, "largest angle that the slope filter alone adds"),
    "normal_open_deg": Limit(
        "degrees", True, 180.0, "mean angle that the source's 8 or 16 bits leave undecided"
    ),
    "normal_open_p99_deg": Limit(
        "degrees", True, 180.0, "angle that the source's 8 or 16 bits leave undecided, for 99 of 100 texels"
    ),
    "normal_open_max_deg": Limit(
        "degrees", True, 180.0, "largest angle that the source's 8 or 16 bits leave undecided"
    ),
    "dudv_p99_deg": Limit("degrees", True, 180.0, "angle between baked and true du/dv, for 99 of 100 texels"),
    "dudv_mean_deg": Limit("degrees", True, 180.0, "mean angle between baked and true du/dv"),
    "dudv_max_deg": Limit("degrees", True, 180.0, "largest angle between baked and true du/dv"),
    **{
        f"{name}_psnr_db": Limit(
            "dB", False, 1000.0, f"PSNR of the {material_map.label} map against its source"
        )
        for name, material_map in MAPS.items()
        if not material_map.is_direction
    },
    "occlusion_cast_mean": Limit(
        "of the range", True, 1.0, "mean error of occlusion that is cast from the mesh, before it is stored"
    ),
    "occlusion_cast_p99": Limit(
        "of the range",
        True,
        1.0,
        "error of occlusion that is cast from the mesh, for 99 of 100 texels, before it is stored",
    ),
    "alpha_psnr_db": Limit("dB", False, 1000.0, "PSNR of the alpha against its source"),
    "gloss_width_p99_deg": Limit(
        "degrees", True, 33.0, "error of a highlight's half-width, for 99 of 100 texels"
    ),
    "gloss_width_mean_deg": Limit("degrees", True, 33.0, "mean error of a highlight's half-width"),
    "gloss_width_max_deg": Limit("degrees", True, 33.0, "largest error of a highlight's half-width"),
    "sky_max_relative": Limit("of the texel's light", True, 1.0, "largest error of a texel's light"),
    "path_miss_m": Limit("m", True, FAR, "largest distance between the camera path and a waypoint"),
    "path_ripple_max": Limit("of the speed", True, 10.0, "largest deviation from the requested speed"),
    "path_ripple_p99": Limit(
        "of the speed", True, 10.0, "deviation from the requested speed, for 99 % of the flight"
    ),
    "path_time_s": Limit("s", True, FAR, "deviation from the requested duration"),
    "folder_mb": Limit("MB", True, FAR, "size of all artifact files together"),
    "gpu_mb": Limit("MB", True, FAR, "GPU memory of all textures and meshes"),
}

# Metrics that are measured and reported but that a budget cannot limit: name -> unit and meaning.
REPORTED = {
    **{
        f"{name}_max": (
            "of the range",
            f"largest error of a channel of a texel of the {material_map.label} map",
        )
        for name, material_map in MAPS.items()
        if not material_map.is_direction
    },
    "panorama_p99_relative": (
        "of the texel's light",
        "error of a texel's light against the panorama, for 99 of 100 sampled texels",
    ),
    "panorama_max_relative": (
        "of the texel's light",
        "largest error of a sampled texel's light against the panorama",
    ),
    "occlusion_cast_max": (
        "of the range",
        "largest error of occlusion that is cast from the mesh, before it is stored",
    ),
    "normal_encoding_deg": ("degrees", "mean angle that storing the normals in this format adds"),
    "normal_encoding_p99_deg": (
        "degrees",
        "angle that storing the normals in this format adds, for 99 of 100 texels",
    ),
    "normal_encoding_max_deg": ("degrees", "largest angle that storing the normals in this format adds"),
    "terrain_tile_max_m": ("m", "largest vertical distance of any patch, the coarse ones too"),
    "quantise_color_max": ("linear value", "how far quantisation moved a vertex colour"),
    "quantise_sway_max": ("of the farthest's", "how far quantisation changed how a vertex sways"),
    "path_jump_m": ("m", "largest gap between two segments of the camera path"),
    "path_jump_m_per_u": ("m per segment", "largest jump of the velocity between two segments"),
    "path_jump_m_per_u2": ("m per segment squared", "largest jump of the acceleration between two segments"),
}


def unit_of(metric: str) -> str:
    """The unit of a metric; empty where it is not known."""
    return METRICS[metric].unit if metric in METRICS else REPORTED.get(metric, ("", ""))[0]


def meaning_of(metric: str) -> str:
    """The meaning of a metric in a clause; empty where it is not known."""
    return METRICS[metric].meaning if metric in METRICS else REPORTED.get(metric, ("", ""))[1]


@dataclass(frozen=True)
class Excess:
    """An error beyond its limit. hard: it fails a check; otherwise it is a warning."""

    metric: str
    value: float
    limit: float
    hard: bool

    def __str__(self) -> str:
        kind = "" if self.hard else "soft "
        return f"{self.metric} is {self.value:g} {METRICS[self.metric].unit}, {kind}budget {self.limit:g}"


def worst(metric: str, values: Iterable[float]) -> float:
    """The worst of some values of a metric; of one without limits the largest."""
    least = metric in METRICS and not METRICS[metric].less_is_better
    return min(values) if least else max(values)


def is_beyond(metric: str, value: float, limit: float) -> bool:
    """Whether a value of a metric is worse than a limit."""
    return value > limit if METRICS[metric].less_is_better else value < limit


def excesses(budget: Limits, errors: Mapping[str, float]) -> list[Excess]:
    """Returns the errors beyond their hard limit, else beyond their soft one, in the budget's order."""
    beyond = []
    for metric in dict.fromkeys((*budget.hard, *budget.soft)):
        for limits, hard in ((budget.hard, True), (budget.soft, False)):
            if metric in errors and metric in limits and is_beyond(metric, errors[metric], limits[metric]):
                beyond.append(Excess(metric, errors[metric], limits[metric], hard))
                break
    return beyond

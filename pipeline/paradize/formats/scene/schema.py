"""The members of scene.json (../FORMAT.md): MANIFEST raises Wrong for the first that is not as it must be."""

from __future__ import annotations

from typing import Any

from paradize import player_limits
from paradize.formats.scene.fields import (
    Check,
    Wrong,
    day,
    file_name,
    flag,
    list_of,
    map_of,
    number,
    one_of,
    or_null,
    sha256,
    table,
    text,
    whole,
)
from paradize.map_table import SECOND, maps_of
from paradize.material import WRAPS

KINDS = ("mesh", "texture", "cubemap", "sound")
ALPHA_MODES = ("opaque", "mask", "blend")
MATERIAL_MAPS = maps_of("object")


def _kind(value: Any, place: str) -> None:
    if value not in KINDS:
        raise Wrong(place, f"is {value!r:.60}, not one of {', '.join(KINDS)}")


def _view_name(value: Any, place: str) -> None:
    if value not in player_limits.VIEWS:
        raise Wrong(place, f"is {value!r:.60}, not one of {', '.join(player_limits.VIEWS)}")


_real, _positive, _share = number(), number(0.0), number(0.0, 1.0)
_mesh_length = number(0.0, player_limits.LARGEST_M)
_vec2, _vec3 = list_of(_real, size=2), list_of(_real, size=3)
_cubic = list_of(_real, size=4)
_level = whole(0, 31)
_signed = whole(-(1 << 30), 1 << 30)
_depth, _row, _row_or_none = whole(0, 63), whole(0, 1 << 30), whole(-1, 1 << 30)
_view = or_null(table(scale=number(1e-3, 16.0)))


def _unit_quaternion(value: Any, place: str) -> None:
    list_of(_real, size=4)(value, place)
    square = sum(part * part for part in value)
    if abs(square - 1.0) > 1e-6:
        raise Wrong(place, f"has the squared length {square:g}, not 1")


def _axis_scale(value: Any, place: str) -> None:
    _real(value, place)
    low, high = player_limits.SCALES
    if not low <= abs(value) <= high:
        raise Wrong(place, f"is {value:g}; its size must lie between {low:g} and {high:g}")


_second = table(maps=table(**dict.fromkeys(SECOND, or_null(text))), wrap=list_of(one_of(*WRAPS), size=2))
_ambient = table(color=_vec3, intensity=_positive)
_fog = table(color=_vec3, density_per_m=_positive)
_sky_light = table(
    azimuth_rad=number(-6.5, 6.5), elevation_rad=number(-1.571, 1.571), color=_vec3, intensity=_positive
)
_daytime_key = table(
    at_s=_positive,
    sun=_sky_light,
    moon=_sky_light,
    ambient=_ambient,
    fog=_fog,
    exposure=_positive,
    cubemap=text,
    cubemap_azimuth_rad=number(-6.5, 6.5),
)
_clouds = table(
    color=text,
    high_rad=number(1e-3, 1.571),
    repeat=whole(1, 1000),
    drift_repeats=whole(-1000, 1000),
)

_material = table(
    {"second": _second},
    color=_vec3,
    opacity=_share,
    maps=table(**dict.fromkeys(MATERIAL_MAPS, or_null(text))),
    wrap=or_null(list_of(one_of(*WRAPS), size=2)),
    nearest=flag,
    metalness=_share,
    emission=list_of(_positive, size=3),
    specular=_positive,
    smoothness=_share,
    occlusion_strength=_share,
    parallax_scale=_real,
    parallax_bias=_real,
    parallax_limit=or_null(_positive),
    two_sided=flag,
    translucency=_share,
    alpha_mode=one_of(*ALPHA_MODES),
    alpha_cutoff=_share,
    vertex_colors=flag,
    unlit=flag,
    vertex_lit=flag,
)
GUTTER: dict[str, Check] = {
    "islands": whole(1, 1 << 31),
    "needed_texels": _positive,
    "width_texels": or_null(_positive),
    "level_in_use": _level,
    "level_by_width": whole(-1, 31),
    "bound": _share,
    "bleed_p99": list_of(_positive, min_size=1),
    "bleed_max": list_of(_positive, min_size=1),
}
_gutter = table(**GUTTER)
GROUND_MAPS: dict[str, Check] = {
    f"{stem}_{key}": or_null(text) for stem in ("sand", "effect") for key in maps_of("ground")
} | {"sand_color": text}

_required_detail = table(
    {"coarser_left_out": _level},
    left_out=_level,
    saved_bytes=whole(0, 1 << 60),
    texels=or_null(_positive),
    second_s=or_null(_positive),
    view=or_null(text),
    levels_s=list_of(or_null(_positive)),
)

_light = table(
    {"beam_m": _positive},
    name=text,
    position=_vec3,
    color=list_of(_positive, size=3),
    intensity=_positive,
    radius_m=_positive,
    range_m=_positive,
    hours=or_null(table(on_s=_positive, off_s=_positive)),
    fade_s=_positive,
    flicker=_share,
)
_light_index = whole(0, player_limits.MOST_LIGHTS - 1)
_ripples = table(
    height_m=_positive,
    x_m=list_of(_real, min_size=1, max_size=player_limits.MOST_RIPPLES),
    z_m=list_of(_real, min_size=1, max_size=player_limits.MOST_RIPPLES),
    radius_m=list_of(_positive, min_size=1, max_size=player_limits.MOST_RIPPLES),
)
_light_set_index = whole(0, player_limits.MOST_LIGHT_SETS - 1)
_light_set = table(
    lights=list_of(_light_index, max_size=player_limits.MOST_LIGHTS_OF_A_SET), glow=or_null(_light_index)
)
_light_sets = list_of(_light_set_index)

_motion = table(
    laps=_signed,
    radius_m=list_of(_positive, size=2),
    rise_m=_positive,
    bank_rad=_real,
    ahead=flag,
    pauses=_row,
    pause_share=_share,
    beat=or_null(
        table(
            per_lap=whole(1, 1 << 30),
            hinge_m=_positive,
            lift_rad=_positive,
            swing_rad=_positive,
            lag_rad_per_m=_positive,
            stagger_rad_per_m=_positive,
            glides=_row,
            glide_share=_share,
        )
    ),
)
_instance = table(position=_vec3, rotation=_unit_quaternion, scale=list_of(_axis_scale, size=3))


def _instances(value: Any, place: str) -> None:
    list_of(_instance, min_size=1, max_size=player_limits.MOST_INSTANCES)(value, place)


check_artifact = table(  # the fields of paradize.artifact.PUBLISHED
    file=file_name,
    kind=_kind,
    sha256=sha256,
    bytes=whole(1, 1 << 60),
    tier=text,
    errors=map_of(_real),
    levels=list_of(map_of(_real)),
    first_needed_s=_positive,
    max_level=or_null(_level),
    required_detail=or_null(_required_detail),
    gutter=or_null(_gutter),
    also=list_of(text),
)

MANIFEST = table(
    {
        "vram_mb": number(1.0, 1e9),
        "light_shafts": table(density_per_m=_positive, anisotropy=number(-0.9, 0.9), range_m=_positive),
        "lights": list_of(_light, min_size=1, max_size=player_limits.MOST_LIGHTS),
        "light_sets": list_of(_light_set, min_size=1, max_size=player_limits.MOST_LIGHT_SETS),
    },
    format=text,
    version=whole(1, 1 << 30),
    name=text,
    exposure=_positive,
    viewport=list_of(whole(1, 1 << 20), size=2),
    largest_viewport=list_of(whole(1, 1 << 20), size=2),
    free_camera=or_null(table(low=_vec3, high=_vec3, near_m=_positive)),
    lod_error_px=_positive,
    poster_s=_positive,
    artifacts=map_of(check_artifact),
    streaming=list_of(text),
    budget=table(hard=map_of(_positive), soft=map_of(_positive)),
    check=table(
        severity=map_of(one_of("error", "warning", "off")),
        waivers=list_of(
            table(rule=text, artifact=or_null(text), metric=or_null(text), reason=text, until=day)
        ),
        tried=map_of(table(requested=text, taken=text, errors=map_of(map_of(_real)))),
    ),
    sun=table(direction=_vec3, color=_vec3, intensity=_positive, angular_diameter_rad=_positive),
    ambient=_ambient,
    fog=_fog,
    daytime=or_null(
        table(
            keys=list_of(_daytime_key, min_size=2, max_size=1000),
            moon_diameter_rad=_positive,
            clouds=or_null(_clouds),
        )
    ),
    wind=or_null(table(direction=_vec2, speed_m_per_s=_positive, gust_m=_positive)),
    sky=or_null(table(cubemap=text)),
    shadow=or_null(
        table(size=whole(1, 1 << 16), extent_m=_positive, center=_vec3, blur_distance_m=_positive)
    ),
    reflection=_view,
    refraction=_view,
    terrain=or_null(
        table(
            {
                "light_sets": _light_sets,
                "floor": table(
                    columns=whole(1, player_limits.MOST_FLOOR_CELLS),
                    cell_m=_vec2,
                    highest_m=list_of(_real, min_size=1, max_size=player_limits.MOST_FLOOR_CELLS**2),
                ),
            },
            tiles=list_of(text, min_size=1),
            patches=table(
                tile=list_of(_row, min_size=1),
                node=list_of(_row),
                level=list_of(_depth),
                made_by=list_of(_row_or_none),
                diamond=list_of(_row_or_none),
                center=list_of(_vec3),
                radius_m=list_of(_positive),
                error_m=list_of(_positive),
                first_needed_s=list_of(_positive),
            ),
            diamonds=table(
                level=list_of(_depth),
                error_m=list_of(_positive),
                center=list_of(_vec3),
                radius_m=list_of(_positive),
            ),
            demand=table(
                finest_level=_depth,
                finest_s=or_null(_positive),
                left_out=_row,
                left_out_bytes=whole(0, 1 << 60),
            ),
            **GROUND_MAPS,
            sand_repeat=_positive,
            mix_low_m=_real,
            mix_high_m=_real,
            specular=_positive,
            smoothness=_share,
            wet_high_m=_positive,
            wet_darkness=_share,
            wet_smoothness=_share,
            size_m=_vec2,
            height_range_m=_vec2,
        )
    ),
    water=or_null(
        table(
            {"light_set": _light_set_index, "ripples": _ripples},
            **dict.fromkeys(maps_of("water"), text),
            level_m=_real,
            size_m=_positive,
            wave_repeat=_positive,
            scroll_per_s=_vec2,
            reflection_distortion=_positive,
            refraction_distortion=_positive,
            deep_color=_vec3,
            shallow_color=_vec3,
            absorption_per_m=_vec3,
            specular=_positive,
            smoothness=_share,
            swash_height_m=_positive,
            swash_waves=whole(1, 4096),
            wave_height_m=_positive,
            wave_length_m=_positive,
        )
    ),
    objects=list_of(
        table(
            {"light_sets": _light_sets},
            name=text,
            views=list_of(_view_name, min_size=1),
            mesh=text,
            center=_vec3,
            radius_m=_mesh_length,
            lods=list_of(table(node=text, error_m=_mesh_length), min_size=1),
            materials=map_of(_material),
            sway=or_null(table(lean_m=_positive, flutter_m=_positive)),
            motion=or_null(_motion),
            instances=_instances,
        )
    ),
    particles=list_of(
        table(
            {"motion": one_of("drift", "swarm"), "wander_m": _positive},
            name=text,
            center=_vec3,
            radius_m=_positive,
            count=whole(1, 1 << 30),
            size_m=_vec2,
            life_per_s=_vec2,
            threshold=_share,
            color=_vec3,
        )
    ),
    sounds=list_of(
        table(
            name=or_null(text),
            artifact=text,
            volume=_share,
            places=list_of(_vec3),
            radius_m=_positive,
            falloff=_positive,
            hours=or_null(table(on_s=_positive, off_s=_positive, fade_s=_positive)),
        )
    ),
    music=or_null(table(artifacts=list_of(text, min_size=1), volume=_share, playing=whole(0, 16))),
    flight=table(
        duration_s=number(*player_limits.FLIGHT_S),
        fov_rad=number(*player_limits.FOV_RAD),
        near_m=number(*player_limits.NEAR_M),
        far_m=number(*player_limits.FAR_M),
        segments=list_of(
            table(eye=list_of(_cubic, size=3), target=list_of(_cubic, size=3), roll=_cubic), min_size=1
        ),
        time_table=list_of(list_of(_real, size=3), min_size=2),
        waypoint_u=list_of(whole(0, 1 << 30), min_size=1),
        errors=map_of(_real),
    ),
)

"""The views that the player draws at its finest quality; a bake provides for them. Does not import numpy."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from paradize.scene.flight import sine_cosine
from paradize.scene.settings import Scene

# A bake provides what the player's finest quality reads (player/scene/quality.cpp; a test compares them):
# FINEST_LOD times lod_error_px, reflection and refraction at least FINEST_SCALE times the camera's picture, a
# shadow map FINEST_SHADOW times as wide, in SHADOW_CASCADES cascades, each with texels CASCADE_RATIO times
# smaller (player/scene/cascades.hpp).
FINEST_LOD, FINEST_SCALE, FINEST_SHADOW = 0.25, 1.0, 2
SHADOW_CASCADES, CASCADE_RATIO = 3, 3
# The player's coarsest quality: COARSEST_LOD times lod_error_px, in pixels of the shown picture. Where it
# draws a smaller one (resolution=fast) coarser levels still would do; none is baked for that.
COARSEST_LOD = 3.0


def camera_views(scene: Scene) -> dict[str, Any]:
    """Returns the settings from which lods_from_path.py derives the nearest and farthest view of an
    object. error_px: the error that the player's finest quality accepts. far_error_px: the error that the
    scene accepts; it limits the coarsest levels."""
    return {
        "flight": asdict(scene.flight),
        "viewport": list(scene.head.largest),
        "error_px": FINEST_LOD * scene.head.lod_error_px,
        "far_error_px": scene.head.lod_error_px,
    }


def finest_scales(scene: Scene) -> dict[str, float]:
    """Returns the size of reflection and refraction as a share of the camera's picture, by view, in the
    player's finest quality."""
    views = {"reflection": scene.reflection, "refraction": scene.refraction}
    return {name: max(view.scale, FINEST_SCALE) for name, view in views.items() if view}


def finest_shadow_texel_m(scene: Scene) -> float | None:
    """Returns the width of a texel of the finest shadow map cascade in the player's finest quality, metres;
    None without shadows."""
    if scene.shadow is None:
        return None
    finer: int = CASCADE_RATIO ** (SHADOW_CASCADES - 1)
    return scene.shadow.extent_m / (FINEST_SHADOW * scene.shadow.size * finer)


def scene_views(scene: Scene) -> dict[str, Any]:
    """Returns the settings of the visibility query (visibility/query.py): all views of the flight and of
    the free camera."""
    level_m = scene.water.level_m if scene.water else 0.0
    views: dict[str, Any] = camera_views(scene)
    return views | {
        "mirror_m": level_m if scene.reflection else None,
        "water_m": level_m if scene.water and scene.refraction else None,
        "shadow": {"extent_m": scene.shadow.extent_m, "center": list(scene.shadow.center)}
        if scene.shadow
        else None,
        "sun": None if scene.daytime else sun_direction(scene.sun.azimuth_deg, scene.sun.elevation_deg),
        **({"region": asdict(scene.free_camera)} if scene.free_camera else {}),
    }


def sun_direction(azimuth_deg: float, elevation_deg: float) -> list[float]:
    """Returns the unit vector from the ground to the sun. azimuth_deg: from -Z towards +X."""
    sin_a, cos_a = sine_cosine(azimuth_deg)
    sin_e, cos_e = sine_cosine(elevation_deg)
    return [sin_a * cos_e, sin_e, -cos_a * cos_e]

"""Turns the settings of an instance into the form that scene.json has and `paradize.placement` reads."""

from __future__ import annotations

from typing import Any

from paradize.angles import sine_cosine
from paradize.scene.settings import Instance


def placed(instance: Instance) -> dict[str, Any]:
    """Returns position, rotation (a unit quaternion x, y, z, w) and scale (three numbers): scaled along the
    object's own axes, then turned by roll about Z, by pitch about X and by yaw about Y, then moved."""
    sy, cy = sine_cosine(0.5 * instance.yaw_deg)
    sx, cx = sine_cosine(0.5 * instance.pitch_deg)
    sz, cz = sine_cosine(0.5 * instance.roll_deg)
    rotation = (
        cy * sx * cz + sy * cx * sz,
        sy * cx * cz - cy * sx * sz,
        cy * cx * sz - sy * sx * cz,
        cy * cx * cz + sy * sx * sz,
    )
    scale = instance.scale
    return {
        "position": list(instance.position),
        "rotation": [part + 0.0 for part in rotation],  # no -0.0
        "scale": list(scale) if isinstance(scale, tuple) else [scale] * 3,
    }

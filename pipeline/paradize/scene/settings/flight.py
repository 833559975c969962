"""The flight, and the box of a steered camera."""

from __future__ import annotations

from dataclasses import dataclass

from paradize.scene.schema import FAR, number, point, tables


@dataclass(frozen=True, kw_only=True)
class EyePoint:
    position: tuple[float, float, float] = point(meaning="position of the camera")
    speed: float = number(1.0, low=0.05, high=20.0, unit="of the mean speed", meaning="speed here")
    roll_deg: float = number(0.0, low=-180.0, high=180.0, unit="degrees", meaning="roll of the camera here")


@dataclass(frozen=True, kw_only=True)
class TargetPoint:
    position: tuple[float, float, float] = point(meaning="point that the camera looks at")


@dataclass(frozen=True, kw_only=True)
class Flight:
    duration_s: float = number(
        240.0, low=0.1, high=86_400.0, unit="s", meaning="length of the flight, which is a loop"
    )
    fov_deg: float = number(50.0, low=1.0, high=170.0, unit="degrees", meaning="vertical field of view")
    near_m: float = number(0.1, low=1e-4, high=FAR, unit="m", meaning="near plane")
    far_m: float = number(2000.0, low=1e-3, high=10 * FAR, unit="m", meaning="far plane")
    eye: tuple[EyePoint, ...] = tables(
        EyePoint, least=3, most=1000, meaning="A waypoint of the camera. Three or more."
    )
    target: tuple[TargetPoint, ...] = tables(
        TargetPoint, least=3, most=1000, meaning="What the camera looks at at that waypoint."
    )


@dataclass(frozen=True, kw_only=True)
class FreeCamera:
    """The box of the world in which a steered camera may move, and its least distance to any surface."""

    low: tuple[float, float, float] = point(
        meaning="lowest corner of the box in which a steered camera may move"
    )
    high: tuple[float, float, float] = point(meaning="highest corner of the box")
    near_m: float = number(1.0, low=1e-4, high=FAR, unit="m", meaning="least distance to any surface")

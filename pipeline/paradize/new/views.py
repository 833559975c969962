"""Reads a model's cameras and lights for a new scene: waypoints of the flight, and the sun."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import asin, atan2, cos, degrees, pi, sin, sqrt

from paradize.readers.record import Camera, Light, Vec3, Views

SUN_AZIMUTH_DEG, SUN_ELEVATION_DEG = 215.0, 38.0
FOV_DEG = 40.0
_FOVS = 5.0, 120.0  # degrees that a flight takes over
_ASPECTS = 0.2, 5.0
_ROWS = 720  # of the picture, where a camera says its aspect
_MOST = 16  # cameras in a flight
_NAMED = 4  # cameras in a note
_LEAST_SUN_DEG = 2.0  # elevation
_INTENSITIES = 0.05, 30.0  # of the sun, with the exposure of a new scene
_STEEPEST = 0.999  # of a look up or down; beyond, the horizon is anywhere


@dataclass(frozen=True)
class Waypoint:
    """A place of the flight, metres, and what it looks at. camera: whose view it is. near: of its near plane,
    in the model's units."""

    eye: Vec3
    target: Vec3
    roll_deg: float
    camera: str
    near: float | None = None


@dataclass
class Sun:
    """color, intensity: None: the scene's default. light: whose it is; empty: nobody's. notes: what is not
    taken over of the lights."""

    azimuth_deg: float = SUN_AZIMUTH_DEG
    elevation_deg: float = SUN_ELEVATION_DEG
    color: Vec3 | None = None
    intensity: float | None = None
    light: str = ""
    notes: list[str] = field(default_factory=list)

    @property
    def direction(self) -> Vec3:
        """The unit vector to the sun."""
        azimuth, elevation = self.azimuth_deg * pi / 180.0, self.elevation_deg * pi / 180.0
        return sin(azimuth) * cos(elevation), sin(elevation), -cos(azimuth) * cos(elevation)


def sun_of(views: Views | None) -> Sun:
    """Returns the sun that the first directional light is; without one the sun of every new scene."""
    sun = Sun()
    for light in views.lights if views else []:
        what = f"the {light.kind} light {light.name!r} is left out"
        if light.kind != "directional":
            sun.notes.append(f"{what}: a scene is lit by its sun and its sky")
        elif sun.light:
            sun.notes.append(f"{what}: a scene has one sun")
        else:
            _take(sun, light)
    return sun


def _take(sun: Sun, light: Light) -> None:
    x, y, z = (-value for value in light.direction)
    elevation = degrees(asin(max(-1.0, min(1.0, y))))
    if elevation < _LEAST_SUN_DEG:
        what = f"the directional light {light.name!r} stands {elevation:.3g} degrees above the horizon"
        sun.notes.append(f"{what}, at least {_LEAST_SUN_DEG:g} are needed; the sun stands elsewhere")
        return
    sun.light, sun.elevation_deg, sun.azimuth_deg = light.name, elevation, degrees(atan2(x, -z)) % 360.0
    red, green, blue = (min(value, 100.0) for value in light.color)
    sun.color = red, green, blue
    low, high = _INTENSITIES
    if low <= light.intensity <= high:
        sun.intensity = light.intensity
    else:
        what = f"{light.intensity:g} lux of the directional light {light.name!r} are not taken over"
        sun.notes.append(f"{what}; {low:g} to {high:g} suit the exposure 1: set both in the scene")


@dataclass(frozen=True)
class Lens:
    """The field of view of a flight, and the picture's size; None: the default. note: what is not taken over
    of the camera."""

    fov_deg: float = FOV_DEG
    viewport: tuple[int, int] | None = None
    note: str = ""


def lens_of(views: Views | None) -> Lens:
    """Returns the lens of the first perspective camera that a flight can have."""
    for camera in views.cameras if views else []:
        if camera.fov_deg is not None and _FOVS[0] <= camera.fov_deg <= _FOVS[1]:
            low, high = _ASPECTS
            if camera.aspect is None:
                return Lens(camera.fov_deg)
            if low <= camera.aspect <= high:
                return Lens(camera.fov_deg, (2 * round(0.5 * _ROWS * camera.aspect), _ROWS))
            what = f"the aspect of the camera {camera.name!r}, {camera.aspect:.3g}, is not taken over"
            return Lens(camera.fov_deg, note=f"{what}; {low:g} to {high:g} is the range")
    return Lens()


def waypoints_of(
    views: Views | None,
    lens: Lens,
    center: Vec3,
    radius: float,
    farthest: float,
    place: Callable[[Vec3], Vec3],
) -> tuple[list[Waypoint], list[str]]:
    """Returns the waypoints that show what cameras see, and notes of what is not taken over.

    center, radius: of the model, in its units. farthest: how far from the center a camera may stand, in the
    same. place: from the model's units into the scene.
    """
    found: list[Waypoint] = []
    left_out: dict[str, list[str]] = {}
    others: dict[str, list[str]] = {}
    for camera in views.cameras if views else []:
        why = _fault(camera, center, farthest, place)
        if why is None and len(found) == _MOST:
            why = f"a flight takes {_MOST}"
        if why is None and any(_apart(place(camera.eye), other.eye) < 1e-6 * radius for other in found):
            why = "it stands where another one does"
        if why is not None:
            left_out.setdefault(why, []).append(camera.name)
            continue
        if camera.fov_deg is not None and abs(camera.fov_deg - lens.fov_deg) > 0.05:
            others.setdefault(f"{camera.fov_deg:.3g}", []).append(camera.name)
        ahead = sum((c - e) * f for c, e, f in zip(center, camera.eye, camera.forward, strict=True))
        reach = max(ahead, 0.1 * radius)
        x, y, z = (e + reach * f for e, f in zip(camera.eye, camera.forward, strict=True))
        ends = place(camera.eye), place((x, y, z))
        found.append(Waypoint(*ends, _roll_deg(camera), camera.name, camera.near_m))
    notes = [lens.note] if lens.note else []
    for why, names in left_out.items():
        notes.append(f"{_cameras(names)} {'are' if len(names) > 1 else 'is'} left out: {why}")
    for angle, names in others.items():
        what = f"{_cameras(names)} {'see' if len(names) > 1 else 'sees'} {angle} degrees"
        notes.append(f"{what}; the flight has one field of view, {lens.fov_deg:.3g}")
    return found, notes


def _cameras(names: list[str]) -> str:
    """Names cameras, the first few of many."""
    if len(names) == 1:
        return f"the camera {names[0]!r}"
    shown = ", ".join(map(repr, names[:_NAMED]))
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{len(names)} cameras ({shown}{more})"


def _fault(camera: Camera, center: Vec3, farthest: float, place: Callable[[Vec3], Vec3]) -> str | None:
    """Why a flight cannot take a camera."""
    if camera.fov_deg is None:
        return "it is not a perspective camera"
    if not _FOVS[0] <= camera.fov_deg <= _FOVS[1]:
        return f"it sees {camera.fov_deg:.3g} degrees; {_FOVS[0]:g} to {_FOVS[1]:g} is the range"
    if _apart(camera.eye, center) > farthest:
        return (
            f"it stands {_apart(camera.eye, center):.3g} from the model's middle; {farthest:.3g} is the limit"
        )
    if place(camera.eye)[1] <= 0.0:
        return "it stands below the ground, which is at the model's foot"
    if abs(camera.forward[1]) > _STEEPEST:
        return "it looks straight up or down"
    return None


def _roll_deg(camera: Camera) -> float:
    """The roll that turns a level camera into this one."""
    fx, _, fz = camera.forward
    length = sqrt(fx * fx + fz * fz)
    right = (-fz / length, 0.0, fx / length)
    level = (
        right[1] * camera.forward[2] - right[2] * camera.forward[1],
        right[2] * camera.forward[0] - right[0] * camera.forward[2],
        right[0] * camera.forward[1] - right[1] * camera.forward[0],
    )
    across, along = (sum(a * b for a, b in zip(camera.up, axis, strict=True)) for axis in (right, level))
    return degrees(atan2(-across, along))


def _apart(a: Vec3, b: Vec3) -> float:
    return sqrt(sum((p - q) ** 2 for p, q in zip(a, b, strict=True)))

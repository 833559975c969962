"""Lights at a place: lamps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from paradize import player_limits
from paradize.scene.schema import FAR, Faults, identifier, number, point, text, vector
from paradize.scene.settings.objects import SceneObject


@dataclass(frozen=True, kw_only=True)
class Light:
    name: str = identifier(meaning="names the light")
    position: tuple[float, float, float] | None = point(
        None, meaning="where it is; a light has this or `object`"
    )
    object: str | None = text(
        None,
        meaning="name of an object: there is one light at each of its instances, and what the instance "
        "gives off goes on and off with its light",
    )
    offset: tuple[float, float, float] = point(
        (0.0, 0.0, 0.0), meaning="of the light from the origin of that object, along the object's own axes"
    )
    color: tuple[float, float, float] = vector(
        (1.0, 0.62, 0.28), size=3, low=0.0, high=100.0, meaning="linear RGB"
    )
    intensity: float = number(
        1.0,
        low=0.0,
        high=1e6,
        meaning="light on a surface 1 m away that faces it, in the unit of the sun's intensity; it falls "
        "with the square of the distance",
    )
    radius_m: float = number(
        0.05, low=1e-4, high=1e3, unit="m", meaning="radius of what glows: it widens highlights"
    )
    range_m: float = number(
        10.0, low=1e-3, high=FAR, unit="m", meaning="it lights nothing farther away, and fades out before"
    )
    on_s: float | None = number(
        None,
        low=0.0,
        high=86_400.0,
        unit="s",
        meaning="second of the flight at which it goes on; without on_s and off_s it is always on",
    )
    off_s: float | None = number(
        None,
        low=0.0,
        high=86_400.0,
        unit="s",
        meaning="second at which it goes off; before on_s: on past the flight's end",
    )
    step_s: float = number(
        0.0,
        low=0.0,
        high=3600.0,
        unit="s",
        meaning="how much later the light of each instance goes on than that of the instance before",
    )
    fade_s: float = number(
        1.0, low=0.0, high=3600.0, unit="s", meaning="from dark to full after on_s, and back after off_s"
    )
    flicker: float = number(
        0.0, low=0.0, high=1.0, meaning="share of its light that comes and goes, as a flame's"
    )
    beam_m: float = number(
        0.0,
        low=0.0,
        high=FAR,
        unit="m",
        meaning="height of a beam into the sky above it, of light that the air scatters; 0: none",
    )


def check_lights(
    lights: Sequence[Light], objects: Sequence[SceneObject], duration_s: float, faults: Faults
) -> None:
    """Adds the faults that concern more than one field of the lights."""
    first: dict[str, int] = {}
    instances = {item.name: len(item.instances) for item in objects}
    total = 0
    for i, light in enumerate(lights):
        if first.setdefault(light.name, i) != i:
            faults.add(
                f"light[{i}].name", f"{light.name!r} is already light[{first[light.name]}]", "rename one"
            )
        if (light.position is None) == (light.object is None):
            what = "has neither position nor object" if light.object is None else "has position and object"
            faults.add(f"light[{i}]", what, "write position = [x, y, z], or the name of an object")
        if light.object is not None and light.object not in instances:
            mend = f"the scene has: {', '.join(instances) or 'no objects'}"
            faults.add(f"light[{i}].object", f"{light.object!r} is not an object", mend)
        count = instances.get(light.object, 0) if light.object else 1
        total += count
        if fault := _hours_fault(light, duration_s) or _step_fault(light, count, duration_s):
            faults.add(f"light[{i}].{fault[0]}", *fault[1:])
    if total > player_limits.MOST_LIGHTS:
        mend = f"the player takes {player_limits.MOST_LIGHTS} in a scene"
        faults.add("light", f"make {total} lights", mend)


def _hours_fault(light: Light, duration_s: float) -> tuple[str, str, str] | None:
    """Returns the field, what is wrong and the mend."""
    if (light.on_s is None) != (light.off_s is None):
        there, missing = ("on_s", "off_s") if light.off_s is None else ("off_s", "on_s")
        return there, f"stands without {missing}", "write both; neither: it is always on"
    if light.on_s is None or light.off_s is None:
        return None
    for key, second in (("on_s", light.on_s), ("off_s", light.off_s)):
        if second > duration_s:
            return key, f"is {second:g}", f"the flight lasts {duration_s:g} s"
    lit_s = (light.off_s - light.on_s) % duration_s
    if lit_s + light.fade_s > duration_s:
        mend = f"a flight of {duration_s:g} s leaves {duration_s - lit_s:g} s between off_s and on_s"
        return "fade_s", f"is {light.fade_s:g}", mend
    return None


def _step_fault(light: Light, count: int, duration_s: float) -> tuple[str, str, str] | None:
    if light.step_s == 0.0:
        return None
    if light.object is None or light.on_s is None or light.off_s is None:
        return "step_s", f"is {light.step_s:g}", "write it with object, on_s and off_s, and only there"
    lit_s, last_s = (light.off_s - light.on_s) % duration_s, (count - 1) * light.step_s
    if last_s >= lit_s:
        mend = f"all go off {lit_s:g} s after on_s"
        return "step_s", f"is {light.step_s:g}: the last of {count} would go on {last_s:g} s after on_s", mend
    return None

"""Where an object that moves is: the functions of player/scene/motion.cpp, without libm. Does not import
numpy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, floor, sqrt
from typing import Any

from paradize.angles import PI, sine_cosine
from paradize.placement import turned
from paradize.scene.placement import placed
from paradize.scene.settings import Motion, SceneObject

_GOLDEN = 0.6180339887498949  # of a round, between neighbours in the list
# Places that stand for a way: this far apart, at most so many.
_GAP_M, _MOST_PLACES = 0.5, 128


def motion_json(motion: Motion | None) -> dict[str, Any] | None:
    """Returns a motion in the form of scene.json."""
    if motion is None:
        return None
    beat = motion.beat
    return {
        "laps": motion.laps,
        "radius_m": list(motion.radius_m),
        "rise_m": motion.rise_m,
        "bank_rad": motion.bank_deg * PI / 180.0,
        "ahead": motion.heading == "ahead",
        "pauses": motion.pauses,
        "pause_share": motion.pause_share,
        "beat": beat
        and {
            "per_lap": beat.per_lap,
            "hinge_m": beat.hinge_m,
            "lift_rad": beat.lift_deg * PI / 180.0,
            "swing_rad": beat.swing_deg * PI / 180.0,
            "lag_rad_per_m": beat.lag_deg_per_m * PI / 180.0,
            "stagger_rad_per_m": beat.stagger_deg_per_m * PI / 180.0,
            "glides": beat.glides,
            "glide_share": beat.glide_share,
        },
    }


def moved(
    instance: Mapping[str, Any], motion: Mapping[str, Any], number: int, share: float
) -> dict[str, Any]:
    """Returns where an instance is, in the form of `instances` of scene.json. motion: as in scene.json.
    number: of the instance, in their order. share: of the flight's duration that has passed."""
    rounds = motion["laps"] * share + number * _GOLDEN % 1.0
    way = rounds
    if motion["pauses"]:
        legs = rounds * motion["pauses"]
        begun = floor(legs)
        leg = (legs - begun - motion["pause_share"]) / (1.0 - motion["pause_share"])
        leg = min(max(leg, 0.0), 1.0)
        way = (begun + leg * leg * (3.0 - 2.0 * leg)) / motion["pauses"]
    return _at(instance, motion, way % 1.0)


def reach_m(motion: Mapping[str, Any]) -> float:
    """Returns how far an instance moves from its position at most."""
    return float(max(motion["radius_m"]) + motion["rise_m"])


def _at(instance: Mapping[str, Any], motion: Mapping[str, Any], way: float) -> dict[str, Any]:
    """Returns an instance at a share of its round."""
    sine, cosine = sine_cosine(360.0 * way)
    along, across = motion["radius_m"]
    local = (along * cosine, motion["rise_m"] * 2.0 * sine * cosine, across * sine)
    sign = -1.0 if motion["laps"] < 0 else 1.0
    rotation = instance["rotation"]
    if motion["ahead"]:
        x, z = -sign * along * sine, sign * across * cosine
        length = sqrt(x * x + z * z)
        turn = z / length if length > 0.0 else 1.0  # the cosine of the yaw
        half = sqrt(max(0.0, 0.5 - 0.5 * turn))
        rotation = _product(
            rotation, (0.0, -half if x < 0.0 else half, 0.0, sqrt(max(0.0, 0.5 + 0.5 * turn)))
        )
    sine_bank, cosine_bank = sine_cosine(0.5 * sign * motion["bank_rad"] * 180.0 / PI)
    rotation = _product(rotation, (0.0, 0.0, sine_bank, cosine_bank))
    return {
        "position": [
            a + b for a, b in zip(instance["position"], turned(local, instance["rotation"]), strict=True)
        ],
        "rotation": [part + 0.0 for part in rotation],
        "scale": list(instance["scale"]),
    }


def _product(a: Any, b: Any) -> tuple[float, float, float, float]:
    """Returns the product of two quaternions x, y, z, w: turns by b, then by a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def stands(item: SceneObject) -> list[dict[str, Any]]:
    """Returns where an object stands, in the form of `instances` of scene.json. One that moves stands at
    places all along its ways, half a metre apart or 128 of them, and so is seen as near as it ever comes."""
    still = [placed(instance) for instance in item.instances]
    return all_stands(still, motion_json(item.motion))


def all_stands(instances: Sequence[dict[str, Any]], motion: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """Returns where an object stands, as `stands` does, by `instances` and `motion` of scene.json."""
    if motion is None:
        return list(instances)
    length_m = 2.0 * PI * max(motion["radius_m"])
    count = min(max(1, ceil(length_m / _GAP_M)), _MOST_PLACES)
    return [_at(instance, motion, k / count) for instance in instances for k in range(count)]

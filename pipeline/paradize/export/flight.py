"""The flight as keys of an animation, with the error of the straight lines between the keys."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import ORIGIN, Vec3, rounded
from paradize.scene.flight import Flight

if TYPE_CHECKING:
    import numpy.typing as npt

    F64 = npt.NDArray[np.float64]

KEYS_PER_S = 30.0
_NEAR_M = 4096.0  # float32 has steps of half a millimetre at this distance
_BETWEEN = 4  # moments between two keys at which the error is measured


@dataclass(frozen=True)
class Keys:
    """times_s (n,) float32; places (n, 3) float32, metres from `origin`; turns (n, 4) float32 unit
    quaternions x y z w that turn -Z to the view direction; errors: of a viewer that goes straight from key to
    key."""

    times_s: npt.NDArray[np.float32]
    places: npt.NDArray[np.float32]
    turns: npt.NDArray[np.float32]
    errors: dict[str, float]
    origin: Vec3


def flight_keys(tree: dict[str, Any]) -> Keys:
    """Keys of the `flight` of a scene.json; the last is the first again. errors: path_export_m and
    path_export_deg, each _max and _p99, at four moments between any two keys."""
    flight = Flight.from_json(tree)
    count = int(np.ceil(flight.duration_s * KEYS_PER_S))
    times = flight.duration_s * np.arange(count + 1) / count
    times_s = times.astype(np.float32)
    places, turns = _poses(flight, times)
    origin = _origin_of(places)
    keys = (places - origin).astype(np.float32)
    places = keys.astype(np.float64) + origin
    shares = (np.arange(_BETWEEN) + 1) / (_BETWEEN + 1)
    moments = (times[:-1, None] + shares * (times[1:] - times[:-1])[:, None]).ravel()
    true_places, true_turns = _poses(flight, moments)
    share = np.tile(shares, count)[:, None]
    shown = np.repeat(places[:-1], _BETWEEN, axis=0) * (1 - share)
    shown += np.repeat(places[1:], _BETWEEN, axis=0) * share
    apart = np.sqrt(((shown - true_places) ** 2).sum(axis=1))
    spun = _slerp(np.repeat(turns[:-1], _BETWEEN, axis=0), np.repeat(turns[1:], _BETWEEN, axis=0), share)
    # The angle between two quaternions from its sine, because a cosine near 1 hides small angles.
    same = np.minimum(np.linalg.norm(spun - true_turns, axis=1), np.linalg.norm(spun + true_turns, axis=1))
    angles = np.degrees(4.0 * np.arcsin(np.clip(same / 2.0, 0.0, 1.0)))
    errors: dict[str, float] = {}
    for name, values in (("path_export_m", apart), ("path_export_deg", angles)):
        errors |= {
            f"{name}_max": rounded(values.max()),
            f"{name}_p99": rounded(np.percentile(values, 99)),
        }
    return Keys(times_s, keys, turns.astype(np.float32), errors, origin)


def _origin_of(places: F64) -> Vec3:
    """(0, 0, 0), or the middle of a flight that is so far away that float32 keys would jerk."""
    if float(np.abs(places).max()) <= _NEAR_M:
        return ORIGIN
    x, y, z = (float(value) for value in np.round((places.min(axis=0) + places.max(axis=0)) / 2.0))
    return x, y, z


def _poses(flight: Flight, times: F64) -> tuple[F64, F64]:
    """Positions (n, 3) and quaternions (n, 4) at moments; neighbouring quaternions have the same sign."""
    poses = [flight.pose(float(t)) for t in times]
    places = np.array([eye for eye, _, _ in poses])
    turns = np.array([_turn(*pose) for pose in poses])
    flips = np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
    turns[1:] *= np.cumprod(flips)[:, None]
    return places, turns


def _turn(eye: tuple[float, ...], target: tuple[float, ...], roll_rad: float) -> F64:
    """The quaternion of a camera, as in player/scene/flight.cpp."""
    forward = np.subtract(target, eye)
    length = np.linalg.norm(forward)
    forward = forward / length if length > 1e-9 else np.array([0.0, 0.0, -1.0])
    up = np.array([0.0, 1.0, 0.0])
    if abs(forward[1]) > 0.999999:
        up = np.array([0.0, 0.0, 1.0 if forward[1] > 0.0 else -1.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    c, s = np.cos(roll_rad), np.sin(roll_rad)
    return quaternion(np.stack([right * c + up * s, up * c - right * s, -forward], axis=1))


def quaternion(matrix: F64) -> F64:
    """The unit quaternion (x, y, z, w) of a rotation (3, 3), from its largest component. S. W. Shepperd,
    "Quaternion from Rotation Matrix", Journal of Guidance and Control 1(3), 1978."""
    m = matrix
    square = np.array(
        [
            1.0 + m[0, 0] - m[1, 1] - m[2, 2],
            1.0 - m[0, 0] + m[1, 1] - m[2, 2],
            1.0 - m[0, 0] - m[1, 1] + m[2, 2],
            1.0 + m[0, 0] + m[1, 1] + m[2, 2],
        ]
    )
    k = int(square.argmax())
    products = np.array(
        [
            [square[0], m[1, 0] + m[0, 1], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
            [m[1, 0] + m[0, 1], square[1], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
            [m[0, 2] + m[2, 0], m[2, 1] + m[1, 2], square[2], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], square[3]],
        ]
    )
    unit: F64 = products[k] / np.linalg.norm(products[k])
    return unit


def _slerp(a: F64, b: F64, share: F64) -> F64:
    """Interpolates along great circles between quaternions (n, 4). K. Shoemake, "Animating Rotation with
    Quaternion Curves", SIGGRAPH 1985."""
    angle = 2.0 * np.arcsin(np.clip(np.linalg.norm(b - a, axis=1, keepdims=True) / 2.0, 0.0, 1.0))
    small = angle < 1e-7
    sine = np.sin(np.where(small, 1.0, angle))
    first = np.where(small, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
    second = np.where(small, share, np.sin(share * angle) / sine)
    between: F64 = first * a + second * b
    return between

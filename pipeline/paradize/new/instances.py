"""Where the copies of a mesh stand in a new scene, as rows of a file of instances."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import atan2, cos, degrees, isfinite, sin, sqrt

from paradize.scene.settings import Instance

_SHEAR = 1e-5  # largest cosine between the axes of a copy
_RANGE = 1e-6  # least size, of the largest: the limit of an instance's scale (scene/settings/objects.py)
_FARTHEST = 1e15  # of any number of a transform
_COLUMNS = ("x", "y", "z", "yaw_deg", "pitch_deg", "roll_deg", "scale_x", "scale_y", "scale_z")


def instance_of(matrix: Sequence[float], size: float = 1.0) -> Instance | None:
    """Returns the instance that stands as a matrix says (3 x 4, row by row), of a mesh that is `size` times
    as large: the inverse of scene/placement.placed. None for a matrix that shears or flattens, which no
    instance can."""
    columns = [tuple(matrix[row + k] for row in (0, 4, 8)) for k in range(3)]
    lengths = [sqrt(sum(value * value for value in column)) for column in columns]
    if not all(length > 0.0 and isfinite(length) for length in lengths):
        return None
    x, y, z = ([v / length for v in column] for column, length in zip(columns, lengths, strict=True))
    if max(abs(_dot(x, y)), abs(_dot(y, z)), abs(_dot(z, x))) > _SHEAR:
        return None
    if _dot(_cross(x, y), z) < 0.0:  # mirrored
        x, lengths[0] = [-value for value in x], -lengths[0]
    yaw = atan2(z[0], z[2])
    # what is left after the turn about Y is undone: a turn about Z, then one about X
    c, s = cos(yaw), sin(yaw)
    roll = atan2(-(c * y[0] - s * y[2]), c * x[0] - s * x[2])
    pitch = atan2(-z[1], s * z[0] + c * z[2])
    return Instance(
        position=(matrix[3], matrix[7], matrix[11]),
        yaw_deg=degrees(yaw),
        pitch_deg=degrees(pitch),
        roll_deg=degrees(roll),
        scale=(lengths[0] / size, lengths[1] / size, lengths[2] / size),
    )


def why_not(matrices: Sequence[Sequence[float]]) -> str | None:
    """Says why copies cannot be instances; None where they can."""
    if any(not abs(value) <= _FARTHEST for matrix in matrices for value in matrix):
        return f"a transform is beyond {_FARTHEST:g}"
    found = [instance_of(matrix) for matrix in matrices]
    if None in found:
        return f"{found.count(None)} of them are sheared or flat"
    sizes = sizes_of(instance for instance in found if instance)
    if sizes and min(sizes) < _RANGE * max(sizes):
        return f"they are {min(sizes):g} to {max(sizes):g} times as large as their mesh"
    return None


def sizes_of(instances: Iterable[Instance]) -> list[float]:
    """Returns the sizes along all axes."""
    return [
        abs(value) for instance in instances if isinstance(instance.scale, tuple) for value in instance.scale
    ]


def moved(matrix: Sequence[float], scale: float, position: Sequence[float]) -> list[float]:
    """The transform `matrix`, then a scale, then a move."""
    out = [scale * value for value in matrix]
    for row, offset in zip((3, 7, 11), position, strict=True):
        out[row] += offset
    return out


def table_text(instances: Iterable[Instance]) -> str:
    """Returns the file of instances, eleven digits of each number."""
    lines = [",".join(_COLUMNS)]
    for instance in instances:
        assert isinstance(instance.scale, tuple)
        numbers = (
            *instance.position,
            instance.yaw_deg,
            instance.pitch_deg,
            instance.roll_deg,
            *instance.scale,
        )
        lines.append(",".join(f"{value + 0.0:.11g}" for value in numbers))
    return "\n".join(lines) + "\n"


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    return [a[k - 2] * b[k - 1] - a[k - 1] * b[k - 2] for k in range(3)]

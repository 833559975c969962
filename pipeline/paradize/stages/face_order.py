"""Finds the order in which six pictures meet at the edges of a cube map, and how they must be turned.

Every order and every turn is tried: the difference of the light along the twelve edges is looked up in a
table of all pairs of sides.
"""

from __future__ import annotations

from itertools import permutations, product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from paradize.vectors import cube_vectors

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]

_CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))  # s, t; clockwise, as the sides between them
_SAMPLES = 64  # means along a side that are compared
_WORSE = 2.5  # times the difference of the best order: skies whose seams show stay below
_VISIBLE = 0.02  # of the square root of the sky's light, on the mean of the edges
_ALIKE = 1.05  # orders up to this factor from the best are as good: plain faces may be turned


class FaceOrder(NamedTuple):
    """faces: which picture is each face, +X -X +Y -Y +Z -Z. turns: quarters of a turn of each, clockwise."""

    faces: tuple[int, ...]
    turns: tuple[int, ...]


def better_order(faces: F32) -> FaceOrder | None:
    """The order in which faces (6, n, n, c) of linear light, n a power of two, meet far better than as they
    are, with the fewest turned; None where there is none."""
    sides = _sides(faces)
    table = np.abs(sides[:, :, None, None] - sides[None, None, :, :, ::-1]).mean(axis=4)
    given = sum(table[a, i, b, j] for a, i, b, j in _EDGES)
    if given <= _VISIBLE * len(_EDGES) * sides.mean():
        return None
    orders = np.array(list(permutations(range(6))))
    sums = np.zeros((len(orders), *(4,) * 6))
    for a, i, b, j in _EDGES:
        sums += _of_turns(table, orders, a, i, b, j)
    best = float(sums.min())
    if given <= _WORSE * best:
        return None
    alike = [
        FaceOrder(tuple(orders[k].tolist()), tuple(turns))
        for k, *turns in np.argwhere(sums <= _ALIKE * best).tolist()
    ]
    return min(alike, key=lambda way: (sum(turn > 0 for turn in way.turns), _moved(way), way))


def _moved(way: FaceOrder) -> int:
    return sum(face != place for place, face in enumerate(way.faces))


def _sides(faces: F32) -> F64:
    """The square root of the light along the four sides of each face, clockwise: (6, 4, samples)."""
    lines = (faces[:, 0], faces[:, :, -1], faces[:, -1, ::-1], faces[:, ::-1, 0])
    light = np.stack(lines, axis=1).clip(0.0, None).mean(axis=3, dtype=np.float64)
    samples = min(light.shape[2], _SAMPLES)
    return np.asarray(np.sqrt(light.reshape(6, 4, samples, -1).mean(axis=3)), np.float64)


def _of_turns(table: F64, orders: npt.NDArray[np.int64], a: int, i: int, b: int, j: int) -> F64:
    """The differences where side i of face a meets side j of face b, by order and by the turns of all six:
    (720, 4 or 1 ...). A face that is turned by k quarters has its side i - k at i."""
    turns = np.arange(4)
    first, second = orders[:, a, None, None], orders[:, b, None, None]
    turned = table[first, (i - turns)[:, None] % 4, second, (j - turns) % 4]
    shape = [len(orders), *(4 if face in (a, b) else 1 for face in range(6))]
    return (turned if a < b else turned.transpose(0, 2, 1)).reshape(shape)


def _edges() -> tuple[tuple[int, int, int, int], ...]:
    """The twelve edges of a cube map: face and side, face and side."""
    ends: dict[frozenset[tuple[float, ...]], list[int]] = {}
    for face, side in product(range(6), range(4)):
        corners = [_CORNERS[side], _CORNERS[(side + 1) % 4]]
        places = [cube_vectors(face, np.array(s), np.array(t)).tolist() for s, t in corners]
        ends.setdefault(frozenset(tuple(place) for place in places), []).extend((face, side))
    return tuple((a, i, b, j) for a, i, b, j in ends.values())


_EDGES = _edges()

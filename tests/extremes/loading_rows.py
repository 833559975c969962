"""Rows of what loading costs: an OBJ's text, in exact fractions, against the float32 places of the mesh."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np

from paradize.metrics.loading import loaded
from paradize.readers.record import Model
from tests.extremes.shapes import MESHES, ball, read_text, text_of
from tests.extremes.table import Row

Vec = tuple[float, float, float]
_FAR: dict[str, tuple[float, Vec]] = {
    "tiny": (1e-30, (0, 0, 0)),
    "huge": (1e30, (0, 0, 0)),
    "far": (1.0, (1e6, -1e6, 1e6)),
    "denormal": (1e-40, (0, 0, 0)),
}


def _texts(offset: Vec = (0, 0, 0)) -> dict[str, Callable[[], str]]:
    """The text of each mesh, moved; of those that a bake reads from text the text that it reads."""

    def text(name: str) -> str:
        if name not in _FAR:
            return text_of(MESHES[name](), 1 / 3, offset)  # no float32 any more
        factor, there = _FAR[name]
        x, y, z = (a + b for a, b in zip(there, offset, strict=True))
        return text_of(ball(), factor / 3, (x, y, z))

    return {name: lambda name=name: text(name) for name in MESHES}  # type: ignore[misc]


def lost(text: str, made: Model) -> tuple[float, float]:
    """How far a corner of a triangle lies from its place in the text at most, and the diagonal of the box of
    all corners' places: squares in exact fractions."""
    lines = [line.split() for line in text.splitlines()]
    places = [[Fraction(word) for word in line[1:]] for line in lines if line[0] == "v"]
    faces = [[int(word.partition("/")[0]) - 1 for word in line[1:]] for line in lines if line[0] == "f"]
    origin = [Fraction(value) for value in made.mesh.origin]
    rows = made.mesh.positions.tolist()
    most = Fraction(0)
    pairs = {
        pair
        for face, triangle in zip(faces, made.mesh.triangles.tolist(), strict=True)
        for pair in zip(face, triangle, strict=True)
    }
    for at, vertex in pairs:
        off = [a + Fraction(b) - c for a, b, c in zip(origin, rows[vertex], places[at], strict=True)]
        most = max(most, sum(x * x for x in off))
    used = [places[at] for face in faces for at in face]
    sides = [max(column) - min(column) for column in zip(*used, strict=True)]
    return _root(most), _root(sum(side * side for side in sides))


def _root(square: Fraction | int) -> float:
    """Its square root, also where the square is not a float."""
    if not square:
        return 0.0
    scale = Fraction(10) ** (2 * round(math.log10(square.numerator) - math.log10(square.denominator)) // 2)
    return math.sqrt(float(square / (scale * scale))) * float(scale)


def _share_lost(text: str, made: Model) -> float:
    most, diagonal = lost(text, made)
    return most / diagonal if diagonal else most


def _judged(text: str) -> tuple[Model, dict[str, float]]:
    made = read_text(text)
    return replace(made, warnings=[]), loaded(made.mesh, made.source).errors


def _misjudged(text: str, made: tuple[Model, dict[str, float]]) -> float:
    """The difference of the metric from the fractions. It may be above them by what float64 can round of the
    text, which it counts, and below by a 1e-10th of the diagonal, where it does not."""
    result, errors = made
    most, diagonal = lost(text, result)
    below = most - errors["load_max_m"]
    numbers = [
        float(word) for line in text.splitlines() if line.startswith("v ") for word in line.split()[1:]
    ]
    rounding = 2.0 * float(np.spacing(max(map(abs, numbers))))
    return max(below, -below - rounding, 0.0) / max(most, 1e-10 * diagonal) if diagonal else max(below, 0.0)


_REFUSED = {"zero": "is an empty file", "nan": "is not a finite number", "inf": "is not a finite number"}
_NO_DIGITS = dict.fromkeys(("tiny", "denormal", "constant"), "float64 has no digits for it there")
_STEPS = {"denormal": "float32 has steps of 1e-45 there: metrics.loading tells what they cost"}
ROWS = [
    Row(
        "readers.obj",
        {name: text for name, text in _texts().items() if name not in _STEPS},
        read_text,
        _share_lost,
        "diagonals",
        1e-6,
        part="places",
        refused=_REFUSED,
        absent=_STEPS,
    ),
    *[
        Row(
            "readers.obj",
            {name: text for name, text in _texts(offset).items() if name not in _NO_DIGITS},
            read_text,
            _share_lost,
            "diagonals",
            1e-6,
            part=f"{offset[0]:.0e} m away".replace("e+0", "e"),
            refused=_REFUSED,
            absent=_NO_DIGITS,
        )
        for offset in ((1e5, 0.0, -1e5), (1e6, 0.0, -1e6), (1e7, 0.0, -1e7))
    ],
    Row("metrics.loading", _texts(), _judged, _misjudged, "of what is lost", 2e-5, refused=_REFUSED),
]

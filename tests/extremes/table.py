"""One table: what every stage and metric does with every extreme, told from two runs of each cell."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from paradize.errors import ParadizeError

# The columns, and what each stands for where a row does not say otherwise.
EXTREMES = {
    "zero": "no element at all",
    "one": "one element",
    "many": "thousands",
    "constant": "all values equal",
    "tiny": "times 1e-30",
    "huge": "times 1e30",
    "far": "a million units from the origin",
    "denormal": "times 1e-40: below the smallest normal float32",
    "nan": "one value is NaN",
    "inf": "one value is infinite",
    "parallel": "all directions equal",
    "opposite": "directions that cancel out",
    "degenerate": "elements without area, doubled, or of one row",
    "mirrored": "turned inside out",
    "sliver": "a million times as long as wide",
    "largest": "57,000 triangles, a million texels",
}
DEEP = ("many", "largest")
ROOMS = (
    "loading_rows",
    "model_rows",
    "palette_rows",
    "mesh_rows",
    "map_rows",
    "authored_rows",
    "picture_rows",
    "ground_rows",
    "metric_rows",
    "map_metric_rows",
)


@dataclass(frozen=True)
class Row:
    """The treatment of the extremes of one stage or metric.

    module: whose promise it is, as stages.weld; part: which of its functions, where several have rows.
    inputs: by extreme; run makes the output of one, error holds it to the truth in `unit`, and must not pass
    limit. refused: extremes that raise an error of these words; absent: those that do not apply, and why.
    """

    module: str
    inputs: Mapping[str, Callable[[], Any]]
    run: Callable[[Any], Any]
    error: Callable[[Any, Any], float]
    unit: str
    limit: float
    part: str = ""
    refused: Mapping[str, str] = field(default_factory=dict)
    absent: Mapping[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """As the table tells it."""
        return f"{self.module} ({self.part})" if self.part else self.module


class Cell(NamedTuple):
    """One cell as it came out. verdict: "holds", "refused", "absent" or "fails"; said: the message, the
    reason, or what is wrong; error: None where nothing was measured; digest: of the output's bytes."""

    row: str
    extreme: str
    verdict: str
    error: float | None
    limit: float
    unit: str
    said: str
    digest: str


def rows() -> list[Row]:
    """All rows, in the order of the table."""
    found = [row for room in ROOMS for row in importlib.import_module(f"tests.extremes.{room}").ROWS]
    return sorted(found, key=lambda row: (row.module.partition(".")[0] != "stages", row.module))


def parts(value: Any) -> Iterator[Any]:
    """Arrays, bytes, numbers and words of any nest of them."""
    if dataclasses.is_dataclass(value):
        for item in dataclasses.fields(value):
            yield from parts(getattr(value, item.name))
    elif isinstance(value, Mapping):
        for key in value:
            yield from parts(key)
            yield from parts(value[key])
    elif isinstance(value, (list, tuple)):
        for item in value:
            yield from parts(item)
    else:
        yield value


def digest_of(value: Any) -> str:
    """Of all bytes of a nest: equal where they are equal."""
    found = hashlib.sha256()
    for part in parts(value):
        if isinstance(part, np.ndarray):
            found.update(f"{part.dtype}{part.shape}".encode() + np.ascontiguousarray(part).tobytes())
        else:
            found.update(part if isinstance(part, bytes) else repr(part).encode())
    return found.hexdigest()[:16]


def is_finite(value: Any) -> bool:
    """Whether no number of a nest is NaN or infinite."""
    for part in parts(value):
        if isinstance(part, np.ndarray) and part.dtype.kind == "f" and not np.isfinite(part).all():
            return False
        if isinstance(part, float) and not math.isfinite(part):
            return False
    return True


def cell_of(row: Row, extreme: str) -> Cell:
    """Runs one cell. A warning of numpy is a failure: nothing overflows unseen."""

    def cell(verdict: str, said: str, error: float | None = None, digest: str = "") -> Cell:
        return Cell(row.name, extreme, verdict, error, row.limit, row.unit, said, digest)

    if extreme in row.absent:
        return cell("absent", row.absent[extreme])
    if extreme not in row.inputs:
        return cell("fails", "no input and no reason why there is none")
    given = row.inputs[extreme]()
    wanted = row.refused.get(extreme)
    try:
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            made = row.run(given)
    except (ParadizeError, ValueError) as error:
        message = str(error).replace("\n", " ")
        if wanted is None or wanted not in message:
            return cell("fails", f"refused: {message}")
        return cell("refused", message, digest=digest_of(message))
    except FloatingPointError as error:
        return cell("fails", f"numpy: {error}")
    if wanted is not None:
        return cell("fails", f"not refused, expected {wanted!r}")
    if not is_finite(made):
        return cell("fails", "not finite")
    with np.errstate(all="ignore"):
        error = float(row.error(given, made))
    holds = math.isfinite(error) and error <= row.limit
    return cell("holds" if holds else "fails", "", error, digest_of(made))


def all_cells(extremes: Sequence[str]) -> list[Cell]:
    """Every cell of some columns."""
    return [cell_of(row, extreme) for row in rows() for extreme in extremes]

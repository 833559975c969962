"""Reads a CSV file of instances: a header, then a row for each copy of the object."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from paradize import player_limits
from paradize.errors import mend_of_reading
from paradize.files import read_file
from paradize.scene.schema import FARTHEST, Faults, number
from paradize.scene.schema.field import show, suggestion
from paradize.scene.settings.objects import Instance

MAX_BYTES = 32 << 20
_POSITION, _SCALES = ("x", "y", "z"), ("scale_x", "scale_y", "scale_z")
_ANGLES = ("yaw_deg", "pitch_deg", "roll_deg")
_SEPARATORS = {";": "semicolons", "\t": "tabs", " ": "spaces"}  # of tables that are no CSV
_COORDINATE = number(0.0, low=-FARTHEST, high=FARTHEST, unit="m").metadata["rule"]
_COLUMNS = (*_POSITION, *_ANGLES, "scale", *_SCALES)


def read_instances(path: Path) -> tuple[Instance, ...]:
    """Reads columns x, y, z, and those there are of yaw_deg, pitch_deg, roll_deg, and scale or scale_x,
    scale_y, scale_z. Empty lines and lines that begin with # are left out. Raises SceneError for one fault,
    with its line and column, GroupedError for several."""
    faults = Faults(path)
    rows = _rows(path, faults)
    _, header = next(rows, (0, []))
    names = [name.strip().lower() for name in header]
    _check_header(names, faults)
    faults.raise_if_any()
    instances: list[Instance | None] = []
    most = player_limits.MOST_INSTANCES
    for line, row in rows:
        if len(row) != len(names):
            mend = f"write one for each of {', '.join(names)}"
            faults.add(f"line {line}", f"has {len(row)} values, expected {len(names)}", mend)
        elif len(instances) == most:
            mend = f"the player takes {most} in a scene; leave the rest out, or split the scene"
            faults.add(f"line {line}", f"more than {most} instances", mend)
            break
        else:
            instances.append(_instance(dict(zip(names, row, strict=True)), line, faults))
    if not instances and not faults.errors:
        faults.add("its rows", "there are none", "write one for each instance below the header")
    faults.raise_if_any()
    return tuple(instance for instance in instances if instance is not None)


def _rows(path: Path, faults: Faults) -> Iterator[tuple[int, list[str]]]:
    """Yields the line and the values of each row."""
    try:
        text = read_file(path, MAX_BYTES).decode("utf-8-sig")
    except OSError as error:
        what = f"cannot be read: {error.strerror or error}"
        faults.add("the file", what, mend_of_reading(error) or "name a file that can be read")
        return
    except UnicodeDecodeError as error:
        faults.add(f"byte {error.start}", "is not text", "save the table as CSV in UTF-8")
        return
    reader = csv.reader(text.splitlines(), strict=True)
    try:
        for row in reader:
            if any(value.strip() for value in row) and not row[0].lstrip().startswith("#"):
                yield reader.line_num, row
    except csv.Error as error:
        faults.add(f"line {reader.line_num}", str(error), "save the table as CSV, with commas")


def _check_header(names: list[str], faults: Faults) -> None:
    between = next((mark for mark in _SEPARATORS if len(names) == 1 and mark in names[0]), None)
    if between is not None:
        what = f"columns are separated by {_SEPARATORS[between]}, expected commas"
        faults.add("header", what, "save the table as CSV, with commas and decimal points")
        return
    for name in names:
        if name not in _COLUMNS:
            faults.add("header", f"has the unknown column {show(name)}", suggestion(name, _COLUMNS))
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            faults.add("header", f"has {name} twice", "leave one out")
    scales = [name for name in _SCALES if name in names]
    for missing in [name for name in (*_POSITION, *(_SCALES if scales else ())) if name not in names]:
        faults.add("header", f"has no column {missing}", f"known: {', '.join(_COLUMNS)}")
    if scales and "scale" in names:
        faults.add("header", "has scale beside scale_x, scale_y, scale_z", "leave one of the two out")


def _instance(values: dict[str, str], line: int, faults: Faults) -> Instance | None:
    before = len(faults.errors)
    # The field of an instance that each column fills checks its range.
    limits = Instance.__dataclass_fields__
    numbers: dict[str, float] = {}
    for name, text in values.items():
        field = "scale" if name in _SCALES else name
        value = _number(text)
        rule = _COORDINATE if name in _POSITION else limits[field].metadata["rule"]
        rule(text if value is None else value, f"line {line}, column {name}", faults)
        numbers[name] = value or 0.0
    if len(faults.errors) > before:
        return None
    x, y, z = (numbers.pop(name) for name in _POSITION)
    if "scale_x" in numbers:
        sx, sy, sz = (numbers.pop(name) for name in _SCALES)
        return Instance(position=(x, y, z), scale=(sx, sy, sz), **numbers)
    return Instance(position=(x, y, z), **numbers)


def _number(text: str) -> float | None:
    if not text.isascii() or "_" in text:  # forms that only Python accepts
        return None
    try:
        return float(text)
    except ValueError:
        return None

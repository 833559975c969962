"""Reads the elements of a PLY, text and binary, into columns.

Source: G. Turk, "The PLY Polygon File Format", 1994. Every count is compared with the bytes that are there
before memory is taken for it.
"""

from __future__ import annotations

import re
import warnings
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.errors import SourceError
from paradize.readers.names import END_MARKS

if TYPE_CHECKING:
    from collections.abc import Collection

    import numpy.typing as npt

    from paradize.data import F64

_MOST_HEADER = 1 << 20  # bytes
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_END = re.compile(rb"(?<=[\r\n])end_header[ \t]*(\r\n|\n|\r)")
_MEND = "export the model again"


@dataclass(frozen=True)
class Lists:
    """A property that is a list in each row. counts: (n,), their lengths. values: all of them,
    one after the other."""

    counts: npt.NDArray[np.int64]
    values: npt.NDArray[Any]


@dataclass(frozen=True)
class Property:
    """kind: of its values, as numpy's code; of its length too where it is a list, else None."""

    name: str
    kind: str
    length: str | None = None


@dataclass(frozen=True)
class Element:
    """An element of the header. count: its rows."""

    name: str
    count: int
    properties: list[Property]


@dataclass
class Ply:
    """columns: by element and property, (n,) each. kinds: the numpy code of a property, in the same way.
    skipped: lines of the header that are no statement, by number. longer: rows of a text that hold more
    numbers than the header names, which are left out."""

    columns: dict[str, dict[str, npt.NDArray[Any]]]
    lists: dict[str, dict[str, Lists]]
    kinds: dict[str, dict[str, str]]
    comments: list[str]
    skipped: dict[int, str]
    longer: int = 0


def read_elements(data: bytes, path: Path, once: Collection[str]) -> Ply:
    """Returns all elements. once: names of properties that an element has once at most; of others the last
    counts. Raises SourceError for a broken header and for a file that is cut."""
    if not data.startswith(b"ply"):
        raise SourceError(
            f"is not a PLY: it begins with {data[:16]!r}, not with 'ply'", file=path, mend=_MEND
        )
    end = _END.search(data[:_MOST_HEADER])
    if end is None:
        raise SourceError("its header has no end", file=path, mend=_MEND)
    order, elements, empty = _header(data[: end.start()], path, once)
    if order is not None:
        return _all_rows(_Binary(data, end.end(), order), elements, empty, path)
    return _text(data[end.end() :].rstrip(END_MARKS), elements, empty, path)


def _text(body: bytes, elements: list[Element], empty: Ply, path: Path) -> Ply:
    """All elements of a text. Where its numbers are not those that the header names, each line is a row."""
    source, fault, ply = _Text(_numbers(body)), None, None
    try:
        ply = _all_rows(source, elements, empty, path)
    except SourceError as error:
        fault = error
    if fault or source.left():
        with suppress(ValueError, IndexError, OverflowError):
            numbers, longer = _numbers_of_lines(body, elements)
            return replace(_all_rows(_Text(numbers), elements, empty, path), longer=longer)
    if ply is None:
        assert fault
        raise fault
    return ply


def _all_rows(source: _Text | _Binary, elements: list[Element], empty: Ply, path: Path) -> Ply:
    ply = replace(empty, columns={}, lists={}, kinds={})
    for element in elements:
        ply.kinds[element.name] = {declared.name: declared.kind for declared in element.properties}
        try:
            ply.columns[element.name], ply.lists[element.name] = _rows(source, element)
        except (ValueError, OverflowError):
            what = f"cut, or holds what is not a number: {element.count} rows do not fit"
            raise SourceError(what, file=path, place=f"element {element.name}", mend=_MEND) from None
    return ply


def _header(head: bytes, path: Path, once: Collection[str]) -> tuple[str | None, list[Element], Ply]:
    """The byte order (None: text), the elements in their order, and a Ply without rows."""
    order: str | None = None
    elements: list[Element] = []
    empty = Ply({}, {}, {}, [], {})
    known = False
    for number, line in enumerate(head.decode("latin-1").splitlines()[1:], 2):
        words = line.split()
        match words:
            case [] | ["obj_info", *_]:
                pass
            case ["comment", *_]:
                empty.comments.append(line.strip()[len("comment") :].strip())
            case ["format", form, _] if form in _FORMATS:
                order, known = _FORMATS[form] or None, True
            case ["element", name, count] if count.isdecimal() and count.isascii() and len(count) < 19:
                elements.append(Element(name, int(count), []))
            case ["property", "list", length, kind, name] if (
                elements and kind in _TYPES and _TYPES.get(length, "f")[0] in "iu"
            ):
                elements[-1].properties.append(Property(name, _TYPES[kind], _TYPES[length]))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(Property(name, _TYPES[kind]))
            case [word, *_] if word not in ("format", "element", "property"):
                empty.skipped[number] = line  # a comment without its word, as Blender 2.4 writes one
            case _:
                raise SourceError(
                    f"{line[:80]!r} is not a statement of PLY", file=path, place=f"line {number}", mend=_MEND
                )
    if not known:
        raise SourceError("its header has no format", file=path, mend=_MEND)
    named = [("an element", [element.name for element in elements])]
    for element in elements:
        names = [declared.name for declared in element.properties if declared.name in once]
        named.append((f"a property of {element.name}", names))
    for kind, names in named:
        if len(set(names)) < len(names):
            raise SourceError(f"its header has {kind} twice", file=path, mend=_MEND)
    return order, elements, empty


def _numbers(body: bytes) -> F64:
    """The numbers of a text; none where it holds anything else."""
    with warnings.catch_warnings(), suppress(DeprecationWarning, ValueError):
        warnings.simplefilter("error")
        return np.fromstring(body.strip(), np.float64, sep=" ") if body.strip() else np.zeros(0)
    return np.zeros(0)


def _numbers_of_lines(body: bytes, elements: list[Element]) -> tuple[F64, int]:
    """The numbers that the header names of each line, and how many lines hold more. Raises ValueError,
    IndexError or OverflowError where lines are missing, or one holds fewer or what is not a number."""
    lines = [line for line in body.splitlines() if line.strip()]
    if sum(element.count for element in elements) > len(lines):
        raise ValueError
    owners = [element for element in elements for _ in range(element.count)]
    rows, longer = [], 0
    for element, line in zip(owners, lines[: len(owners)], strict=True):
        if b"_" in line:  # 1_0, a form that only Python accepts
            raise ValueError
        row = np.fromiter(map(float, line.split()), np.float64)
        named = 0
        for declared in element.properties:
            named += 1 if declared.length is None else 1 + _length(row[named : named + 1])
        if named > len(row):
            raise ValueError
        longer += named < len(row)
        rows.append(row[:named])
    return np.concatenate(rows), longer


class _Text:
    """The numbers of a text. at: how many are taken."""

    def __init__(self, numbers: F64) -> None:
        self.numbers, self.at = numbers, 0

    def left(self) -> int:
        return len(self.numbers) - self.at

    def size(self, kind: str) -> int:
        del kind
        return 1

    def take(self, kind: str, count: int) -> npt.NDArray[Any]:
        del kind
        if count > self.left():
            raise ValueError
        self.at += count
        return self.numbers[self.at - count : self.at]

    def table(self, fields: list[tuple[str, str, int]], count: int) -> dict[str, npt.NDArray[Any]]:
        """Takes rows of (name, kind, length) fields."""
        width = sum(length for _, _, length in fields)
        rows = self.take("", width * count).reshape(count, width)
        starts = np.cumsum([0, *(length for _, _, length in fields)])
        return {
            name: rows[:, at : at + length] for (name, _, length), at in zip(fields, starts, strict=False)
        }


class _Binary:
    """The numbers of a binary body. order of its bytes: "<" or ">"."""

    def __init__(self, data: bytes, at: int, order: str) -> None:
        self.data, self.at, self.order = data, at, order

    def left(self) -> int:
        return len(self.data) - self.at

    def size(self, kind: str) -> int:
        return int(kind[1])

    def take(self, kind: str, count: int) -> npt.NDArray[Any]:
        if count * self.size(kind) > self.left():
            raise ValueError
        found = np.frombuffer(self.data, self.order + kind, count, self.at)
        self.at += found.nbytes
        return found

    def table(self, fields: list[tuple[str, str, int]], count: int) -> dict[str, npt.NDArray[Any]]:
        row = np.dtype([(name, self.order + kind, (length,)) for name, kind, length in fields])
        if row.itemsize * count > self.left():
            raise ValueError
        rows = np.frombuffer(self.data, row, count, self.at)
        self.at += rows.nbytes
        return {name: rows[name] for name, _, _ in fields}


def _rows(source: _Text | _Binary, element: Element) -> tuple[dict[str, npt.NDArray[Any]], dict[str, Lists]]:
    """Takes the rows of an element. Raises ValueError where they are not there."""
    least = sum(source.size(declared.length or declared.kind) for declared in element.properties)
    if least * element.count > source.left():
        raise ValueError
    if not element.properties or not element.count:
        return {declared.name: np.zeros(0) for declared in element.properties if declared.length is None}, {}
    start = source.at
    lengths = []
    for declared in element.properties:  # of the first row
        length = 1
        if declared.length is not None:
            length = _length(source.take(declared.length, 1))
        source.take(declared.kind, length)
        lengths.append(length)
    source.at = start
    equal = _equal_rows(source, element, lengths)
    if equal is not None:
        return equal
    source.at = start
    return _rows_one_by_one(source, element)


def _length(number: npt.NDArray[Any]) -> int:
    length = int(number[0])
    if length < 0 or length != number[0]:
        raise ValueError
    return length


def _equal_rows(
    source: _Text | _Binary, element: Element, lengths: list[int]
) -> tuple[dict[str, npt.NDArray[Any]], dict[str, Lists]] | None:
    """Takes the rows at once if the lists of all are as long as those of the first; else None."""
    fields: list[tuple[str, str, int]] = []
    for k, (declared, length) in enumerate(zip(element.properties, lengths, strict=True)):
        fields += [(f"length {k}", declared.length, 1)] if declared.length is not None else []
        fields += [(f"value {k}", declared.kind, length)]
    try:
        table = source.table(fields, element.count)
    except ValueError:
        return None
    columns: dict[str, npt.NDArray[Any]] = {}
    lists: dict[str, Lists] = {}
    for k, (declared, length) in enumerate(zip(element.properties, lengths, strict=True)):
        values = table[f"value {k}"]
        if declared.length is None:
            columns[declared.name] = values[:, 0]
        elif (table[f"length {k}"] != length).any():
            return None
        else:
            counts = np.full(element.count, length, np.int64)
            lists[declared.name] = Lists(counts, np.ascontiguousarray(values).reshape(-1))
    return columns, lists


def _rows_one_by_one(
    source: _Text | _Binary, element: Element
) -> tuple[dict[str, npt.NDArray[Any]], dict[str, Lists]]:
    found: dict[str, list[npt.NDArray[Any]]] = {declared.name: [] for declared in element.properties}
    for _ in range(element.count):
        for declared in element.properties:
            length = 1 if declared.length is None else _length(source.take(declared.length, 1))
            found[declared.name].append(source.take(declared.kind, length))
    columns: dict[str, npt.NDArray[Any]] = {}
    lists: dict[str, Lists] = {}
    for declared in element.properties:
        values = np.concatenate(found[declared.name])
        if declared.length is None:
            columns[declared.name] = values
        else:
            counts = np.fromiter((len(row) for row in found[declared.name]), np.int64, element.count)
            lists[declared.name] = Lists(counts, values)
    return columns, lists

"""The container of a glTF model and typed access to its JSON."""

from __future__ import annotations

import struct
from math import inf
from pathlib import Path
from typing import Any, Self

from paradize.documents import json_kind, parse_json
from paradize.errors import FormatError, SourceError, bounded, unread
from paradize.files import read_file
from paradize.readers.names import END_MARKS
from paradize.readers.ranges import beyond, strays, within

_JSON_BYTES = 1 << 30  # a .gltf may hold its buffers and pictures as text
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_MAX_WARNINGS = 100  # different sentences
_SPARE_VALUES = 1 << 25  # values that a file of any size may unfold to
MEND = "export the model again"
_FEWER = "export the model without so many copies"


class Document:
    """A glTF file. file: its path. tree: its JSON. binary: the BIN chunk of a GLB, else None. copies_mend:
    the mend of too many copies. Each fault names its place, a JSON pointer or a byte."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._told: dict[str, dict[str, None]] = {}  # the places of each sentence
        self.tables: dict[str, list[Any]] = {}
        self.copies_mend = _FEWER
        try:
            data = read_file(file)
        except OSError as error:
            raise unread(error, file) from None
        self.limit = _SPARE_VALUES + 4 * len(data)
        self._spent = 0
        self.binary: memoryview | None = None
        text = memoryview(data)
        if data.startswith(b"glTF"):
            text, self.binary = self._chunks(data)
        try:
            words = text.tobytes().removeprefix(b"\xef\xbb\xbf").rstrip(END_MARKS)
            tree = parse_json(words, limit=_JSON_BYTES)
        except FormatError as error:
            raise SourceError(error.what, file=file, place=error.place, mend=MEND) from None
        if not isinstance(tree, dict):
            raise self.fault(f'holds {json_kind(tree)}; a glTF file holds an object, {{"asset": ...}}', "")
        self.tree: dict[str, Any] = tree
        self._check_version()

    def with_tree(self, tree: dict[str, Any]) -> Self:
        """This file with another JSON, and no warnings yet."""
        other = self.__class__.__new__(self.__class__)
        vars(other).update(vars(self), tree=tree, tables={}, _told={}, _spent=0)
        return other

    def _chunks(self, data: bytes) -> tuple[memoryview, memoryview | None]:
        if len(data) < _HEADER.size:
            raise self.fault(
                f"{len(data)} bytes; the header of a GLB has {_HEADER.size}", f"byte {len(data)}"
            )
        _, version, total = _HEADER.unpack_from(data)
        if version != 2:
            raise self.fault(f"GLB of version {version}, expected 2", "byte 4", "export it as glTF 2.0")
        if total > len(data):
            raise self.fault(f"cut: its header says {total} bytes, the file has {len(data)}", "byte 8")
        found: dict[bytes, memoryview] = {}
        offset = _HEADER.size
        while offset < total:
            if offset + _CHUNK.size > total:
                raise self.fault("cut inside the header of a chunk", f"byte {offset}")
            length, kind = _CHUNK.unpack_from(data, offset)
            offset += _CHUNK.size
            if offset + length > total:
                raise self.fault(f"a chunk of {length} bytes, {total - offset} are left", f"byte {offset}")
            if not found and kind != b"JSON":
                raise self.fault(f"the first chunk is {kind!r}, expected JSON", f"byte {offset - 4}")
            found.setdefault(kind, memoryview(data)[offset : offset + length])
            offset += length
        if b"JSON" not in found:
            raise self.fault("holds no JSON", "byte 12")
        return found[b"JSON"], found.get(b"BIN\0")

    def _check_version(self) -> None:
        asset = self.get(self.tree, "", "asset", dict)
        if isinstance(number := asset.get("version"), int | float):
            asset = asset | {"version": str(number)}
            self.warn(f"{_shown(number)}, expected a text; read as one", "/asset/version")
        version = self.get(asset, "/asset", "version", str)
        if version.partition(".")[0] != "2":
            raise self.fault(f"glTF {version[:20]}, expected 2.0", "/asset/version", "export it as glTF 2.0")
        least = self.get(asset, "/asset", "minVersion", str, "2.0")
        if least != "2.0":
            raise self.fault(f"needs glTF {least[:20]}, expected 2.0", "/asset/minVersion")

    def fault(self, what: str, place: str, mend: str = MEND) -> SourceError:
        """The error for a fault of this file."""
        return SourceError(what, file=self.file, place=place or None, mend=mend)

    def warn(self, what: str, place: str = "") -> None:
        """Adds a warning."""
        self._told.setdefault(bounded(what), {})[bounded(place, 200)] = None

    @property
    def warnings(self) -> list[str]:
        """A line for each sentence of what was left out or read otherwise, with its first place and how many
        there are."""
        lines = []
        for what, places in list(self._told.items())[:_MAX_WARNINGS]:
            place = next(iter(places))
            count = f" (in {len(places)} places, this one first)" if len(places) > 1 else ""
            lines.append(f"{self.file}: {place}{': ' if place else ''}{what}{count}")
        if (more := len(self._told) - _MAX_WARNINGS) > 0:
            lines.append(f"{self.file}: {more} more kinds of warnings are not shown")
        return lines

    def spend(self, values: int, place: str, what: str = "accessors") -> None:
        """Counts values that are unfolded. Raises SourceError beyond what files of this size may hold."""
        self._spent += values
        if self._spent > self.limit:
            mend = self.copies_mend if what == "copies" else _FEWER
            what = f"its {what} unfold to more than {self.limit} values, far beyond the size of its files"
            raise self.fault(what, place, mend)

    def get(self, owner: object, where: str, key: str, kind: type, default: Any = ...) -> Any:
        """owner[key], of type `kind`; a whole number may be written as 3.0, a number as 3."""
        if not isinstance(owner, dict):
            raise self.fault("not an object", where)
        value = owner.get(key, default)
        if value is ...:
            raise self.fault(f"{key} is missing", where)
        if value is default:
            return value
        if kind is int:
            value = _plain_int(value)
        if kind is float and isinstance(value, int):
            value = float(value) if not isinstance(value, bool) else value
        if not isinstance(value, kind) or (kind is not bool and isinstance(value, bool)):
            raise self.fault(f"{_shown(value)}, expected {_WORDS[kind]}", f"{where}/{key}")
        return value

    def whole(self, owner: object, where: str, key: str, low: int, default: Any = ...) -> Any:
        """A whole number of at least `low`; the default as it is."""
        value = self.get(owner, where, key, int, default)
        if value is not default and value < low:
            raise self.fault(f"{value}, expected at least {low}", f"{where}/{key}")
        return value

    def floats(
        self, owner: object, where: str, key: str, count: int, default: tuple[float, ...]
    ) -> tuple[float, ...]:
        """A list of `count` numbers."""
        values = self.get(owner, where, key, list, None)
        if values is None:
            return default
        plain = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
        if len(values) != count or len(plain) != count:
            raise self.fault(f"{_shown(values)}, expected {count} numbers", f"{where}/{key}")
        return tuple(float(value) for value in plain)

    def number(
        self,
        owner: object,
        where: str,
        key: str,
        default: float,
        low: float = 0.0,
        high: float = inf,
    ) -> float:
        """A number of low to high. Beyond, the nearest of them is taken, with a warning."""
        return self.within((self.get(owner, where, key, float, default),), f"{where}/{key}", low, high)[0]

    def share(self, owner: object, where: str, key: str, default: float = 1.0) -> float:
        """A number of 0 to 1, as `number`."""
        return self.number(owner, where, key, default, 0.0, 1.0)

    def shares(self, owner: object, where: str, key: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """A list of numbers of 0 to 1, as many as the default has, as `number`."""
        values = self.floats(owner, where, key, len(default), default)
        return self.within(values, f"{where}/{key}", 0.0, 1.0)

    def within(self, values: tuple[float, ...], place: str, low: float, high: float) -> tuple[float, ...]:
        """The values, those beyond low to high replaced by the nearest in it, with a warning."""
        found = within(values, low, high)
        if strays(values, found):
            self.warn(beyond(values, low, high, found), place)
        return found

    def wholes(self, owner: object, where: str, key: str) -> list[int]:
        """A list of whole numbers; empty where it is missing."""
        values = [_plain_int(value) for value in self.get(owner, where, key, list, [])]
        if not all(isinstance(value, int) and not isinstance(value, bool) for value in values):
            raise self.fault(f"{_shown(values)}, expected whole numbers", f"{where}/{key}")
        return values

    def table(self, name: str) -> list[Any]:
        """A list of the root; empty where it is missing."""
        if name not in self.tables:
            self.tables[name] = self.get(self.tree, "", name, list, [])
        return self.tables[name]

    def item(self, table: str, index: int, where: str) -> dict[str, Any]:
        """The entry of a table. where: the place that names it."""
        entries = self.table(table)
        if not 0 <= index < len(entries):
            raise self.fault(f"{index}; there are {len(entries)} {table}", where)
        if not isinstance(entries[index], dict):
            raise self.fault("not an object", f"/{table}/{index}")
        entry: dict[str, Any] = entries[index]
        return entry

    def extension(self, owner: dict[str, Any], where: str, name: str) -> dict[str, Any] | None:
        """The object of an extension; None where it is missing."""
        extensions = self.get(owner, where, "extensions", dict, {})
        return self.get(extensions, f"{where}/extensions", name, dict, None)  # type: ignore[no-any-return]


_WORDS = {dict: "an object", list: "a list", str: "a text", int: "a whole number", float: "a number"}
_WORDS |= {bool: "true or false"}


def _plain_int(value: Any) -> Any:
    """A whole number that is written as 3.0; all else as it is."""
    whole = isinstance(value, float) and value.is_integer() and abs(value) < 2.0**53
    return int(value) if whole else value


def _shown(value: object) -> str:
    return bounded(repr(value), 60)

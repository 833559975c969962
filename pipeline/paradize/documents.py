"""Reads JSON and TOML from untrusted files in time proportional to their size; writes JSON for people.

Input that would take a parser longer is refused before it starts, with the place and the limit. JSON follows
RFC 8259 strictly: no NaN, no duplicate keys. Integers must fit into 64 bits, other numbers into float64,
texts must be Unicode, and nesting is limited. So code that uses the values cannot overflow.
"""

from __future__ import annotations

import gc
import json
import math
import re
import tomllib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NoReturn

from paradize.errors import FormatError, ParadizeError
from paradize.files import read_file

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SCENE_FILE = "scene.json"  # the document of a baked folder
JSON_BYTES = 64 << 20  # the player has the same limit
TOML_BYTES = 4 << 20
DEPTH = 64  # nesting of tables and lists
KEY_PARTS = 16  # parts of a TOML key: a.b.c has three. Parsing time grows with their square
WHOLE = 1 << 63  # the smallest integer that does not fit into 64 bits

# TOML's strings and comments. An unclosed one ends with its line or the file. Possessive quantifiers: the
# match never backtracks, so that each character is read once.
_OPAQUE = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}|\Z)'
    r"|'''(?:[^']|'(?!''))*+(?:'{3,5}|\Z)"
    r'|"(?:[^"\\\n]|\\[^\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
_MANY_PARTS = re.compile(rf"(?<![ \t])(?:[ \t]*+\.[ \t]*+[\w-]++){{{KEY_PARTS}}}")


def toml_text(text: str) -> str:
    """Returns a text as a string of TOML, or as a quoted key."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml_key(name: str) -> str:
    """Returns a name as a key of TOML, in quotes where it needs them."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml_text(name)


class JsonText(str):
    """A value that is JSON already."""

    __slots__ = ()


def json_text(tree: Mapping[str, Any]) -> str:
    """Returns a JSON object with a line for each of its values, and for each entry of lists but of numbers.
    Entries that are JsonText are taken as they are. Raises ValueError for a number that is not finite."""
    encode = json.JSONEncoder(allow_nan=False).encode

    def lines(value: Any) -> str:
        if not isinstance(value, list | tuple) or all(isinstance(entry, int | float) for entry in value):
            return encode(value)
        texts = (entry if isinstance(entry, JsonText) else encode(entry) for entry in value)
        return "[\n  " + ",\n  ".join(texts) + "\n ]"

    return "{\n" + ",\n".join(f" {encode(key)}: {lines(value)}" for key, value in tree.items()) + "\n}"


def parse_json(data: bytes | memoryview, file: object = None, *, limit: int = JSON_BYTES) -> Any:
    """Parses UTF-8 JSON of at most `limit` bytes. Raises FormatError (file, place, limit)."""
    if len(data) > limit:
        raise FormatError(f"{len(data)} bytes of JSON, limit {limit}", file=file)
    try:
        with _WithoutGarbageCollection():
            tree = json.loads(
                bytes(data).decode(), parse_constant=_refuse_constant, object_pairs_hook=_unique_keys
            )
    except UnicodeDecodeError as error:
        raise FormatError("is not UTF-8", file=file, place=f"byte {error.start}") from None
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise FormatError(f"is not JSON: {error.msg}", file=file, place=place) from None
    except ValueError as error:
        raise FormatError(f"is not JSON: {_reason(error)}", file=file) from None
    except RecursionError:
        raise _too_deep(FormatError, file) from None
    except MemoryError:
        raise FormatError("does not fit into memory", file=file) from None
    _require_plain(tree, file, FormatError, finite=True)
    return tree


def read_json(path: Path) -> Any:
    """Parses a JSON file of at most JSON_BYTES. Raises OSError as `open_file` and FormatError as
    `parse_json`."""
    return parse_json(read_file(path, JSON_BYTES), path)


def parse_toml(
    data: bytes, file: object, error: type[ParadizeError] = FormatError, *, mend: str | None = None
) -> dict[str, Any]:
    """Parses UTF-8 TOML. Raises `error` (file, place, limit). mend: advice for a file that is not TOML."""
    if len(data) > TOML_BYTES:
        raise error(f"holds {len(data)} bytes, limit {TOML_BYTES}", file=file)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        raise error(f"byte {cause.start} is not UTF-8", file=file, mend="save it as UTF-8") from None
    without_strings = _OPAQUE.sub(_blank, text)
    if match := _MANY_PARTS.search(without_strings):
        place = f"line {without_strings.count(chr(10), 0, match.start()) + 1}"
        raise error(f"a key has more than {KEY_PARTS} parts", file=file, place=place)
    try:
        with _WithoutGarbageCollection():
            tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError as cause:
        raise error(f"is not TOML: {cause}", file=file, mend=mend) from None
    except ValueError as cause:
        raise error(f"is not TOML: {_reason(cause)}", file=file) from None
    except RecursionError:
        raise _too_deep(error, file) from None
    _require_plain(tree, file, error, finite=False)
    return tree


def _blank(match: re.Match[str]) -> str:
    """Replaces a string by a word and a comment by nothing, and keeps the number of lines."""
    text = match[0]
    return "" if text[0] == "#" else "\n" * text.count("\n") + "q"


def json_kind(tree: Any) -> str:
    """The kind of a JSON value in words: "a list"."""
    kinds = {dict: "an object", list: "a list", str: "a text", bool: "true or false", type(None): "null"}
    return kinds.get(type(tree), "a number")


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a JSON number")


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) != len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"an object holds the key {twice[:40]!r} twice")
    return result


def _reason(error: ValueError) -> str:
    """The message of an error. Python's own message about long integers is replaced: it says how to raise the
    limit."""
    return "a whole number of more than 4300 digits" if "int_max_str_digits" in str(error) else str(error)


def _too_deep(error: type[ParadizeError], file: object) -> ParadizeError:
    return error(f"is nested too deeply: more than {DEPTH} levels", file=file)


def _require_plain(tree: Any, file: object, error: type[ParadizeError], *, finite: bool) -> None:
    """Raises `error` for input that is nested too deeply and for numbers or texts out of range. Works level
    by level, so that nothing recurses before the depth is known."""
    level = [tree]
    for _ in range(DEPTH):
        below = []
        for part in level:
            if type(part) is dict:
                for key in part:
                    if not key.isascii() and not _is_unicode(key):
                        raise error("a key is not valid Unicode", file=file, place=_path(tree, part))
            values = part.values() if type(part) is dict else part if type(part) is list else (part,)
            for value in values:
                kind = type(value)
                if kind is dict or kind is list:
                    below.append(value)
                elif kind is int:
                    if not -WHOLE <= value < WHOLE:
                        what = f"a whole number of {value.bit_length()} bits, limit 64"
                        raise error(what, file=file, place=_path(tree, value))
                elif kind is float:
                    if finite and not math.isfinite(value):
                        what = "a number beyond the largest float64"
                        raise error(what, file=file, place=_path(tree, value))
                elif kind is str and not value.isascii() and not _is_unicode(value):
                    raise error("not valid Unicode", file=file, place=_path(tree, value))
        if not below:
            return
        level = below
    raise _too_deep(error, file)


def _is_unicode(text: str) -> bool:
    """Whether a text holds no half of a surrogate pair."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _path(tree: Any, value_at: object) -> str | None:
    """The key path of a value in a tree, such as a.b[3]; None for the tree itself."""
    if tree is value_at:
        return None
    trail: list[Any] = []
    levels = [_members(tree)]
    while levels:
        for key, value in levels[-1]:
            if value is value_at:
                names = [f"[{name}]" if type(name) is int else f".{name}" for name in (*trail, key)]
                return ascii("".join(names).removeprefix("."))[1:-1]
            if type(value) is dict or type(value) is list:
                trail.append(key)
                levels.append(_members(value))
                break
        else:
            levels.pop()
            del trail[-1:]
    return None


def _members(part: Any) -> Iterator[tuple[Any, Any]]:
    return iter(part.items()) if type(part) is dict else enumerate(part)


class _WithoutGarbageCollection:
    """Disables the garbage collector while a tree is built: it would scan the growing tree again and
    again."""

    def __enter__(self) -> None:
        self.enabled = gc.isenabled()
        gc.disable()

    def __exit__(self, *_: object) -> None:
        if self.enabled:
            gc.enable()

"""JSON and TOML that others wrote, read in time that grows with their bytes alone.

What a parser would take longer for is refused before it begins, with the place and the limit. JSON is RFC
8259's and no more: no NaN, no key twice. Whole numbers fit into 64 bits and others into a float64, texts are
Unicode, and little is nested: so that nothing overflows that is computed from them.
"""

from __future__ import annotations

import gc
import json
import math
import re
import tomllib
from typing import TYPE_CHECKING, Any, NoReturn

from paradize.errors import FormatError, ParadizeError
from paradize.files import read_file

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SCENE_FILE = "scene.json"  # the document of a baked folder
JSON_BYTES = 64 << 20  # the player's limit as well
TOML_BYTES = 4 << 20
DEPTH = 64  # tables and lists inside one another
KEY_PARTS = 16  # of a TOML key: a.b.c has three. A parser's work grows with their square
WHOLE = 1 << 63  # the least whole number that does not fit into 64 bits

# TOML's strings and comments, which may hold anything, an open one to its line's or the file's end. Nothing
# that was matched is given back, so that every character is looked at once.
_OPAQUE = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}|\Z)'
    r"|'''(?:[^']|'(?!''))*+(?:'{3,5}|\Z)"
    r'|"(?:[^"\\\n]|\\[^\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
_MANY_PARTS = re.compile(rf"(?<![ \t])(?:[ \t]*+\.[ \t]*+[\w-]++){{{KEY_PARTS}}}")


def parse_json(data: bytes | memoryview, file: object = None, *, most: int = JSON_BYTES) -> Any:
    """What JSON in UTF-8 holds. Raises FormatError (file, place, limit)."""
    if len(data) > most:
        raise FormatError(f"{len(data)} bytes of JSON, limit {most}", file=file)
    try:
        with _AtOnce():
            tree = json.loads(
                bytes(data).decode(), parse_constant=_refuse_constant, object_pairs_hook=_unique_keys
            )
    except UnicodeDecodeError as error:
        raise FormatError("is not UTF-8", file=file, place=f"byte {error.start}") from None
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise FormatError(f"is not JSON: {error.msg}", file=file, place=place) from None
    except ValueError as error:
        raise FormatError(f"is not JSON: {_digits(error)}", file=file) from None
    except RecursionError:
        raise _too_deep(FormatError, file) from None
    except MemoryError:
        raise FormatError("does not fit into memory", file=file) from None
    _require_plain(tree, file, FormatError, finite=True)
    return tree


def read_json(path: Path) -> Any:
    """What a JSON file of at most JSON_BYTES holds. Raises OSError as `open_file` and FormatError as
    `parse_json`."""
    return parse_json(read_file(path, JSON_BYTES), path)


def parse_toml(
    data: bytes, file: object, error: type[ParadizeError] = FormatError, *, mend: str | None = None
) -> dict[str, Any]:
    """What TOML in UTF-8 holds. Raises `error` (file, place, limit); mend: of what is no TOML."""
    if len(data) > TOML_BYTES:
        raise error(f"holds {len(data)} bytes, limit {TOML_BYTES}", file=file)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as wrong:
        raise error(f"byte {wrong.start} is not UTF-8", file=file, mend="save it as UTF-8") from None
    bare = _OPAQUE.sub(_bare, text)
    if found := _MANY_PARTS.search(bare):
        place = f"line {bare.count(chr(10), 0, found.start()) + 1}"
        raise error(f"a key has more than {KEY_PARTS} parts", file=file, place=place)
    try:
        with _AtOnce():
            tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError as wrong:
        raise error(f"is not TOML: {wrong}", file=file, mend=mend) from None
    except ValueError as wrong:
        raise error(f"is not TOML: {_digits(wrong)}", file=file) from None
    except RecursionError:
        raise _too_deep(error, file) from None
    _require_plain(tree, file, error, finite=False)
    return tree


def _bare(found: re.Match[str]) -> str:
    """A word for a string, nothing for a comment; lines stay where they are."""
    text = found[0]
    return "" if text[0] == "#" else "\n" * text.count("\n") + "q"


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of it")


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"an object holds the key {twice[:40]!r} twice")
    return found


def _digits(error: ValueError) -> str:
    """The error in words; Python's own of many digits tells how to raise its limit."""
    return "a whole number of more than 4300 digits" if "int_max_str_digits" in str(error) else str(error)


def _too_deep(error: type[ParadizeError], file: object) -> ParadizeError:
    return error(f"is nested too deeply: more than {DEPTH} levels", file=file)


def _require_plain(tree: Any, file: object, error: type[ParadizeError], *, finite: bool) -> None:
    """Raises `error` for what is nested too deeply, and for a number or a text that is beyond what others
    hold. Level by level: nothing recurses before the depth is known."""
    level = [tree]
    for _ in range(DEPTH):
        below = []
        for part in level:
            if type(part) is dict:
                for key in part:
                    if not key.isascii() and not _is_unicode(key):
                        raise error("a key is no Unicode text", file=file, place=_path(tree, part))
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
                    raise error("no Unicode text", file=file, place=_path(tree, value))
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


def _path(tree: Any, sought: object) -> str | None:
    """The key path of a part of a tree; None where it is the whole. No deeper than DEPTH."""
    if tree is sought:
        return None
    trail: list[Any] = []
    levels = [_members(tree)]
    while levels:
        for key, value in levels[-1]:
            if value is sought:
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


class _AtOnce:
    """While a tree is made, the garbage collector would look at all of it again and again: nothing of it is
    garbage."""

    def __enter__(self) -> None:
        self.enabled = gc.isenabled()
        gc.disable()

    def __exit__(self, *_: object) -> None:
        if self.enabled:
            gc.enable()

"""Fields that name source files, beside the scene or below it."""

from __future__ import annotations

import os
from dataclasses import MISSING
from pathlib import Path
from typing import Any

from paradize.documents import toml_text
from paradize.errors import mend_of_reading
from paradize.files import is_there, missing_reason, resolved
from paradize.scene.schema.field import Faults, declare, show
from paradize.spelling import similar

_FILE = {"type": "string", "minLength": 1}


def _source(value: object, place: str, faults: Faults) -> Path | None:
    if not isinstance(value, str) or not value or "\0" in value:
        faults.add(place, f"is {show(value)}, not a file", "write a path relative to the scene's folder")
        return None
    try:
        named = faults.folder / value
        path = resolved(named)
        inside = path.is_relative_to(faults.folder)
        there = inside and is_there(path)
    except OSError as error:
        what = f"{show(value)} cannot be read: {error.strerror or error}"
        faults.add(place, what, mend_of_reading(error) or "name a file that can be read")
        return None
    if not inside:
        linked = Path(os.path.normpath(named)).is_relative_to(faults.folder)
        what = f"is a link to {path}, which lies outside" if linked else "lies outside"
        faults.add(place, f"{show(value)} {what} the scene's folder", f"copy it into {faults.folder}")
        return None
    if not there:
        link = missing_reason(named)
        what = f"{show(value)} {link}" if link else f"there is no file {show(value)}"
        other = None if link else similar(faults.folder, value)
        faults.add(place, what, f"did you mean {show(other)}?" if other else f"looked for in {faults.folder}")
        return None
    # A link keeps its own name, so that a bake notices when its target changes.
    return path if os.path.normpath(named) == str(path) else named


def source(default: Any = MISSING, *, key: str | None = None, meaning: str = "") -> Any:
    """A file, relative to the scene's folder and inside it. key: its name in the file where that differs."""
    return declare(_source, default, "a file", json=_FILE, meaning=meaning, key=key)


def sources(
    default: Any = MISSING, *, size: int, most: int | None = None, or_one: bool = False, meaning: str = ""
) -> Any:
    """`size` files, `size` to `most`, or `size` or one, each relative to the scene's folder and inside it."""
    count = f"1 or {size}" if or_one else str(size) if most is None else f"{size} to {most}"
    counts = {1, size} if or_one else range(size, (most or size) + 1)

    def rule(value: object, place: str, faults: Faults) -> tuple[Path, ...] | None:
        if not isinstance(value, list) or len(value) not in counts:
            brackets = (
                f" in brackets, as [{toml_text(value)}]" if isinstance(value, str) and len(value) < 60 else ""
            )
            faults.add(place, f"is {show(value)}", f"write {count} files{brackets}")
            return None
        paths = [_source(item, f"{place}[{i}]", faults) for i, item in enumerate(value)]
        return None if None in paths else tuple(path for path in paths if path is not None)

    json: dict[str, Any] = {"type": "array", "items": _FILE, "minItems": min(counts), "maxItems": max(counts)}
    if or_one:
        json["anyOf"] = [{"maxItems": 1}, {"minItems": size}]
    return declare(rule, default, f"{count} files", json=json, meaning=meaning)

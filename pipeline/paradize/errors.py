"""The exception tree. Every error a person can meet says: file, place, value, limit, mend.

ParadizeError
├── SourceError    an input file is missing, broken or outside what Paradize accepts
├── SceneError     the scene TOML asks for something that does not exist or is out of range
├── FormatError    a baked file is not what its format says
├── BakeError      a stage could not do its work on valid input
└── GroupedError   all of a run's errors, told together
"""

from __future__ import annotations

import re
from collections.abc import Iterable

_CONTROL = r"[\x00-\x1f\x7f-\x9f\u2028\u2029]"


def one_line(text: str) -> str:
    """The text with control characters and line ends escaped: names of files may hold any."""
    if text.isprintable():
        return text
    return re.sub(_CONTROL, lambda found: ascii(found.group())[1:-1], text)


class ParadizeError(Exception):
    """One message for a person: `file: place: what is wrong (value, limit); mend`."""

    def __init__(
        self, what: str, *, file: object = None, place: str | None = None, mend: str | None = None
    ) -> None:
        self.what = what
        self.file = None if file is None else str(file)
        self.place = place
        self.mend = mend
        head = ": ".join(part for part in (self.file, place) if part)
        message = f"{head}: {what}" if head else what
        super().__init__(f"{message}; {mend}" if mend else message)


class SourceError(ParadizeError):
    """A source file is missing, broken or outside what Paradize accepts."""


class SceneError(ParadizeError):
    """A scene TOML names something that does not exist or is out of range."""


class FormatError(ParadizeError):
    """A baked file is not what its format says."""


class BakeError(ParadizeError):
    """A stage could not do its work on valid input."""


class GroupedError(ParadizeError):
    """Everything that was found wrong in one run: told together, not one a day."""

    def __init__(self, errors: Iterable[ParadizeError]) -> None:
        self.errors: tuple[ParadizeError, ...] = tuple(
            part
            for error in errors
            for part in (error.errors if isinstance(error, GroupedError) else (error,))
        )
        super().__init__("\n".join(str(error) for error in self.errors))

    def __reduce__(self) -> tuple[type[GroupedError], tuple[tuple[ParadizeError, ...]]]:
        return GroupedError, (self.errors,)

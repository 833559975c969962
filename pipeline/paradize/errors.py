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
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

# Control characters, line separators, marks of direction, and characters that show nothing. The player's
# app/messages.cpp has the same list.
_UNSEEN = (
    r"[\x00-\x1f\x7f-\x9f\xad\u061c\u180e\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufe00-\ufe0f\ufeff\ufff9-\ufffb"
    r"\U0001d173-\U0001d17a\U000e0000-\U000e0fff]"
)

MOST = 800  # characters of one part of a message
_LINES = 5  # line numbers that one message lists
MOST_ADVICE = 2000  # of a mend, which may list all that is known


def one_line(text: str) -> str:
    """The text with line ends and what a terminal obeys or hides escaped: names of files may hold any."""
    return re.sub(_UNSEEN, lambda found: ascii(found.group())[1:-1], text)


def bounded(text: str, most: int = MOST) -> str:
    """The text on one line of at most so many characters: what is too long loses its middle. Every part of
    every message goes through here, so that no broken file fills a screen."""
    text = one_line(text)
    if len(text) <= most:
        return text
    tail = most // 3
    return f"{text[: most - tail - 5]} ... {text[-tail:]}"


def merged(texts: Iterable[str]) -> list[str]:
    """Messages without repeats. Those that differ only in their line number (`: line 7: `) become one
    that lists the numbers."""
    lines: dict[str, list[str]] = {}
    for text in dict.fromkeys(texts):
        found = re.search(r"(?<=: )line (\d+)(?=: )", text)
        key = text if found is None else f"{text[: found.start()]}\0{text[found.end() :]}"
        lines.setdefault(key, []).extend([] if found is None else [found[1]])
    out = []
    for key, numbers in lines.items():
        listed = ", ".join(numbers[:_LINES]) + (
            f" and {more} more" if (more := len(numbers) - _LINES) > 0 else ""
        )
        out.append(
            key.replace("\0", f"{'line' if len(numbers) == 1 else 'lines'} {listed}", 1) if numbers else key
        )
    return out


class ParadizeError(Exception):
    """One message for a person: `file: place: what is wrong (value, limit); mend`."""

    def __init__(
        self, what: str, *, file: object = None, place: str | None = None, mend: str | None = None
    ) -> None:
        self.what = bounded(what)
        self.file = None if file is None else str(file)
        self.place = place and bounded(place)
        self.mend = mend and bounded(mend, MOST_ADVICE)
        head = ": ".join(part for part in (self.file, self.place) if part)
        message = f"{head}: {self.what}" if head else self.what
        super().__init__(f"{message}; {self.mend}" if self.mend else message)

    def __reduce__(self) -> tuple[Any, ...]:
        return _remade, (type(self), self.what, self.file, self.place, self.mend), self.__dict__


def _remade(
    kind: type[ParadizeError], what: str, file: str | None, place: str | None, mend: str | None
) -> ParadizeError:
    """An error as another process raised it."""
    return kind(what, file=file, place=place, mend=mend)


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
        super().__init__(f"{len(self.errors)} errors")
        self.args = ("\n".join(str(error) for error in self.errors),)

    def __reduce__(self) -> tuple[Any, ...]:
        return GroupedError, (self.errors,)

"""The exceptions. Each message for a user says: file, place, what is wrong (value, limit), what to do.

ParadizeError
├── SourceError    an input file is missing, broken or not accepted
├── SceneError     the scene TOML names something that does not exist or is out of range
├── FormatError    a baked file does not follow its format
├── BakeError      a stage failed on valid input
├── ArgumentError  a program called a function of the library with a wrong argument
└── GroupedError   all errors of a run, reported together
"""

from __future__ import annotations

import errno
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

# Control characters, line separators, direction marks and characters without a glyph. The player's
# app/messages.cpp has the same list, but keeps tabs and line feeds.
_INVISIBLE = (
    r"[\x00-\x1f\x7f-\x9f\xad\u061c\u180e\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufe00-\ufe0f\ufeff\ufff9-\ufffb"
    r"\U0001d173-\U0001d17a\U000e0000-\U000e0fff]"
)

MAX_PART = 800  # of each part of a message
_LINES = 5  # line numbers that one message lists
MAX_MEND = 2000  # of the advice, which may list all known names


def one_line(text: str) -> str:
    """Escapes line ends and invisible or control characters, which names of files may contain."""
    return re.sub(_INVISIBLE, lambda match: ascii(match.group())[1:-1], text)


def bounded(text: str, limit: int = MAX_PART) -> str:
    """Returns the text on one line of at most `limit` characters. Cuts the middle out of a longer text. All
    parts of all messages go through this function, so no broken file can fill a screen."""
    text = one_line(text)
    if len(text) <= limit:
        return text
    tail = limit // 3
    return f"{text[: limit - tail - 5]} ... {text[-tail:]}"


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
    """A message for a user: `file: place: what is wrong (value, limit); what to do`.

    what: the fault. file: the file's path. place: line, texel, JSON path ... mend: what to do about it.
    """

    def __init__(
        self, what: str, *, file: object = None, place: str | None = None, mend: str | None = None
    ) -> None:
        self.what = bounded(what)
        self.file = None if file is None else str(file)
        self.place = place and bounded(place)
        self.mend = mend and bounded(mend, MAX_MEND)
        head = ": ".join(part for part in (self.file, self.place) if part)
        message = f"{head}: {self.what}" if head else self.what
        super().__init__(f"{message}; {self.mend}" if self.mend else message)

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (type(self), self.what, self.file, self.place, self.mend), self.__dict__

    def renamed(self, names: Mapping[str, str]) -> ParadizeError:
        """The error with other words for some paths, by path."""
        parts = [renamed(part, names) for part in (self.file, self.place, self.what, self.mend)]
        return _rebuild(type(self), str(parts[2]), parts[0], parts[1], parts[3])


def renamed(text: str | None, names: Mapping[str, str]) -> str | None:
    """The text with other words for some paths, by path."""
    for path, name in names.items():
        text = text and text.replace(path, name)
    return text


def _rebuild(
    kind: type[ParadizeError], what: str, file: str | None, place: str | None, mend: str | None
) -> ParadizeError:
    """Restores an unpickled error from another process."""
    return kind(what, file=file, place=place, mend=mend)


class SourceError(ParadizeError):
    """A source file is missing, broken or not accepted."""


class SceneError(ParadizeError):
    """A scene TOML names something that does not exist or is out of range."""


class FormatError(ParadizeError):
    """A baked file does not follow its format."""


class BakeError(ParadizeError):
    """A stage failed on valid input."""


def unexpected(error: Exception, where: str = "", file: str | None = None) -> BakeError:
    """Returns the error for an exception that no code expects: a limit of the machine that was reached, with
    its mend, or a fault of Paradize. where: the line that raised it."""
    number = error.errno if isinstance(error, OSError) else None
    if number in (errno.EMFILE, errno.ENFILE):
        return BakeError("too many open files", file=file, mend="allow more: `ulimit -n 1024`")
    if number in (errno.EAGAIN, errno.ENOMEM) or isinstance(error, MemoryError):
        what = f"the system refuses more processes or memory: {error}".removesuffix(": ")
        return BakeError(what, file=file, mend="allow more (`ulimit -a`), or work with fewer: `-j 1`")
    if isinstance(error, FileNotFoundError) and error.filename is None:  # of getcwd
        return BakeError("the current folder does not exist any more", mend="change into another folder")
    what = f"internal error: {type(error).__name__}: {error}{where}"
    return BakeError(what, file=file, mend="please report it")


def unread(
    error: OSError, file: object, mend: str | None = None, kind: type[ParadizeError] = SourceError
) -> ParadizeError:
    """Returns the error of a file that cannot be read. mend: where `mend_of_reading` knows none."""
    return kind(f"cannot be read: {error.strerror or error}", file=file, mend=mend_of_reading(error) or mend)


def mend_of_reading(error: OSError) -> str:
    """Advice for a file that this user may not read, whatever it is for; empty for other errors."""
    forbidden = error.errno in (errno.EACCES, errno.EPERM)
    return (
        "let this user read it and enter its folder (`chmod`), or make a copy that may be read"
        if forbidden
        else ""
    )


class ArgumentError(ParadizeError, TypeError, ValueError):
    """A program called a function of the library with an argument that is not allowed."""


class GroupedError(ParadizeError):
    """All errors of a run, reported together. Groups inside groups are flattened."""

    def __init__(self, errors: Iterable[ParadizeError]) -> None:
        self.errors: tuple[ParadizeError, ...] = tuple(
            part
            for error in errors
            for part in (error.errors if isinstance(error, GroupedError) else (error,))
        )
        super().__init__(f"{len(self.errors)} errors")
        self.args = ("\n".join(str(error) for error in self.errors),)

    def renamed(self, names: Mapping[str, str]) -> GroupedError:
        """All errors, renamed."""
        return GroupedError(error.renamed(names) for error in self.errors)

    def __reduce__(self) -> tuple[Any, ...]:
        return GroupedError, (self.errors,)

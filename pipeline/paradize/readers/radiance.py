"""Radiance pictures with a long header, which OpenImageIO refuses: it reads a hundred lines, and takes a line
of 128 bytes for the end.

Radiance's own programs (pcompos, pfilt) add a line for each command and each picture that they join. Of all
lines only variables (FORMAT, EXPOSURE) are about the texels. Source: G. Ward, "Radiance File Formats", 1997.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import TYPE_CHECKING

from paradize.files import read_file

if TYPE_CHECKING:
    from collections.abc import Iterator

_MOST_HEADER = 1 << 20  # bytes
_END = re.compile(rb"\n\r?\n")
_VARIABLE = re.compile(rb"[A-Z]+\s*=.{0,99}", re.S)
_FORMAT = b"FORMAT="


@contextmanager
def with_short_header(path: Path) -> Iterator[Path | None]:
    """Makes a copy of a picture whose header holds only the variables, for as long as the context lasts; None
    where the header declares no format, or holds nothing else. Raises OSError as read_file."""
    data = read_file(path)
    end = _END.search(data, 0, _MOST_HEADER)
    first, *lines = data[: end.start()].splitlines() if end else [b""]
    kept = [line for line in lines if _VARIABLE.fullmatch(line)]
    declared = first.startswith(b"#?") and any(line.startswith(_FORMAT) for line in kept)
    if end is None or not declared or kept == lines:
        yield None
        return
    with NamedTemporaryFile(prefix="paradize-", suffix=".hdr") as copy:
        copy.write(b"\n".join([first, *kept]) + b"\n\n")
        copy.write(memoryview(data)[end.end() :])
        copy.flush()
        yield Path(copy.name)

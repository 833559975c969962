"""Writes, as a kernel is built, the source that tells of what it was built: one digest of sources, headers,
flags and compiler.

CMake runs it: `digest.py OUT.cpp FLAGS SOURCE...`. jobs/code.py reads the digest, from the file or from the
module that is loaded. A file that would stay as it is, is not written, so that nothing is linked anew.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterable
from pathlib import Path

_ROOT = Path(__file__).resolve().parent  # of #include "topic/file.hpp"
_INCLUDE = re.compile(rb'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.MULTILINE)
_TEXT = """// Written by digest.py: what this module was built of.
extern "C" {{
extern const char paradize_digest[] __attribute__((visibility("default")));
const char paradize_digest[] = "paradize-kernel-digest:{}";
}}
"""


def all_files(sources: Iterable[Path]) -> list[Path]:
    """The sources and every file of ours that they include, also through others; sorted."""
    todo = [path.resolve() for path in sources]
    found = set(todo)
    while todo:
        path = todo.pop()
        for name in _INCLUDE.findall(path.read_bytes()):
            for folder in (path.parent, _ROOT):
                included = (folder / name.decode()).resolve()
                if included.is_file() and included not in found:
                    found.add(included)
                    todo.append(included)
    return sorted(found)


def digest_of(flags: str, sources: Iterable[Path]) -> str:
    """SHA-256 over the flags and over names and bytes of all files. Folders do not count."""
    digest = hashlib.sha256(flags.encode() + b"\0")
    for path in all_files(sources):
        digest.update(path.name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def main(out: str, flags: str, *sources: str) -> None:
    """Writes the source `out` where it is not that already."""
    text = _TEXT.format(digest_of(flags, map(Path, sources)))
    path = Path(out)
    if not path.is_file() or path.read_text() != text:
        path.write_text(text)


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Writes a C++ source with the digest of a kernel: of its sources, headers, flags and compiler.

CMake runs `digest.py OUT.cpp FLAGS SOURCE...`. jobs/code.py reads the digest from the file or from the loaded
module. An unchanged output is not written, so that nothing is linked again.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterable
from pathlib import Path

_ROOT = Path(__file__).resolve().parent  # base folder of #include "topic/file.hpp"
_INCLUDE = re.compile(rb'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.MULTILINE)
_TEXT = """// Written by digest.py: what this module was built of.
extern "C" {{
extern const char paradize_digest[] __attribute__((visibility("default")));
const char paradize_digest[] = "paradize-kernel-digest:{}";
}}
"""


def all_files(sources: Iterable[Path]) -> list[Path]:
    """The sources and all files of this project that they include, directly or indirectly; sorted."""
    unread = [path.resolve() for path in sources]
    files = set(unread)
    while unread:
        path = unread.pop()
        for name in _INCLUDE.findall(path.read_bytes()):
            for folder in (path.parent, _ROOT):
                included = (folder / name.decode()).resolve()
                if included.is_file() and included not in files:
                    files.add(included)
                    unread.append(included)
    return sorted(files)


def digest_of(flags: str, sources: Iterable[Path]) -> str:
    """SHA-256 over the flags and over names and bytes of all files. Folder names are ignored."""
    digest = hashlib.sha256(flags.encode() + b"\0")
    for path in all_files(sources):
        digest.update(path.name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def main(out: str, flags: str, *sources: str) -> None:
    """Writes the source `out` if it differs."""
    text = _TEXT.format(digest_of(flags, map(Path, sources)))
    path = Path(out)
    if not path.is_file() or path.read_text() != text:
        path.write_text(text)


if __name__ == "__main__":
    main(*sys.argv[1:])

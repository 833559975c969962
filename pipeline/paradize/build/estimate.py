"""Estimates the memory and the longest time of a bake from the sizes of its sources.

An estimate only decides which jobs run side by side (jobs/pool.py). No result depends on it, and a source
with a wrong size is found out by its worker's real memory. Sizes of pictures are read here, because this
process is the command line: a library that fails on a hostile file would end it.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from paradize.files import open_file
from paradize.kinds import MODEL_SUFFIXES

_BASE = 150_000_000  # an interpreter with numpy, and the readers
_PER_TEXEL = 48  # bytes, all maps of a picture with their measures
_PER_OBJ_BYTE = 12
_PER_GLTF_BYTE = 100  # of one with 32 bytes a vertex; packed ones take more
_BYTES_PER_S = 1_000_000  # of that memory: the slowest tier on the slowest machine does more
_HEAD = 1 << 16  # of a JPEG, where its size should stand; metadata may be longer


def memory_of(sources: Iterable[Path]) -> int:
    """Returns the bytes that a bake of these files may take. Unreadable files count nothing."""
    return _BASE + sum(_memory_of_one(path) for path in sources)


def seconds_of(sources: Iterable[Path]) -> float:
    """Returns the seconds after which a bake of these files must hang."""
    return memory_of(sources) / _BYTES_PER_S


def _memory_of_one(path: Path) -> int:
    try:
        size = path.stat().st_size
        if path.suffix.lower() in MODEL_SUFFIXES:
            return (_PER_OBJ_BYTE if path.suffix.lower() == ".obj" else _PER_GLTF_BYTE) * size
        with open_file(path) as stream:
            head = stream.read(_HEAD)
    except OSError:
        return 0
    texels = _png_texels(head) or _jpeg_texels(head)
    return _PER_TEXEL * (size if texels is None else texels)  # of others about a byte a texel is on disk


def _png_texels(head: bytes) -> int | None:
    if head[:8] != b"\x89PNG\r\n\x1a\n" or head[12:16] != b"IHDR":
        return None
    return int.from_bytes(head[16:20], "big") * int.from_bytes(head[20:24], "big")


def _jpeg_texels(head: bytes) -> int | None:
    """Reads the size from the first frame header."""
    if head[:2] != b"\xff\xd8":
        return None
    at = 2
    while at + 9 <= len(head) and head[at] == 0xFF:
        kind = head[at + 1]
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            return int.from_bytes(head[at + 5 : at + 7], "big") * int.from_bytes(head[at + 7 : at + 9], "big")
        at += 2 + int.from_bytes(head[at + 2 : at + 4], "big")
    return None

"""Rules for a KTX2: mip chain, numbers, and the format."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

from paradize.checks.rules import Finding
from paradize.data import Texture
from paradize.errors import FormatError
from paradize.formats.ktx2.layout import FORMATS, IDENTIFIER, full_level_count, level_bytes
from paradize.formats.ktx2.reader import decode_ktx2

_FLOATS = {"RGBA16F": np.float16, "R32F": np.float32}
_BY_NUMBER = {entry.vk: name for name, entry in FORMATS.items()}
_LEVEL_INDEX = 80  # bytes before it


def check_texture(
    data: bytes, file: str, *, color: bool | None = None, last: int | None = None
) -> Iterator[Finding]:
    """The findings in a KTX2's bytes. color: whether a scene reads it as colour; last: the coarsest level
    that a scene lets the player read; None: not known."""
    broken = list(_chain(data, file))
    yield from broken
    if broken:
        return
    try:
        texture = decode_ktx2(data, file)
    except FormatError as error:
        yield Finding("PZ102", file, error.what, error.place or "")
        return
    yield from _numbers(texture, file)
    if color is not None and color != texture.format.endswith("_SRGB"):
        what = f"a {'colour map' if color else 'data map'} in {texture.format}"
        yield Finding("PZ303", file, what)
    if last is not None and last >= len(texture.levels):
        what = f"scene.json's max_level is {last}; the texture's levels are 0 to {len(texture.levels) - 1}"
        yield Finding("PZ304", file, what, f"level {last}")


def _chain(data: bytes, file: str) -> Iterator[Finding]:
    """Reads the level index alone: every level down to 1 x 1 is there and has the bytes of its format."""
    if data[:12] != IDENTIFIER or len(data) < _LEVEL_INDEX:
        yield Finding("PZ102", file, "is not a KTX2", "byte 0")
        return
    number, _, width, height, depth, layers, faces, count, packed = struct.unpack_from("<9I", data, 12)
    name = _BY_NUMBER.get(number)
    known = name is not None and packed in (0, 2) and faces in (1, 6)
    if name is None or not known or depth or layers or not width or not height:
        yield Finding("PZ102", file, f"VkFormat {number} of a kind that Paradize does not read", "byte 12")
        return
    wanted = full_level_count(width, height)
    if count != wanted:
        levels = "1 level" if count == 1 else f"{count} levels"
        yield Finding("PZ301", file, f"{levels}, {width} x {height} needs {wanted}", "byte 40")
        return
    for level in range(count):
        place = f"level {level}"
        at = _LEVEL_INDEX + 24 * level
        if at + 24 > len(data):
            yield Finding("PZ301", file, "the level index is cut short", place)
            return
        offset, stored, length = struct.unpack_from("<3Q", data, at)
        needed = level_bytes(name, width, height, level, faces)
        if not packed:
            length = stored
        if length != needed or offset + stored > len(data):
            held = min(length, max(0, len(data) - offset))
            yield Finding("PZ301", file, f"{held} bytes, needs {needed}", place)
            return


def _numbers(texture: Texture, file: str) -> Iterator[Finding]:
    kind = _FLOATS.get(texture.format)
    if kind is None:
        return
    for level, texels in enumerate(texture.levels):
        bad = ~np.isfinite(np.frombuffer(texels, kind))
        if bad.any():
            place = f"level {level} value {int(np.argmax(bad))}"
            yield Finding("PZ302", file, "a texel that is not finite", place, int(bad.sum()))

"""Picture files written byte by byte, so that what they hold is known whatever a library makes of it."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

Pixels = npt.NDArray[np.generic]
_SAMPLE = {"u": 1, "i": 2, "f": 3}
_CODES = {2: "s", 3: "H", 4: "I", 12: "d", 16: "Q"}


# Adam7: the first column and row of each pass, and the steps to the next.
ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))


def png(
    path: Path,
    codes: npt.NDArray[np.integer],
    kind: int,
    bits: int,
    *,
    interlaced: bool = False,
    chunks: Mapping[bytes, bytes] | None = None,
) -> Path:
    """A PNG of these codes (h, w, channels): indices of a palette where the colour type `kind` is 3. chunks:
    those before the pixels (PLTE, tRNS). Rows are filtered by all five filters in turn."""
    rows, columns, channels = codes.shape
    head = struct.pack(">IIBBBBB", columns, rows, bits, kind, 0, 0, interlaced)
    step = max(1, channels * bits // 8)  # bytes from a sample to the one before it
    packed = bytearray()
    for x, y, across, down in ADAM7 if interlaced else ((0, 0, 1, 1),):
        part = codes[y::down, x::across]
        if not part.size:
            continue
        above = None
        for number, row in enumerate(part):
            digits = (row.reshape(-1, 1) >> np.arange(bits - 1, -1, -1)) & 1
            plain = np.packbits(digits.astype(np.uint8)).astype(int)
            up = np.zeros_like(plain) if above is None else above
            left, corner = (np.concatenate([np.zeros(step, int), line])[: len(plain)] for line in (plain, up))
            distances = np.abs([up - corner, left - corner, left + up - 2 * corner])
            paeth = np.choose(distances.argmin(axis=0), [left, up, corner])
            guess = (0 * plain, left, up, (left + up) // 2, paeth)[number % 5]
            packed += bytes([number % 5]) + ((plain - guess) % 256).astype(np.uint8).tobytes()
            above = plain
    parts = {b"IHDR": head, **(chunks or {}), b"IDAT": zlib.compress(bytes(packed)), b"IEND": b""}
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunk(name, data) for name, data in parts.items()))
    return path


def chunk(name: bytes, data: bytes) -> bytes:
    """A chunk of a PNG: length, name, data, CRC."""
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def tiff(
    path: Path,
    pixels: Pixels,
    nodata: str | None = None,
    *,
    order: str = "<",
    big: bool = False,
    metadata: str | None = None,
    keys: Sequence[int] = (),
    transform: Sequence[float] = (),
    parts: Sequence[bytes] = (),
    more: Mapping[int, Sequence[int]] | None = None,
) -> Path:
    """A TIFF (big: BigTIFF) of one strip and one channel. nodata, metadata: GDAL's tags. keys: of a GeoTIFF,
    four numbers each after the four of their header. transform: 16 numbers from pixels to the map. order: "<"
    or ">", of its bytes. parts: packed strips, or tiles where `more`, which holds further tags, says how wide
    these are."""
    rows, columns = pixels.shape
    data = pixels.astype(pixels.dtype.newbyteorder(order)).tobytes()  # type: ignore[call-overload]
    data = b"".join(parts) or data
    head = 16 if big else 8
    whole = {256: columns, 257: rows, 258: 8 * pixels.itemsize, 259: 1, 262: 1, 273: head, 277: 1}
    whole |= {278: rows, 279: len(data), 339: _SAMPLE[pixels.dtype.kind]}
    tags: dict[int, tuple[int, Sequence[int] | bytes]] = {tag: (4, [value]) for tag, value in whole.items()}
    tags |= {tag: (4, values) for tag, values in (more or {}).items()}
    if parts:
        sizes = [len(part) for part in parts]
        starts = [head + sum(sizes[:k]) for k in range(len(parts))]
        if tiled := 322 in tags:
            tags = {tag: tags[tag] for tag in tags if tag not in (273, 278, 279)}
        tags |= {324 if tiled else 273: (4, starts), 325 if tiled else 279: (4, sizes)}
    for tag, text in ((42113, nodata), (42112, metadata)):
        if text is not None:
            tags[tag] = 2, text.encode() + b"\0"
    if keys:
        tags[34735] = 3, keys
    if transform:
        tags[34264] = 12, transform  # type: ignore[assignment]
    body, entries = head_of(order, big) + data, []
    for tag, (kind, values) in sorted(tags.items()):
        packed = (
            values
            if isinstance(values, bytes)
            else struct.pack(f"{order}{len(values)}{_CODES[kind]}", *values)
        )
        place = "Q" if big else "I"
        room = 8 if big else 4
        if len(packed) > room:
            body += b"\0" * (-len(body) % 8)
            packed, body = struct.pack(order + place, len(body)), body + packed
        entries.append(struct.pack(f"{order}HH{place}", tag, kind, len(values)) + packed.ljust(room, b"\0"))
    body += b"\0" * (-len(body) % 8)
    where = struct.pack(order + ("Q" if big else "I"), len(body))
    at = 8 if big else 4
    body = body[:at] + where + body[at + len(where) :]
    count = struct.pack(order + ("Q" if big else "H"), len(entries))
    path.write_bytes(body + count + b"".join(entries) + b"\0" * 8)
    return path


def head_of(order: str, big: bool) -> bytes:
    """The first bytes, with room for where the directory is."""
    mark = b"II" if order == "<" else b"MM"
    if big:
        return mark + struct.pack(order + "HHHQ", 43, 8, 0, 0)
    return mark + struct.pack(order + "HI", 42, 0)


_EXR_TYPES = {np.dtype(np.uint32): 0, np.dtype(np.float16): 1, np.dtype(np.float32): 2}


def exr(path: Path, channels: Mapping[str, Pixels]) -> Path:
    """An OpenEXR file of uncompressed rows: uint32, half and float channels side by side."""
    named = sorted(channels.items())
    rows, columns = named[0][1].shape

    def attribute(name: str, kind: str, data: bytes) -> bytes:
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data

    listed = b"".join(
        name.encode() + b"\0" + struct.pack("<iB3xii", _EXR_TYPES[values.dtype], 0, 1, 1)
        for name, values in named
    )
    box = struct.pack("<4i", 0, 0, columns - 1, rows - 1)
    head = struct.pack("<ii", 20000630, 2) + attribute("channels", "chlist", listed + b"\0")
    head += attribute("compression", "compression", b"\0") + attribute("dataWindow", "box2i", box)
    head += attribute("displayWindow", "box2i", box) + attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1.0))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0.0, 0.0))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1.0)) + b"\0"
    lines = []
    for y in range(rows):
        line = b"".join(values[y].tobytes() for _, values in named)
        lines.append(struct.pack("<ii", y, len(line)) + line)
    starts = len(head) + 8 * rows + np.cumsum([0, *map(len, lines)])[:-1]
    path.write_bytes(head + starts.astype("<u8").tobytes() + b"".join(lines))
    return path

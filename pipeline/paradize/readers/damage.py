"""Finds damage that decoders do not report: missing texels and values out of range.

Only contradictions inside the file can be found, not a value that was changed into another legal one.
Sources: ITU-T T.81, "JPEG", 1992, annex B; Adobe, "TIFF 6.0", 1992; Microsoft, "Bitmap storage"; J.
Poskanzer, the manual pages of netpbm (pbm, pgm, ppm, pam, pfm); D. Szablewski, "The Quite OK Image Format",
2022.
"""

from __future__ import annotations

import os
import struct
from typing import TYPE_CHECKING

import numpy as np

from paradize.errors import SourceError
from paradize.files import open_file, read_file
from paradize.readers.pnm import header_numbers, without_comments
from paradize.readers.targa import check_targa
from paradize.readers.tiff import first_directory

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def check_damage(path: Path, kind: str) -> None:
    """Raises SourceError where a file lacks texels that its header promises, or holds values that its header
    excludes. kind: OpenImageIO's name of the format. Formats whose damage decoders report are not checked."""
    check = _CHECKS.get(kind)
    if check is not None:
        check(path)


def damaged(what: str, path: Path) -> SourceError:
    """The error for a picture whose texels are not all there or not sound."""
    return SourceError(f"damaged or cut: {what}", file=path, mend="save or export it again")


def _check_jpeg(path: Path) -> None:
    """All marker segments end inside the file, there is a scan, and the file ends with the end marker."""
    data = read_file(path)
    position, scans, size = 2, 0, len(data)
    while True:
        position = data.find(b"\xff", position)
        while 0 <= position < size - 1 and data[position + 1] == 0xFF:
            position += 1
        if position < 0 or position + 1 >= size:
            raise damaged("the file ends before its picture does", path)
        marker = data[position + 1]
        if marker == 0xD9:
            break
        position += 2
        if marker == 0 or marker == 1 or 0xD0 <= marker <= 0xD8:  # no segment follows
            continue
        if position + 2 > size or position + int.from_bytes(data[position : position + 2], "big") > size:
            raise damaged(f"its segment at byte {position - 2} extends beyond the end of the file", path)
        if marker == 0xDA:
            scans += 1
        position += max(2, int.from_bytes(data[position : position + 2], "big"))
    if not scans:
        raise damaged("it holds no scan", path)


def _check_bmp(path: Path) -> None:
    """The rows of an uncompressed bitmap lie inside the file; palette indices are valid."""
    data = read_file(path)
    if len(data) < 26:
        raise damaged(f"{len(data)} bytes; a bitmap's header has 26 or more", path)
    start, header = struct.unpack_from("<II", data, 10)
    if header == 12:
        width, height, _, bits = struct.unpack_from("<HHHH", data, 18)
        packing, colors = 0, 0
    elif len(data) >= 54:
        width, height, _, bits, packing = struct.unpack_from("<iiHHI", data, 18)
        (colors,) = struct.unpack_from("<I", data, 46)
    else:
        raise damaged("its header is truncated", path)
    height = abs(height)
    if packing not in (0, 3, 6):
        return  # run-length coded: the decoder counts its texels
    stride = (width * bits + 31) // 32 * 4
    if start + stride * height > len(data):
        raise damaged(
            f"{len(data)} bytes; its {width} x {height} texels end at {start + stride * height}", path
        )
    if bits == 8 and 0 < colors < 256:
        rows = np.frombuffer(data, np.uint8, stride * height, start).reshape(height, stride)[:, :width]
        if int(rows.max(initial=0)) >= colors:
            raise damaged(f"texels of colour {int(rows.max())}; its palette has {colors}", path)


def _check_pnm(path: Path) -> None:
    """The file holds as many values as its header promises, none above its maximum."""
    data = read_file(path)
    kind = data[1:2]
    if kind not in b"23456":
        return  # PAM and PFM: the decoder counts bytes itself
    bitmap = kind == b"4"
    numbers, position = header_numbers(data, 2 if bitmap else 3)
    if len(numbers) < (2 if bitmap else 3):
        raise damaged("its header is cut", path)
    width, height = numbers[:2]
    top = 1 if bitmap else numbers[2]
    count = width * height * (3 if kind in b"36" else 1)
    if not 1 <= top <= 65535:
        raise damaged(f"its maximum value is {top}; 1 to 65535 are allowed", path)
    if kind in b"23":
        tokens = without_comments(data[position:]).split()
        if len(tokens) < count:
            raise damaged(f"{len(tokens)} values; its header promises {count}", path)
        if any(not word.isdigit() or int(word) > top for word in tokens[:count]):
            raise damaged(f"a value is not a number in 0..{top}", path)
        return
    start = position + 1
    needed = (width + 7) // 8 * height if bitmap else count * (2 if top > 255 else 1)
    if start + needed > len(data):
        raise damaged(f"{len(data) - start} bytes of texels; its header promises {needed}", path)
    if not bitmap and top not in (255, 65535):
        values = np.frombuffer(data, ">u2" if top > 255 else "u1", count, start)
        if int(values.max(initial=0)) > top:
            raise damaged(f"a value of {int(values.max())}; its header says {top} at most", path)


_OFFSETS, _COUNTS = (273, 324), (279, 325)  # of strips and of tiles


def _check_tiff(path: Path) -> None:
    """All strips or tiles of the first picture lie inside the file."""
    try:
        with open_file(path) as file:
            size = os.fstat(file.fileno()).st_size
            tags = first_directory(file, _OFFSETS + _COUNTS)
    except ValueError:
        raise damaged("its header is cut", path) from None
    except struct.error:
        raise damaged("its directory extends beyond the end of the file", path) from None
    for offsets, counts in zip(_OFFSETS, _COUNTS, strict=True):
        for offset, count in zip(tags.get(offsets, ()), tags.get(counts, ()), strict=False):
            if not offset:
                raise SourceError("strips or tiles are left out (sparse)", file=path, mend="save it whole")
            if offset + count > size:
                raise damaged(f"texels end at byte {offset + count} of {size}", path)


_QOI_END = bytes(7) + b"\1"


def _check_qoi(path: Path) -> None:
    """The file ends with the end marker: Pillow asks only for as many bytes as there may be texels."""
    if not read_file(path).endswith(_QOI_END):
        raise damaged("the file ends before its picture does", path)


_CHECKS: dict[str, Callable[[Path], None]] = {
    "targa": check_targa,
    "jpeg": _check_jpeg,
    "bmp": _check_bmp,
    "pnm": _check_pnm,
    "tiff": _check_tiff,
    "qoi": _check_qoi,
}

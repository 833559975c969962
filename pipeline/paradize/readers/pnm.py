"""What a netpbm file (PBM, PGM, PPM) says before its texels, and shares of its own largest value.

OpenImageIO stretches codes to 8 or 16 bits and cuts off what is left: 99 of 100 comes out as 252 of 255.
Source: J. Poskanzer, the manual pages of netpbm (pbm, pgm, ppm).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.files import open_file

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    from paradize.data import F32

HEADER_BYTES = 1 << 16  # comments may be long


def header_numbers(data: bytes, wanted: int) -> tuple[list[int], int]:
    """The first numbers after a two-byte magic, comments skipped, and the byte after the last digit."""
    numbers: list[int] = []
    at = 2
    while at < len(data) and len(numbers) < wanted:
        if data[at : at + 1] == b"#":
            end = data.find(b"\n", at)
            at = len(data) if end < 0 else end
        elif data[at : at + 1].isdigit():
            end = at
            while data[end : end + 1].isdigit() and end - at < 10:
                end += 1
            numbers.append(int(data[at:end]))
            at = end
        elif data[at : at + 1].isspace():
            at += 1
        else:
            break
    return numbers, at


def exact_shares(path: Path, values: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], int]:
    """OpenImageIO's codes (h, w, c) of a netpbm file and their largest, as they are where the file's largest
    is that of 8 or 16 bits; else float32, each of the file's own codes over its largest, correctly
    rounded."""
    with open_file(path) as stream:
        data = stream.read(HEADER_BYTES)
    numbers, _ = header_numbers(data, 3)
    stretched = int(np.iinfo(values.dtype).max)
    if data[1:2] not in b"2356" or len(numbers) < 3 or not 0 < numbers[2] < stretched:
        return values, stretched
    top = numbers[2]
    codes = np.arange(stretched + 1, dtype=np.int64)
    own = -(-codes * top // stretched)  # rounded up: the stretched code was cut off
    shares: F32 = (own / top).astype(np.float32)[values]
    return shares, top

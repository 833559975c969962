"""Reads netpbm headers (PBM, PGM, PPM) and undoes OpenImageIO's rounding of their values.

OpenImageIO stretches values to 8 or 16 bits and truncates: 99 of 100 becomes 252 of 255. Source: J.
Poskanzer, the manual pages of netpbm (pbm, pgm, ppm).
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


def header_numbers(data: bytes, count: int) -> tuple[list[int], int]:
    """The first `count` numbers after the two-byte magic, comments skipped, and the offset after the last
    digit."""
    numbers: list[int] = []
    position = 2
    while position < len(data) and len(numbers) < count:
        if data[position : position + 1] == b"#":
            end = data.find(b"\n", position)
            position = len(data) if end < 0 else end
        elif data[position : position + 1].isdigit():
            end = position
            while data[end : end + 1].isdigit() and end - position < 10:
                end += 1
            numbers.append(int(data[position:end]))
            position = end
        elif data[position : position + 1].isspace():
            position += 1
        else:
            break
    return numbers, position


def without_comments(text: bytes) -> bytes:
    """Values as text, without what stands behind a # on each line."""
    return b"\n".join(line.partition(b"#")[0] for line in text.splitlines())


def exact_shares(path: Path, values: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], int]:
    """Values (h, w, c) of a netpbm file from OpenImageIO's, and the value of white. Unchanged where the
    file's maximum is that of 8 or 16 bits; else float32, the file's own integers divided by its maximum,
    correctly rounded."""
    with open_file(path) as stream:
        data = stream.read(HEADER_BYTES)
    numbers, _ = header_numbers(data, 3)
    stretched = int(np.iinfo(values.dtype).max)
    if data[1:2] not in b"2356" or len(numbers) < 3 or not 0 < numbers[2] < stretched:
        return values, stretched
    top = numbers[2]
    stretched_values = np.arange(stretched + 1, dtype=np.int64)
    original = -(-stretched_values * top // stretched)  # rounded up: the stretched value was truncated
    shares: F32 = (original / top).astype(np.float32)[values]
    return shares, top

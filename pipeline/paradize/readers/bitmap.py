"""Reads with Pillow those Windows bitmaps that OpenImageIO 3.2 reads wrong.

OpenImageIO takes the unused fourth byte of a texel for alpha, ignores the masks that say where a channel
lies, and refuses sound run-length coded bitmaps. Plain palettes are left to it: Pillow 13 takes bytes for
bits where there are two colours. Source: Microsoft, "Bitmap storage".
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError
from paradize.files import open_file
from paradize.readers.damage import check_damage
from paradize.readers.limits import require_size

if TYPE_CHECKING:
    from pathlib import Path

_HEAD = 34  # bytes, up to the kind of packing
_PLAIN = {"1": "L", "P": "RGB"}  # two greys, and palettes -> what they mean


def read_bitmap(path: Path, color_space: str | None) -> Image | None:
    """The picture; None for a file that is no bitmap, or one for OpenImageIO.

    Raises SourceError where it is damaged, beyond the limits, or of a kind that Pillow does not decode.
    """
    with open_file(path) as stream:
        head = stream.read(_HEAD)
        if len(head) < _HEAD or not head.startswith(b"BM"):
            return None
        size, _, _, _, bits, packing = struct.unpack_from("<IiiHHI", head, 14)
        if size < 40 or (packing == 0 and bits in (1, 4, 8)):
            return None
        from PIL.BmpImagePlugin import BmpImageFile

        stream.seek(0)
        try:
            with BmpImageFile(stream) as picture:
                require_size(*picture.size, len(picture.getbands()), path)
                check_damage(path, "bmp")
                values = np.asarray(picture.convert(_PLAIN.get(picture.mode, picture.mode)))
        except (OSError, ValueError, SyntaxError) as error:
            what = f"is not a readable bitmap: {error}"
            raise SourceError(what, file=path, mend="save it as PNG") from None
    return Image(values.reshape(*values.shape[:2], -1), color_space or "srgb", 8, 255)

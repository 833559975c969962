"""Reads those TIFFs that OpenImageIO 3.2 reads wrong or not at all.

It takes a palette's alpha for another index, gives one green for YCbCr that it cannot unpack, memory that
nobody wrote for tiles of 64-bit floats, and lacks Zstandard and LZMA. Pillow reads all of these but the
floats. Sources: Adobe, "TIFF 6.0", 1992; Adobe, "Photoshop TIFF Technical Note 3", 2005 (floats as
differences).
"""

from __future__ import annotations

import math
import struct
import zlib
from contextlib import suppress
from importlib import import_module
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError
from paradize.files import open_file
from paradize.readers.damage import check_damage, damaged
from paradize.readers.limits import require_size
from paradize.readers.notes import pages
from paradize.readers.profile import profile_note
from paradize.readers.silence import silenced
from paradize.readers.tiff import first_directory

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    import numpy.typing as npt

    from paradize.data import F32

    Tags = Mapping[int, tuple[int, ...]]

_MAGIC = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_ROLE, _WIDTH, _HEIGHT, _BITS, _PACKING, _PHOTOMETRIC, _STRIP_OFFSETS = 254, 256, 257, 258, 259, 262, 273
_TURN, _SAMPLES, _STRIP_BYTES, _PREDICTOR, _PALETTE, _TILE_WIDTH = 274, 277, 279, 317, 320, 322
_TILE_HEIGHT, _TILE_OFFSETS, _TILE_BYTES, _EXTRA, _FORMAT = 323, 324, 325, 338, 339
_TAGS = {_WIDTH, _HEIGHT, _BITS, _PACKING, _PHOTOMETRIC, _STRIP_OFFSETS, _TURN, _SAMPLES, _STRIP_BYTES}
_TAGS |= {_PREDICTOR, _PALETTE, _TILE_WIDTH, _TILE_HEIGHT, _TILE_OFFSETS, _TILE_BYTES, _EXTRA, _FORMAT}
_PALETTES, _YCBCR = 3, 6  # photometric interpretations
_DEFLATE, _NEWER = (8, 32946), {34925: "LZMA", 50000: "Zstandard"}  # compressions
_PILLOWS = (5, 6, 7, 32773, *_DEFLATE, *_NEWER)  # compressions that it unpacks
_MOST = 1 << 16  # bytes of libtiff's words
_MEND = "save it as TIFF with Deflate or LZW, or as PNG"
# Bits, sample format, photometric interpretation and samples of what Pillow reads of the newer compressions:
# its mode, the type, bits and value of 1.0 of the values.
_KINDS: dict[tuple[int, int, int, int], tuple[str, Any, int, int | None]] = {
    (8, 1, 1, 1): ("L", np.uint8, 8, 255),
    (8, 1, 2, 3): ("RGB", np.uint8, 8, 255),
    (8, 1, 2, 4): ("RGBA", np.uint8, 8, 255),
    (16, 1, 1, 1): ("I;16", np.uint16, 16, 65535),
    (16, 2, 1, 1): ("I", np.float32, 16, None),
    (32, 3, 1, 1): ("F", np.float32, 32, None),
}
_COLORS = ("RGB", np.uint8, 8, 255)
_WITH_ALPHA = ("RGBA", np.uint8, 8, 255)
_STRAIGHT = 2  # alpha that colour is not multiplied by


def read_rare_tiff(path: Path, head: bytes, color_space: str | None) -> Image | None:
    """The picture, of which Pillow reads the texels; None for a file that OpenImageIO reads, or nothing does.

    Raises SourceError where it is damaged, beyond the limits, or of a kind that nothing here decodes.
    """
    tags = _tags(path) if head[:4] in _MAGIC else {}
    width, height = (tags.get(tag, (0,))[0] for tag in (_WIDTH, _HEIGHT))
    packing, samples = tags.get(_PACKING, (1,))[0], tags.get(_SAMPLES, (1,))[0]
    photometric, bits = tags.get(_PHOTOMETRIC, (-1,))[0], tags.get(_BITS, (1,))
    ycbcr = photometric == _YCBCR and packing != 1
    palette = photometric == _PALETTES and samples == 2
    if min(width, height) < 1 or not (ycbcr or palette or packing in _NEWER):
        return None
    require_size(width, height, samples * max(1, bits[0] // 8), path)
    check_damage(path, "tiff")
    way = tags.get(_TURN, (1,))[0]
    if way > 1:
        what = f"says that it is to be turned (orientation {way}), which is not read of a TIFF of its kind"
        raise SourceError(what, file=path, mend="save it upright")
    if ycbcr and packing not in _PILLOWS:
        raise SourceError(f"is compressed by scheme {packing}, which is not read", file=path, mend=_MEND)
    if palette:
        return _with_pillow(path, _palette_kind(path, tags, bits, packing), color_space)
    kind = _COLORS if ycbcr else _KINDS.get((bits[0], tags.get(_FORMAT, (1,))[0], photometric, samples))
    if kind is None or (samples == 4 and tags.get(_EXTRA) != (_STRAIGHT,)):
        what = f"{samples} channels of {bits[0]} bits (photometric {photometric}), compressed by"
        raise SourceError(f"{what} {_NEWER.get(packing)}, are not read", file=path, mend=_MEND)
    return _with_pillow(path, kind, color_space, swapped=packing in _NEWER and head[:2] == b"MM")


def _tags(path: Path) -> Tags:
    """The numbers of the tags that decide how texels are read; none where the directory cannot be read."""
    try:
        with open_file(path) as file:
            found = first_directory(file, _TAGS)
    except (ValueError, struct.error):
        return {}  # OpenImageIO has the reason
    return {
        tag: tuple(int(value) for value in values)
        for tag, values in found.items()
        if values and all(math.isfinite(value) and 0 <= value < 1 << 63 for value in values)
    }


def _palette_kind(path: Path, tags: Tags, bits: tuple[int, ...], packing: int) -> tuple[str, Any, int, int]:
    """Pillow's mode of a palette with alpha, whose colours and texels are all there."""
    rows, needed = tags[_HEIGHT][0], 2 * tags[_WIDTH][0] * tags[_HEIGHT][0]
    if bits != (8, 8) or tags.get(_EXTRA) != (_STRAIGHT,) or packing not in (1, *_PILLOWS):
        what = f"a palette with another channel of {bits[-1]} bits, of its kind, is not read"
        raise SourceError(what, file=path, mend=_MEND)
    if len(tags.get(_PALETTE, ())) < 3 << bits[0]:
        raise damaged(f"{len(tags.get(_PALETTE, ()))} numbers of a palette of {3 << bits[0]}", path)
    if packing == 1 and sum(tags.get(_STRIP_BYTES, ())[:rows]) < needed:
        raise damaged(f"its strips hold less than {needed} bytes", path)
    return _WITH_ALPHA


def _with_pillow(
    path: Path, kind: tuple[str, Any, int, int | None], color_space: str | None, *, swapped: bool = False
) -> Image:
    """swapped: Pillow gives signed integers and floats with their bytes in the other order."""
    mode, dtype, bits, top = kind
    opener = import_module("PIL.TiffImagePlugin").TiffImageFile
    further: list[str] = []
    try:
        with TemporaryFile() as said, silenced(said), open_file(path) as stream, opener(stream) as picture:
            found, profile = picture.mode, picture.info.get("icc_profile")
            values = np.asarray(picture.convert(mode) if dtype is np.uint8 else picture)
            with suppress(Exception):  # further pages may be of any kind
                further = pages(_roles(picture))
            said.seek(0)
            lines = said.read(_MOST).decode(errors="replace").splitlines()
    except Exception as error:
        raise SourceError(f"is not a readable TIFF: {error}", file=path, mend=_MEND) from None
    if errors := [line for line in lines if "warning" not in line.lower()]:  # libtiff's, which Pillow drops
        raise damaged(errors[0], path)
    if dtype is not np.uint8 and not found.startswith(mode):
        raise SourceError(f"is not a readable TIFF: Pillow calls it {found}", file=path, mend=_MEND)
    if mode == "I":
        values = values.astype(np.int16)
    values = (values.byteswap() if swapped and mode in ("I", "F") else values).astype(dtype, copy=False)
    color_space = color_space or ("srgb" if top is not None else "linear")
    told = isinstance(profile, bytes) and color_space == "srgb"
    colors = profile_note(profile) if told else ()
    shaped = values.reshape(*values.shape[:2], -1)
    return Image(shaped, color_space, bits, top, notes=tuple(further), color_notes=colors)


def _roles(picture: Any) -> Iterator[int]:
    """The roles of the pictures after the first, as TIFF's NewSubfileType."""
    for page in range(1, picture.n_frames):
        picture.seek(page)
        yield int(picture.tag_v2.get(_ROLE, 0))


def tiles_of_doubles(path: Path, width: int, height: int) -> F32:
    """The texels (h, w, 1) of one channel of 64-bit floats in tiles, as GDAL writes heights. Raises
    SourceError where a tile is missing, does not unpack, or is compressed in another way than Deflate."""
    tags = _tags(path)
    packing, predictor = tags.get(_PACKING, (1,))[0], tags.get(_PREDICTOR, (1,))[0]
    across, down = (tags.get(tag, (0,))[0] for tag in (_TILE_WIDTH, _TILE_HEIGHT))
    known = packing in (1, *_DEFLATE) and predictor in (1, 2, 3)
    if not known or tags.get(_BITS) != (64,) or min(across, down) < 1:
        kind = f"bits {tags.get(_BITS)}, compression {packing}, predictor {predictor}"
        what = f"64-bit floats in tiles of this kind ({kind}) are not read"
        raise SourceError(what, file=path, mend="save it as 32-bit float")
    require_size(across, down, 8, path)
    columns, rows = -(-width // across), -(-height // down)
    places = list(zip(tags.get(_TILE_OFFSETS, ()), tags.get(_TILE_BYTES, ()), strict=False))
    size = 8 * across * down
    if len(places) != rows * columns:
        raise damaged(f"{len(places)} tiles; {rows * columns} are needed", path)
    whole = np.empty((rows * down, columns * across), np.float32)
    with open_file(path) as file, np.errstate(over="ignore"):  # beyond float32: infinity, refused later
        order = "<" if file.read(2) == b"II" else ">"
        for k, (offset, count) in enumerate(places):
            file.seek(offset)
            tile = file.read(count)
            tile = tile if packing == 1 else _unpacked(tile, size)
            if len(tile) != size:
                raise damaged(f"tile {k} does not unpack to {size} bytes", path)
            y, x = k // columns * down, k % columns * across
            part = _rows_of_doubles(tile, down, order, 1 if packing == 1 else predictor)
            whole[y : y + down, x : x + across] = part
    return np.ascontiguousarray(whole[:height, :width])[:, :, None]


def _unpacked(data: bytes, size: int) -> bytes:
    """The bytes of a deflated tile; others than `size` where it is damaged."""
    unpacker = zlib.decompressobj()
    with suppress(zlib.error):
        out = unpacker.decompress(data, size + 1)
        return out if unpacker.eof else b""
    return b""


def _rows_of_doubles(part: bytes, rows: int, order: str, predictor: int) -> npt.NDArray[np.float64]:
    """The rows of a tile; the predictor says how they were made easier to pack."""
    if predictor == 2:  # differences of the numbers' bits
        bits = np.frombuffer(part, order + "u8").reshape(rows, -1)
        return bits.cumsum(axis=1, dtype=np.uint64).view(np.float64)
    if predictor == 3:  # differences of bytes, the highest byte of all numbers of a row first
        planes = np.frombuffer(part, np.uint8).reshape(rows, -1).cumsum(axis=1, dtype=np.uint8)
        together = planes.reshape(rows, 8, -1).swapaxes(1, 2)
        return np.ascontiguousarray(together).view(">f8")[:, :, 0]
    return np.frombuffer(part, order + "f8").reshape(rows, -1)

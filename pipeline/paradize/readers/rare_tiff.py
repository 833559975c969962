"""Reads those TIFFs that OpenImageIO 3.2 reads wrong or not at all.

It takes a palette's alpha for another index, gives one colour for YCbCr whose texels are damaged or packed
in a way that it does not know, and memory that nobody wrote for tiles of 64-bit floats. It lacks Zstandard
and LZMA. Pillow reads all of these but the floats. Sources: Adobe, "TIFF 6.0", 1992; Adobe, "Photoshop TIFF
Technical Note 3", 2005 (floats as differences).
"""

from __future__ import annotations

import struct
import zlib
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError
from paradize.files import open_file
from paradize.readers.damage import check_damage, damaged
from paradize.readers.limits import require_size
from paradize.readers.notes import NARROWED, pages
from paradize.readers.profile import profile_note
from paradize.readers.silence import silenced
from paradize.readers.tiff import first_directory

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    import numpy.typing as npt

_MAGIC = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_ROLE, _WIDTH, _HEIGHT, _BITS, _PACKING, _PHOTOMETRIC, _SAMPLES = 254, 256, 257, 258, 259, 262, 277
_STRIP_OFFSETS, _TURN, _STRIP_BYTES = 273, 274, 279
_PREDICTOR, _TILE_WIDTH, _TILE_HEIGHT, _TILE_OFFSETS, _TILE_BYTES, _FORMAT = 317, 322, 323, 324, 325, 339
_TAGS = frozenset(range(_ROLE, _FORMAT + 1))
_PALETTE, _YCBCR = 3, 6  # photometric interpretations
_PLAIN, _DEFLATE, _LZMA, _ZSTD = (1,), (8, 32946), (34925,), (50000,)  # compressions
_YCBCR_PACKINGS = (1, 5, 6, 7, 32773, *_DEFLATE, *_LZMA, *_ZSTD)  # that Pillow unpacks
_MEND = "save it as TIFF with Deflate or LZW, or as PNG"
_COLORS = {"1": "L", "P": "RGB", "PA": "RGBA", "LA": "LA", "L": "L", "RGB": "RGB", "RGBA": "RGBA"}
_NUMBERS: dict[str, tuple[Any, int, int | None]] = {  # type, bits, value of 1.0
    "I;16": (np.uint16, 16, 65535),
    "I;16B": (np.uint16, 16, 65535),
    "I": (np.float32, 16, None),
    "F": (np.float32, 32, None),
}
_ERRORS = (OSError, ValueError, SyntaxError, RuntimeError, KeyError)  # of damaged files


def read_rare_tiff(path: Path, head: bytes, color_space: str | None) -> Image | None:
    """The picture; None for a file that OpenImageIO reads, or nothing does.

    Raises SourceError where it is damaged, beyond the limits, or of a kind that nothing here decodes.
    """
    if head[:4] not in _MAGIC:
        return None
    try:
        with open_file(path) as file:
            tags = first_directory(file, _TAGS)
        first = {tag: int(tags[tag][0]) for tag in tags if tags[tag]}
        width, height = first[_WIDTH], first[_HEIGHT]
    except (ValueError, KeyError, struct.error):
        return None  # told with OpenImageIO's reason
    bits, packing = first.get(_BITS, 1), first.get(_PACKING, 1)
    samples, photometric = first.get(_SAMPLES, 1), first.get(_PHOTOMETRIC)
    if _TILE_WIDTH in first and (bits, first.get(_FORMAT)) == (64, 3):
        require_size(width, height, 8 * samples, path)
        return _tiles_of_doubles(path, tags, first, color_space)
    palette = photometric == _PALETTE and samples > 1
    if not palette and photometric != _YCBCR and packing not in (*_LZMA, *_ZSTD):
        return None
    if photometric == _YCBCR and packing not in _YCBCR_PACKINGS:
        raise SourceError(f"is compressed by scheme {packing}, which is not read", file=path, mend=_MEND)
    if first.get(_TURN, 1) != 1:
        mend = "save it upright, as PNG"
        raise SourceError(f"a turned picture (orientation {first[_TURN]}) of its kind", file=path, mend=mend)
    require_size(width, height, samples * max(1, bits // 8), path)
    check_damage(path, "tiff")
    if packing in _DEFLATE:  # Pillow does not tell what does not unpack
        places = zip(tags.get(_STRIP_OFFSETS, ()), tags.get(_STRIP_BYTES, ()), strict=False)
        _unpacked(path, places, packing, most=2 * width * height * samples * max(1, bits // 8))
    return _with_pillow(path, first, color_space)


def _with_pillow(path: Path, first: Mapping[int, int], color_space: str | None) -> Image:
    opener = import_module("PIL.TiffImagePlugin").TiffImageFile
    try:
        with silenced(), open_file(path) as stream, opener(stream) as picture:
            mode = picture.mode
            values = np.asarray(picture.convert(_COLORS[mode]) if mode in _COLORS else picture)
            further = pages(_roles(picture))
            colors = profile_note(profile) if (profile := picture.info.get("icc_profile")) else ()
        dtype, bits, top = (np.uint8, 8, 255) if mode in _COLORS else _NUMBERS[mode]
    except _ERRORS as error:
        what = f"is not a readable TIFF: {error}"
        raise SourceError(what, file=path, mend=_MEND) from None
    values = values.astype(dtype, copy=False).reshape(*values.shape[:2], -1)
    if top is None and first.get(_FORMAT, 1) == 1:
        raise SourceError("integers of 32 bits, compressed in its way, are not read", file=path, mend=_MEND)
    color_space = color_space or ("srgb" if top is not None else "linear")
    narrowed = mode in _COLORS and first.get(_BITS, 1) > 8
    notes = ((NARROWED,) if narrowed else ()) + tuple(further)
    colors = colors if color_space == "srgb" else ()
    return Image(values, color_space, bits, top, notes=notes, color_notes=colors)


def _roles(picture: Any) -> Iterator[int]:
    for page in range(1, picture.n_frames):
        picture.seek(page)
        yield int(picture.tag_v2.get(_ROLE, 0))


def _unpacked(path: Path, places: Iterable[tuple[float, float]], packing: int, most: int) -> list[bytes]:
    """The bytes of each strip or tile, whose offsets and lengths are given. Raises SourceError where one does
    not unpack, or to more than `most` bytes."""
    parts = []
    with open_file(path) as file:
        for k, (offset, count) in enumerate(places):
            file.seek(int(offset))
            part = file.read(int(count))
            if packing not in _PLAIN:
                unpacker = zlib.decompressobj()
                try:
                    part = unpacker.decompress(part, most + 1)
                except zlib.error as error:
                    raise damaged(f"strip or tile {k} does not unpack: {error}", path) from None
                if not unpacker.eof or len(part) > most:
                    raise damaged(f"strip or tile {k} does not unpack to {most} bytes at most", path)
            parts.append(part)
    return parts


def _tiles_of_doubles(
    path: Path, tags: Mapping[int, Any], first: Mapping[int, int], color_space: str | None
) -> Image:
    """Heights as GDAL writes them: one channel of 64-bit floats in tiles."""
    packing, predictor = first.get(_PACKING, 1), first.get(_PREDICTOR, 1)
    if first.get(_SAMPLES, 1) != 1 or packing not in (*_PLAIN, *_DEFLATE) or predictor not in (1, 2, 3):
        what = "tiles of 64-bit floats, compressed in its way or of several channels, are not read"
        raise SourceError(what, file=path, mend="save it as 32-bit float")
    check_damage(path, "tiff")
    with open_file(path) as file:
        order = "<" if file.read(2) == b"II" else ">"
    width, height, across, down = (first.get(tag, 0) for tag in (_WIDTH, _HEIGHT, _TILE_WIDTH, _TILE_HEIGHT))
    columns, rows = -(-width // max(across, 1)), -(-height // max(down, 1))
    size = 8 * across * down
    places = zip(tags.get(_TILE_OFFSETS, ()), tags.get(_TILE_BYTES, ()), strict=False)
    parts = _unpacked(path, places, packing, most=size)
    if size == 0 or len(parts) != rows * columns or any(len(part) != size for part in parts):
        raise damaged(f"{rows * columns} tiles of {size} bytes are needed", path)
    whole = np.empty((rows * down, columns * across), np.float32)
    with np.errstate(over="ignore"):  # a double beyond float32 becomes infinity, which is refused later
        for k, part in enumerate(parts):
            y, x = k // columns * down, k % columns * across
            whole[y : y + down, x : x + across] = _rows_of_doubles(part, down, order, predictor)
    values = np.ascontiguousarray(whole[:height, :width])[:, :, None]
    return Image(values, color_space or "linear", 32, None)


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

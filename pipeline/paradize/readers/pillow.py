"""Reads with Pillow those pictures that OpenImageIO 3.2 reads wrong or not at all: AVIF, QOI, some others.

Of Windows bitmaps OpenImageIO takes the unused fourth byte of a texel for alpha, ignores the masks that say
where a channel lies (`bitmap_masks.py` reads most of those), refuses sound run-length coded ones, and gives
one under a header of OS/2 the size of the bitmap read before. Plain palettes are left to it: Pillow 13 takes
bytes for bits where there are two colours. Canvas that the first picture of a WebP leaves free gets memory
that nobody wrote. DDS of GLI (a code that the flags do not declare) and those without flags that no reader
needs are refused. Of Photoshop pictures it leaves out a fourth channel, and refuses those with a layer that
it does not read. Sources: Microsoft, "Bitmap storage"; D. Szablewski, "The Quite OK Image Format", 2022;
Alliance for Open Media, "AV1 Image File Format", 2022; Google, "WebP Container Specification"; Adobe,
"Photoshop File Formats Specification", 2019.
"""

from __future__ import annotations

import struct
import warnings
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError
from paradize.files import open_file
from paradize.readers.damage import check_damage
from paradize.readers.dds import MULTIPLIED, OPAQUE, dds_head
from paradize.readers.limits import require_size
from paradize.readers.notes import FOURTH, LEFT_OUT, NARROWED, SEVERAL, UNREAD_LAYERS, high_range, turned
from paradize.readers.profile import profile_note

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

_ERRORS = (OSError, ValueError, SyntaxError, RuntimeError)  # of damaged files
_PLAIN = {"1": "L", "P": "RGB"}  # two greys, and palettes -> what they mean
_BITMAP_HEADS = 12, 40, 108, 124  # bytes, of those that OpenImageIO knows
_DDS_FLAGS, _DDS_TEXTURE, _DDS_CODE = 0x1001, 0x1000, 0x4  # it asks for the first two; a code is the format
_DXGI_LEFT = 81, 84, 95, 96  # BC4 and BC5 with signs, BC6H: Pillow makes bytes of these, or reads none
_TYPELESS = {70, 73, 76, 79, 82, 97}  # BC1 to BC5 and BC7: OpenImageIO refuses them
_MOVES = 2  # flag of a WebP of several pictures
_HIGH_DEPTH = 0x40  # flag in the third byte of an AVIF file's box av1C
_ORIENTATION = 0x0112  # Exif
_LINEAR, _HDR = 8, {16: "PQ", 18: "HLG"}  # transfer functions of ITU-T H.273


def is_avif(head: bytes) -> bool:
    """Whether the file that begins with these 32 bytes or more is an AVIF picture."""
    return head[4:8] == b"ftyp" and (b"avif" in head[8:32] or b"avis" in head[8:32])


def read_with_pillow(path: Path, head: bytes, color_space: str | None) -> Image | None:
    """The picture; None for a file that OpenImageIO reads, or nothing does. head: the file's first 4096
    bytes, which hold an AVIF picture's boxes.

    Raises SourceError where it is damaged, beyond the limits, or of a kind that Pillow does not decode.
    """
    name = _format(head)
    return None if name is None else decode(name, path, head, color_space)


def decode(name: str, path: Path, head: bytes, color_space: str | None) -> Image:
    """The picture that Pillow's plugin of this name reads. Raises as read_with_pillow."""
    curve = _avif_curve(head) if name == "Avif" else 0
    if curve in _HDR:
        raise high_range(_HDR[curve], path)
    opener = getattr(import_module(f"PIL.{name}ImagePlugin"), f"{name}ImageFile")
    try:
        with open_file(path) as stream, opener(stream) as picture:
            width, height = picture.size
            require_size(width, height, len(picture.getbands()), path)
            check_damage(path, name.lower())
            values = np.asarray(picture.convert(_PLAIN.get(picture.mode, picture.mode)))
            notes = _notes(picture, head)
            if name == "Dds" and (header := dds_head(path, head)) and header.note:
                notes = (header.note, *notes)
            colors = profile_note(profile) if (profile := picture.info.get("icc_profile")) else ()
    except _ERRORS as error:
        what = f"is not a readable {name.upper()} picture: {error}"
        raise SourceError(what, file=path, mend="save it as PNG") from None
    # A QOI's byte of colour space is not asked: programs (Pillow) write "linear" for any picture.
    color_space = color_space or ("linear" if curve == _LINEAR else "srgb")
    colors = colors if color_space == "srgb" else ()
    shape = (*values.shape[:2], -1)
    return Image(values.reshape(shape), color_space, 8, 255, notes=notes, color_notes=colors)


def psd_alpha(path: Path, head: bytes) -> tuple[npt.NDArray[np.uint8] | None, str]:
    """The fourth channel (h, w) of a Photoshop picture of three colours and 8 bits, which OpenImageIO leaves
    out unless it is the transparency of layers, and a note; None where it is empty or cannot be read."""
    version, channels, bits, mode = struct.unpack_from(">H6xH8xHH", head, 4)
    if channels <= {1: 1, 3: 3}.get(mode, channels):  # grey, RGB
        return None, ""
    if (version, channels, bits, mode) == (1, 4, 8, 3):
        plugin = import_module("PIL.PsdImagePlugin")
        with suppress(*_ERRORS), open_file(path) as stream, plugin.PsdImageFile(stream) as picture:
            alpha = np.asarray(picture.getchannel("A"))
            return (alpha, FOURTH) if alpha.any() else (None, "")
    return None, LEFT_OUT


def read_merged(path: Path, head: bytes, color_space: str | None) -> Image | None:
    """The picture that the layers of a Photoshop file make, of 8 bits in grey or RGB, for one whose layers
    OpenImageIO does not read; None for any other file, and where it cannot be read."""
    if struct.unpack_from(">4sH", head.ljust(26, b"\0")) != (b"8BPS", 1):
        return None
    channels, bits, mode = struct.unpack_from(">H8xHH", head, 12)
    if bits != 8 or (mode, channels) not in ((1, 1), (3, 3), (3, 4)):
        return None
    with suppress(SourceError):
        merged = replace(decode("Psd", path, head, color_space), notes=(UNREAD_LAYERS,))
        values: npt.NDArray[np.uint8] = merged.values.astype(np.uint8, copy=False)
        if channels == 3 or mode == 1:
            return merged
        if _over_white(path):
            return replace(merged, values=_without_white(values))
        if values[:, :, 3].any():
            return replace(merged, notes=(UNREAD_LAYERS, FOURTH))
        return replace(merged, values=np.ascontiguousarray(values[:, :, :3]))
    return None


def _over_white(path: Path) -> bool:
    """Whether the fourth channel of a Photoshop file is the transparency of its layers: their number is
    negative. The colours lie over white then."""
    with open_file(path) as file:
        file.seek(26)
        for _ in range(2):  # the palette and the resources
            file.seek(int.from_bytes(file.read(4), "big"), 1)
        size, _, count = struct.unpack(">IIh", file.read(10).ljust(10, b"\0"))
    return bool(size) and count < 0


def _without_white(values: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """The colours (h, w, 4) before they were laid over white; black where nothing shows."""
    alpha = values[:, :, 3:].astype(np.int32)
    colors = (255 * (values[:, :, :3] + alpha - 255) + alpha // 2) // np.maximum(alpha, 1)
    return np.concatenate([np.clip(colors, 0, 255).astype(np.uint8), values[:, :, 3:]], axis=2)


def _format(head: bytes) -> str | None:
    """The Pillow format of a picture that OpenImageIO does not read right."""
    if head.startswith(b"qoif"):
        return "Qoi"
    if is_avif(head):
        return "Avif"
    if len(head) < 34:
        return None
    if head[8:16] == b"WEBPVP8X":
        return "WebP" if head[20] & _MOVES else None
    if head.startswith(b"DDS ") and len(head) >= 128:
        flags, form, code, texture = struct.unpack_from("<I68xI4s20xI", head, 8)
        sound = flags & _DDS_FLAGS == _DDS_FLAGS and texture & _DDS_TEXTURE
        if code == b"DX10":
            odd = not sound or int.from_bytes(head[128:132], "little") in _TYPELESS
            return "Dds" if not form & _DDS_CODE or (odd and _is_plain(head)) else None
        return None if sound or code == b"BC5S" else "Dds"
    if head[:2] not in (b"BM", b"BA"):  # BA: several, which neither reads
        return None
    size, bits, packing = struct.unpack_from("<I10xHI", head, 14)
    plain = size == 12 or (packing == 0 and bits in (1, 4, 8))
    return None if plain and size in _BITMAP_HEADS else "Bmp"


def _is_plain(head: bytes) -> bool:
    """Whether Pillow reads right what the newer header of a DDS says: not floats, not signed, and alpha that
    is neither multiplied into colour nor without a meaning."""
    if len(head) < 148:
        return False
    form, modes = struct.unpack_from("<I12xI", head, 128)
    return form not in _DXGI_LEFT and modes & 7 not in (MULTIPLIED, OPAQUE)


def _avif_curve(head: bytes) -> int:
    """The transfer function that an AVIF file names (ITU-T H.273); 0: none, which means sRGB."""
    at = head.find(b"colrnclx")
    return int.from_bytes(head[at + 10 : at + 12], "big") if at >= 0 else 0


def _notes(picture: Any, head: bytes) -> tuple[str, ...]:
    """Notes for the user about a picture."""
    notes = []
    at = head.find(b"av1C") if is_avif(head) else -1
    if at >= 0 and head[at + 6 : at + 7] and head[at + 6] & _HIGH_DEPTH:
        notes.append(NARROWED)
    with warnings.catch_warnings(action="ignore"):  # of Pillow, about notes that are damaged
        way = picture.getexif().get(_ORIENTATION, 1)
    if isinstance(way, int) and 1 < way <= 8:
        notes.append(turned(way))
    if getattr(picture, "n_frames", 1) > 1:
        notes.append(SEVERAL)
    return tuple(notes)

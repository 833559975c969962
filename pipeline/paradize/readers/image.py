"""Reads pictures of all formats that OpenImageIO supports, AVIF, QOI and Basis Universal, or raises one
clear SourceError.

OpenImageIO returns pixels beside some errors, hides others, and multiplies colour by alpha. This reader
refuses any error, asks for straight alpha, and checks for damage itself (damage.py).

A picture has one to four channels: grey; grey and alpha; RGB; RGBA. Alpha is not multiplied into colour.
Unsigned integers of 8 and 16 bits, signed integers and floats keep their values. Of several pictures in a
file the first is read. Grids of heights are read too (grids/).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import OpenImageIO as oiio

from paradize.data import Image
from paradize.errors import SourceError, unread
from paradize.files import library_path, open_file
from paradize.kinds import PICTURE, expecting
from paradize.readers.basis import read_basis
from paradize.readers.bitmap_masks import read_masked_bitmap
from paradize.readers.damage import check_damage, damaged
from paradize.readers.dds import MULTIPLIED, OPAQUE, DdsHead, dds_head, read_plain_dds
from paradize.readers.gain_map import has_gain, read_without_gain
from paradize.readers.grids import read_grid
from paradize.readers.limits import limit, require_size, too_many_bytes
from paradize.readers.names import require_utf8_name
from paradize.readers.notes import (
    FIRST_BAND,
    FOURTH,
    beside_display,
    high_range,
    left_out,
    pages,
    six_faces,
    turned,
)
from paradize.readers.pbm import read_text_bitmap
from paradize.readers.pillow import psd_alpha, read_merged, read_with_pillow
from paradize.readers.pnm import exact_shares
from paradize.readers.profile import declared_note, primaries_note, profile_note
from paradize.readers.radiance import with_short_header
from paradize.readers.rare_tiff import read_rare_tiff, tiles_of_doubles
from paradize.readers.silence import silenced

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import numpy.typing as npt

    from paradize.data import F32

# Formats with straight alpha, which OpenImageIO returns unchanged when asked.
_STRAIGHT = {
    "png",
    "targa",
    "dds",
    "gif",
    "bmp",
    "ico",
    "webp",
    "pnm",
    "psd",
    "jpeg2000",
    "jpegxl",
    "heif",
    "sgi",
}
_OTHERS = (  # readers of pictures that OpenImageIO reads wrong or not at all
    read_plain_dds,
    read_masked_bitmap,
    read_with_pillow,
    read_basis,
    read_rare_tiff,
    read_text_bitmap,
)
_HEAD_BYTES = 4096  # of an AVIF file the boxes before the texels
_LAYERED = ("psd",)  # the first picture of these is all layers together
_TARGA_MULTIPLIED = 4  # type of alpha
_SPELLED = {"red": "r", "green": "g", "blue": "b", "alpha": "a"}  # long names of channels
_CODEC = re.compile(r"(\w+) compression support is not configured|(scheme \d+) .*not implemented")
_FOURCC = re.compile(r"Unsupported compression type: (\d+)")  # of a DDS
_CUT = re.compile("hit end of file|asked for|implausible")
_LONG_HEADER = re.compile("no FORMAT specifier|missing blank line after FORMAT")  # of a Radiance picture
_JUNK = re.compile(r"Corrupt JPEG data: (\d+) extraneous bytes before marker")  # between whole segments
_MEND = "save it as PNG, TIFF or OpenEXR"
_MISSING = "premature end of data segment"  # in libjpeg's word about a file of several scans
_PLAIN_NUMBERS = {"half": 16, "float": 32, "double": 32, "int8": 8, "int16": 16, "int": 32}  # bits
_TYPES: dict[str, tuple[Any, Any, float]] = {  # type to ask for, type of the result, value of 1.0
    "uint8": (oiio.UINT8, np.uint8, 255.0),
    "uint16": (oiio.UINT16, np.uint16, 65535.0),
    "uint": (oiio.UINT32, np.uint32, 4294967295.0),
    "int8": (oiio.INT8, np.int8, 1.0),
    "int16": (oiio.INT16, np.int16, 1.0),
    "int": (oiio.INT32, np.int32, 1.0),
    "half": (oiio.FLOAT, np.float32, 1.0),
    "float": (oiio.FLOAT, np.float32, 1.0),
    "double": (oiio.DOUBLE, np.float64, 1.0),
}


def read_image(
    path: Path, *, color_space: str | None = None, finite: bool = True, light: bool = False
) -> Image:
    """Reads a picture: values (h, w, 1..4), row 0 at the top, straight alpha.

    color_space: "srgb", "linear" or "data" overrides the file. By default floats, signed integers and files
    that declare themselves linear are "linear", all others "srgb". finite: whether NaN and infinity are
    refused. light: whether a JPEG's gain map is applied, so that it holds light beyond white.

    Raises SourceError for a file that is missing, empty, not a picture, damaged, truncated, beyond the limits
    (checked before decoding), of an unsupported shape, or that holds NaN or infinity.
    """
    with expecting(PICTURE, path):
        return _read_image(path, color_space, finite, light)


def _read_image(path: Path, color_space: str | None, finite: bool, light: bool) -> Image:
    if (grid := read_grid(path)) is not None:
        return grid
    try:
        head = _head(path)
        for read in _OTHERS:
            if (picture := read(path, head, color_space)) is not None:
                if finite and picture.top is None:
                    require_finite(picture.values, path)
                return picture
        return _read_with_oiio(path, head, color_space, finite, light)
    except FileNotFoundError:
        raise SourceError("no such file", file=path) from None
    except OSError as error:
        raise unread(error, path) from error
    except MemoryError as error:
        raise SourceError("does not fit into memory", file=path, mend="make it smaller") from error


def _head(path: Path) -> bytes:
    """The first bytes of a file, which tell who reads it. Raises SourceError for an empty file and for a name
    that is not UTF-8."""
    with open_file(path) as stream:
        head = stream.read(_HEAD_BYTES)
    if not head:
        raise SourceError("the file is empty", file=path, mend="save or export it again")
    require_utf8_name(path)
    return head


def _read_with_oiio(path: Path, head: bytes, color_space: str | None, finite: bool, light: bool) -> Image:
    oiio.attribute("limits:imagesize_MB", limit("PARADIZE_MAX_MB"))
    oiio.attribute("limits:channels", 64)
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    with library_path(path) as name:
        with silenced():
            source = oiio.ImageInput.open(name, hints)
        if source is None:
            said = _message(oiio)
            if "limits:imagesize_MB" in said:
                raise too_many_bytes(path)
            if (merged := read_merged(path, head, color_space)) is not None:
                return merged
            if _LONG_HEADER.search(said):
                with with_short_header(path) as copy:
                    if copy is not None:
                        return _read_copy(copy, path, head, color_space, finite)
            if _CUT.search(said):
                raise damaged(said.replace(name, path.name), path)
            what = f"is not a readable picture: {said or 'no reason given'}"
            raise SourceError(what.replace(name, path.name), file=path, mend=_MEND)
        try:
            if has_gain(source) and not light:
                return read_without_gain(path, head, color_space)
            return _read_open(source, path, head, color_space, finite)
        except SourceError as error:
            what = error.what.replace(name, path.name)  # libraries name what they were given
            raise SourceError(what, file=error.file, place=error.place, mend=error.mend) from None
        finally:
            source.close()


def _read_copy(copy: Path, path: Path, head: bytes, color_space: str | None, finite: bool) -> Image:
    """Reads a copy of the picture at `path`, which errors name."""
    try:
        return _read_with_oiio(copy, head, color_space, finite, light=True)
    except SourceError as error:
        what = error.what.replace(copy.name, path.name)
        raise SourceError(what, file=path, place=error.place, mend=error.mend) from None


def _message(source: Any) -> str:
    """OpenImageIO's pending error on one line; "" where there is none."""
    try:
        text = str(source.geterror())
    except UnicodeDecodeError:
        return "damaged (its error message cannot be decoded)"
    if "could not find a format reader" in text:
        return "OpenImageIO does not know its format"
    if code := _FOURCC.search(text):
        name = int(code[1]).to_bytes(4, "little").decode("latin-1")
        return f"DDS format {name if name.isprintable() else int(code[1])!r} is not read"
    return "; ".join(line.strip() for line in text.splitlines() if line.strip())


def _read_open(source: Any, path: Path, head: bytes, color_space: str | None, finite: bool) -> Image:
    spec = source.spec()
    kind = source.format_name()
    said = _message(source)  # of the header
    skipped = _jpeg_note(said) if kind == "jpeg" else None
    if said and skipped is None:
        raise _unsupported(said, path) or damaged(said, path)
    types = _types(spec)
    _require_shape(spec, types, path)
    check_damage(path, kind)
    channels, others = _channels(spec, kind, path)
    values, top = _texels(source, kind, types, channels, path)
    if finite and values.dtype == np.float32:
        require_finite(values, path)
    color = color_space != "data"  # numbers are no colours that alpha could be multiplied into
    has_alpha = len(channels) in (2, 4) and _is_alpha(spec, channels[-1])
    dds = dds_head(path, head) or DdsHead()
    if has_alpha and dds.alpha_mode == OPAQUE:
        values, has_alpha = values[:, :, :-1], False
    if color and has_alpha and (dds.alpha_mode == MULTIPLIED or _is_premultiplied(spec, kind)):
        values = _straighten(Image(values, "data", 32).pixels)
        values = values if top is None else np.minimum(values, np.float32(1))
    fourth = ""
    if kind == "psd" and values.shape[2] in (1, 3):  # without the transparency of layers
        alpha, fourth = psd_alpha(path, head)
        values = values if alpha is None else np.concatenate([values, alpha[:, :, None]], axis=2)
    if values.shape[2] == 2 and not has_alpha and kind != "targa" and not dds.grey_alpha:  # red and green
        values = np.concatenate([values, np.zeros_like(values[:, :, :1])], axis=2)
    declared = spec.get_string_attribute("oiio:ColorSpace").lower()
    if declared.startswith(("pq_", "hlg_")) and color_space != "data":
        raise high_range(declared.partition("_")[0].upper(), path)
    profile, name = spec.getattribute("ICCProfile"), types[channels[0]]
    if kind == "png" and spec.getattribute("CICP") is not None:  # it precedes a profile, as that does gamma
        profile = None
    colors: tuple[str, ...] = ()
    if color_space is None:
        linear = declared.startswith("lin") and profile is None
        color_space = "linear" if linear or name in _PLAIN_NUMBERS else "srgb"
        if color_space == "srgb" and profile is not None:
            colors = profile_note(bytes(profile))
        elif kind == "png":
            colors = declared_note(declared, color_space)
        elif kind == "openexr":
            colors = primaries_note(spec.getattribute("chromaticities"))
    bits = _PLAIN_NUMBERS.get(name) or {"uint8": 8, "uint16": 16}.get(name, 32)
    notes = (*filter(None, (skipped, dds.note, fourth, others)), *_notes(source, kind))
    return Image(values, color_space, bits, top, notes=notes, color_notes=colors)


def _texels(
    source: Any, kind: str, types: list[str], channels: list[int], path: Path
) -> tuple[npt.NDArray[Any], int | None]:
    """The channels that are kept (h, w, c), black at 0, and the value of 1.0; None: numbers as they are."""
    spec = source.spec()
    values: npt.NDArray[Any]
    if kind == "tiff" and spec.tile_width and types == ["double"]:
        values = tiles_of_doubles(path, spec.width, spec.height)
    elif len(set(types)) == 1:
        values = _decode(source, spec, types[0], path, 0, spec.nchannels)
        if channels != list(range(spec.nchannels)):
            values = np.ascontiguousarray(values[:, :, channels])
    else:  # read one by one: OpenImageIO would convert mixed types to one
        each = [_decode(source, spec, types[k], path, k, k + 1) for k in channels]
        values = np.concatenate([Image(channel, "data", 32).pixels for channel in each], axis=2)
    name = types[channels[0]]
    top = None if name in _PLAIN_NUMBERS else round(_TYPES[name][2])
    if top is not None and kind == "pnm":
        return exact_shares(path, values)
    white = kind == "tiff" and spec.get_int_attribute("tiff:PhotometricInterpretation", 1) == 0
    return _from_white(values) if white and top is not None else values, top


def _jpeg_note(said: str) -> str | None:
    """The note for libjpeg's word about a header; None where it is damage. A word about something harmless
    would keep it from telling damage behind."""
    if junk := _JUNK.search(said):
        return f"{junk[1]} bytes of its header belong to nothing and are skipped"
    return "some of its data are missing; a part of it may be grey or coarse" if _MISSING in said else None


def _unsupported(said: str, path: Path) -> SourceError | None:
    """The error for a sound file of a kind that its decoder lacks; None for damage."""
    if "Unsupported JPEG data precision" not in said:
        return None
    return SourceError(f"is not read: {said}", file=path, mend="save it as a PNG of 8 or 16 bits")


def _notes(source: Any, kind: str) -> tuple[str, ...]:
    """Notes for the user about a picture that was read."""
    notes = []
    spec = source.spec()
    way = spec.get_int_attribute("Orientation", 1)
    if way > 1:
        notes.append(turned(way))
    shown = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if kind == "openexr" and (spec.x, spec.y, spec.width, spec.height) != shown:
        notes.append(beside_display(spec))
    with silenced():
        notes += pages(_roles(source) if kind not in _LAYERED else ())
    _message(source)  # of a seek that finds nothing
    return tuple(notes)


def _roles(source: Any) -> Iterator[int]:
    """The roles of the pictures after the first, as TIFF's NewSubfileType says."""
    page = 0
    while source.seek_subimage(page := page + 1, 0):
        yield source.spec().get_int_attribute("tiff:subfiletype", 0)


def _types(spec: Any) -> list[str]:
    """The type of each channel, as OpenImageIO names it."""
    return [str(kind) for kind in spec.channelformats] or [str(spec.format)] * spec.nchannels


def _require_shape(spec: Any, types: list[str], path: Path) -> None:
    """Raises SourceError for deep and volume pictures, cube maps, pictures beyond the limits, and those that
    cannot be decoded correctly."""
    width, height = spec.width, spec.height
    if spec.deep or spec.depth > 1:
        raise SourceError("deep and volume pictures are not maps", file=path, mend=_MEND)
    if "LAB" in (coding := spec.get_string_attribute("tiff:ColorSpace")):
        raise SourceError(f"its colours are {coding}, not RGB", file=path, mend="save it as RGB")
    if spec.get_string_attribute("textureformat") == "CubeFace Environment":  # the faces side by side
        raise six_faces(path)
    if width < 1 or height < 1 or spec.nchannels < 1:
        raise damaged(f"{width} x {height} texels of {spec.nchannels} channels", path)
    require_size(width, height, spec.pixel_bytes(True), path)
    bits, read = spec.get_int_attribute("oiio:BitsPerSample", 0), 8 * spec.format.size()
    if bits > read and spec.get_string_attribute("compression") == "jpeg":  # a decoder of 8 bits
        what = f"{bits} bits of a channel, compressed as JPEG, are not read"
        raise SourceError(what, file=path, mend="save it with Deflate or LZW")
    if "double" in types and (height == 1 or (spec.tile_width and spec.nchannels > 1)):
        what = "one row, or tiles of several channels, of 64-bit floats are not decoded reliably"
        raise SourceError(what, file=path, mend="save it as 32-bit float")


_BAND = 256  # rows checked at a time


def require_finite(values: npt.NDArray[Any], path: Path) -> None:
    """Raises SourceError for NaN and infinity, with the first place and the number of such values."""
    first, count = None, 0
    for row in range(0, values.shape[0], _BAND):
        finite = np.isfinite(values[row : row + _BAND])
        if not finite.all():
            count += int(finite.size) - int(np.count_nonzero(finite))
            if first is None:
                y, x, channel = (int(i) for i in np.argwhere(~finite)[0])
                first = (row + y, x, channel)
    if first is not None:
        y, x, channel = first
        what = f"{values[first]} in channel {channel}, {count} such values in all"
        raise SourceError(what, file=path, place=f"texel ({x}, {y})", mend="maps need finite numbers")


def _channels(spec: Any, kind: str, path: Path) -> tuple[list[int], str]:
    """Indices of the channels to keep, and a note for the user, or "". Channels of OpenEXR have names, and
    may form layers; of any other picture all of up to four are kept."""
    names, count = list(spec.channelnames), spec.nchannels
    if kind == "tiff" and count > 4 and spec.get_int_attribute("tiff:PhotometricInterpretation", 2) < 2:
        return [0], FIRST_BAND
    if kind != "openexr" and count <= 4:
        fourth = kind == "tiff" and count == 4 and spec.alpha_channel < 0
        return list(range(count)), FOURTH if fourth else ""
    if count == 1:
        return [0], ""
    kept = _named_channels(names)
    if not kept and count > 4:
        what = f"{count} channels ({', '.join(names)}) and no R, G, B among them"
        raise SourceError(what, file=path, mend="save its colours as R, G, B, or one channel alone")
    kept = kept or (list(range(count)) if count > 2 else [0])
    left = [name for k, name in enumerate(names) if k not in kept]
    return kept, left_out([names[k] for k in kept], left) if left else ""


def _named_channels(names: list[str]) -> list[int]:
    """Indices of R, G, B of the first layer that has them, and of its A; else of X, Y, Z, of two of either
    (which leave A out), of U, V, or of Y. Channels outside layers come first."""
    layers: dict[str, dict[str, int]] = {"": {}}
    for k, name in enumerate(names):
        layer, _, channel = name.rpartition(".")
        word = channel.lower()
        layers.setdefault(layer, {}).setdefault(_SPELLED.get(word, word), k)
    for wanted in ("rgb", "xyz", "rg", "xy", "uv", "y"):
        for found in layers.values():
            if all(letter in found for letter in wanted):
                alpha = "a" if "a" in found and len(wanted) != 2 else ""
                return [found[letter] for letter in wanted + alpha]
    return []


def _decode(source: Any, spec: Any, name: str, path: Path, first: int, end: int) -> npt.NDArray[Any]:
    """Channels first to end - 1, (h, w, c), of one type: integers of 8 and 16 bits unchanged, other unsigned
    integers as shares of their largest value, everything else as float32."""
    if name not in _TYPES:
        raise SourceError(f"texels of type {name} are not read", file=path, mend=_MEND)
    wanted, dtype, top = _TYPES[name]
    with silenced():
        raw = source.read_image(0, 0, first, end, wanted)
    error = _message(source) or _message(oiio)
    if raw is None or error:
        if codec := _CODEC.search(error):
            what = f"is compressed by {codec[1] or codec[2]}, which is not read"
            raise SourceError(what, file=path, mend="save it with Deflate or LZW")
        raise _unsupported(error, path) or damaged(error or "the decoder gave no pixels", path)
    values: npt.NDArray[Any] = np.asarray(raw, dtype=dtype)
    if values.size != spec.height * spec.width * (end - first):
        raise damaged(f"{values.size} values came for {spec.width} x {spec.height} texels", path)
    values = values.reshape(spec.height, spec.width, end - first)
    if top in (255.0, 65535.0):
        return values
    with np.errstate(over="ignore"):  # a double beyond float32 becomes infinity, which is refused later
        if top == 1.0:
            return values.astype(np.float32, copy=False)
        return (values.astype(np.float64) / top).astype(np.float32)


def _from_white(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The values of a TIFF whose 0 is white: OpenImageIO turns 8 bits over, alpha too, and no others."""
    turned = slice(1, None) if values.dtype == np.uint8 else slice(0, 1)
    top = np.iinfo(values.dtype).max if values.dtype.kind == "u" else 1.0
    values = values.copy()
    values[:, :, turned] = top - values[:, :, turned]
    return values


def _is_alpha(spec: Any, channel: int) -> bool:
    """Whether a channel is alpha. OpenImageIO knows one of a picture, which may have several layers."""
    name = str(spec.channelnames[channel]).rpartition(".")[2].lower()
    return bool(channel == spec.alpha_channel) or _SPELLED.get(name, name) == "a"


def _is_premultiplied(spec: Any, kind: str) -> bool:
    """Whether colour is multiplied by alpha."""
    straight = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) == 1
    return spec.get_int_attribute("targa:alpha_type", 0) == _TARGA_MULTIPLIED or not (
        straight or kind in _STRAIGHT
    )


def _straighten(pixels: F32) -> F32:
    """Divides colour by alpha; where alpha is 0, colour is unchanged."""
    alpha = pixels[:, :, -1:]
    safe = np.where(alpha > 0, alpha, np.float32(1))
    with np.errstate(over="ignore"):
        color = pixels[:, :, :-1] / safe
    color = np.where(np.isfinite(color), color, pixels[:, :, :-1])
    return np.concatenate([color, alpha], axis=2)

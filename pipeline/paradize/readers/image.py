"""Pictures of every format that OpenImageIO reads -> Image, or one clear SourceError.

OpenImageIO reports failure by return values, sometimes with pixels beside the error, sometimes with pixels
and no error at all; it multiplies colour by alpha unless told not to. So this reader asks for straight alpha,
takes an error for an error whatever came with it, and looks for damage itself (damage.py).

A picture keeps one to four channels: grey; grey and alpha; red, green, blue; and those with alpha. Alpha
comes out straight (not multiplied into colour). Unsigned integers of 8 and 16 bits stay the file's codes;
signed integers and floats are numbers as they are. Of files that hold several pictures the first is read. Raw
SRTM tiles (`.hgt`) are read too.

The limits are settings of the environment: PARADIZE_MAX_SIDE (texels), PARADIZE_MAX_TEXELS and
PARADIZE_MAX_MB (of a decoded picture). They refuse pictures and change none.
"""

from __future__ import annotations

import os
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
import OpenImageIO as oiio

from paradize.data import Image
from paradize.errors import BakeError, SourceError
from paradize.files import name_for_library, open_file
from paradize.kinds import PICTURE, expecting
from paradize.readers.damage import check_damage
from paradize.readers.pnm import exact_shares
from paradize.readers.srtm import read_srtm

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import numpy.typing as npt

    from paradize.data import F32

# Setting -> what holds where the environment does not say: 16384 x 16384 is the largest map that is promised.
LIMITS = {"PARADIZE_MAX_SIDE": 32768, "PARADIZE_MAX_TEXELS": 1 << 29, "PARADIZE_MAX_MB": 8192}

# Formats whose files keep straight alpha, as OpenImageIO hands it over when asked for it.
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
_PLAIN_NUMBERS = {"half": 16, "float": 32, "double": 32, "int8": 8, "int16": 16, "int": 32}  # bits
_TYPES: dict[str, tuple[Any, Any, float]] = {  # what to ask for, what comes, what maps to 1
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


def limit(name: str) -> int:
    """The limit of this name in LIMITS, or what the environment says instead. Raises BakeError where that is
    no whole number above 0."""
    told = os.environ.get(name, "")
    if not told:
        return LIMITS[name]
    if not (told.isascii() and told.isdigit() and len(told) <= 18 and int(told) > 0):
        raise BakeError(f"the setting {name} is {told!r:.40}", mend="give it a whole number above 0")
    return int(told)


def read_image(path: Path, *, color_space: str | None = None, finite: bool = True) -> Image:
    """The picture in `path`: values (h, w, 1..4), finite, row 0 at the top, straight alpha.

    color_space: "srgb", "linear" or "data" overrides what the file says; by itself a file of floats or
    signed integers, and one that declares itself linear, is "linear", every other is "srgb". Pictures beyond
    the limits are refused before they are decoded. finite: whether NaN and infinity are refused; who takes
    them looks for them. Raises SourceError for a file that is missing, empty, no
    picture, damaged, truncated, too large, of a shape that is no picture, or that holds NaN or infinity.
    """
    with expecting(PICTURE, path):
        return _read_image(path, color_space, finite)


def _read_image(path: Path, color_space: str | None, finite: bool) -> Image:
    if path.suffix.lower() == ".hgt":
        return read_srtm(path)
    _require_file(path)
    oiio.attribute("limits:imagesize_MB", limit("PARADIZE_MAX_MB"))
    oiio.attribute("limits:channels", 64)
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    try:
        with name_for_library(path) as name:
            with _silenced():
                source = oiio.ImageInput.open(name, hints)
            if source is None:
                what = f"no picture that can be read: {_message(oiio) or 'no reason given'}"
                mend = "save it as PNG, TIFF or OpenEXR"
                raise SourceError(what.replace(name, path.name), file=path, mend=mend)
            try:
                return _read_open(source, path, color_space, finite)
            finally:
                source.close()
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror}", file=path) from error
    except MemoryError as error:
        raise SourceError("does not fit into memory", file=path, mend="make it smaller") from error


def _require_file(path: Path) -> None:
    """Raises SourceError where there is no file with something in it under a name that is text."""
    try:
        with open_file(path) as stream:
            empty = not stream.read(1)
    except FileNotFoundError:
        raise SourceError("no such file", file=path) from None
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror}", file=path) from error
    if empty:
        raise SourceError("the file is empty", file=path, mend="save or export it again")
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise SourceError("the file's name is not UTF-8", file=path, mend="rename it") from None


_silence = threading.Lock()


@contextmanager
def _silenced() -> Iterator[None]:
    """Keeps libpng and its like from writing to standard error beside the one message that we give."""
    with _silence:
        if sys.stderr is not None:
            sys.stderr.flush()
        try:
            held = os.dup(2)
        except OSError:  # there is no standard error
            yield
            return
        nowhere = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nowhere, 2)
            yield
        finally:
            os.dup2(held, 2)
            os.close(nowhere)
            os.close(held)


def _message(source: Any) -> str:
    """OpenImageIO's pending error in one line; "" where there is none."""
    try:
        text = str(source.geterror())
    except UnicodeDecodeError:
        return "damaged (its error message cannot be decoded)"
    if "could not find a format reader" in text:
        return "of no format that OpenImageIO knows"
    return "; ".join(line.strip() for line in text.splitlines() if line.strip())


def _read_open(source: Any, path: Path, color_space: str | None, finite: bool) -> Image:
    spec = source.spec()
    kind = source.format_name()
    types = _types(spec)
    _require_shape(spec, types, path)
    check_damage(path, kind)
    channels = _channels(spec, path)
    name = types[channels[0]]
    values: npt.NDArray[Any]
    if len(set(types)) == 1:
        values = _decode(source, spec, name, path, 0, spec.nchannels)
        if channels != list(range(spec.nchannels)):
            values = np.ascontiguousarray(values[:, :, channels])
    else:  # asked for all at once, OpenImageIO would turn one type into another
        each = [_decode(source, spec, types[k], path, k, k + 1) for k in channels]
        values = np.concatenate([Image(one, "data", 32).pixels for one in each], axis=2)
    top = None if name in _PLAIN_NUMBERS else round(_TYPES[name][2])
    if kind == "pnm" and top is not None:
        values, top = exact_shares(path, values)
    if finite and values.dtype == np.float32:
        require_finite(values, path)
    if values.shape[2] in (2, 4) and _is_premultiplied(spec, kind):
        values = _straighten(Image(values, "data", 32).pixels)
    if values.shape[2] == 2 and spec.alpha_channel != 1:  # red and green alone
        values = np.concatenate([values, np.zeros_like(values[:, :, :1])], axis=2)
    if color_space is None:
        declared = spec.get_string_attribute("oiio:ColorSpace").lower()
        linear = name in _PLAIN_NUMBERS or declared.startswith("lin")
        color_space = "linear" if linear else "srgb"
    bits = _PLAIN_NUMBERS.get(name) or {"uint8": 8, "uint16": 16}.get(name, 32)
    return Image(values, color_space, bits, top)


def _types(spec: Any) -> list[str]:
    """The type of every channel, as OpenImageIO names it."""
    return [str(kind) for kind in spec.channelformats] or [str(spec.format)] * spec.nchannels


def _require_shape(spec: Any, types: list[str], path: Path) -> None:
    """Raises SourceError for what is no flat picture, is beyond the limits, or cannot be decoded rightly."""
    width, height = spec.width, spec.height
    if spec.deep or spec.depth > 1:
        raise SourceError("deep and volume pictures are not maps", file=path)
    if spec.get_string_attribute("textureformat") == "CubeFace Environment":  # the faces side by side
        mend = "save each face as a picture of its own"
        raise SourceError("the six faces of a cube map are not one picture", file=path, mend=mend)
    if width < 1 or height < 1 or spec.nchannels < 1:
        raise SourceError(f"{width} x {height} texels of {spec.nchannels} channels are no picture", file=path)
    side, texels = limit("PARADIZE_MAX_SIDE"), limit("PARADIZE_MAX_TEXELS")
    if width > side or height > side or width * height > texels:
        what = f"{width} x {height} texels; at most {side} per side and {texels} in all are read"
        mend = "make it smaller, or raise PARADIZE_MAX_SIDE and PARADIZE_MAX_TEXELS"
        raise SourceError(what, file=path, mend=mend)
    if "double" in types and height == 1:
        raise SourceError(
            "one row of 64-bit floats is not decoded reliably", file=path, mend="save it as 32-bit float"
        )


_BAND = 256  # rows looked at together


def require_finite(values: npt.NDArray[Any], path: Path) -> None:
    """Raises SourceError, with the first place and the number of such values, for NaN and infinity."""
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


def _channels(spec: Any, path: Path) -> list[int]:
    """Indices of the channels to keep: all of up to four, else red, green, blue and alpha by their names."""
    if spec.nchannels <= 4:
        return list(range(spec.nchannels))
    names = [name.lower() for name in spec.channelnames]
    for wanted in (("r", "g", "b", "a"), ("r", "g", "b"), ("y",)):
        if all(name in names for name in wanted):
            return [names.index(name) for name in wanted]
    what = f"{spec.nchannels} channels ({', '.join(spec.channelnames)}) and no R, G, B among them"
    raise SourceError(what, file=path, mend="one to four channels are read")


def _decode(source: Any, spec: Any, name: str, path: Path, first: int, last: int) -> npt.NDArray[Any]:
    """Channels first to last - 1 (h, w, c), of one type: codes of 8 and 16 bits as they are, other unsigned
    integers as shares of their largest, all else as float32 numbers."""
    if name not in _TYPES:
        raise SourceError(f"texels of type {name} are not read", file=path)
    wanted, dtype, top = _TYPES[name]
    with _silenced():
        raw = source.read_image(0, 0, first, last, wanted)
    error = _message(source) or _message(oiio)
    if raw is None or error:
        raise SourceError(f"damaged or cut: {error or 'the decoder gave no pixels'}", file=path)
    values: npt.NDArray[Any] = np.asarray(raw, dtype=dtype)
    if values.size != spec.height * spec.width * (last - first):
        raise SourceError(f"{values.size} values came for {spec.width} x {spec.height} texels", file=path)
    values = values.reshape(spec.height, spec.width, last - first)
    if top in (255.0, 65535.0):
        return values
    with np.errstate(over="ignore"):  # a double beyond float32 becomes infinity, which is then refused
        if top == 1.0:
            return values.astype(np.float32, copy=False)
        return (values.astype(np.float64) / top).astype(np.float32)


def _is_premultiplied(spec: Any, kind: str) -> bool:
    """Whether colour still carries alpha as a factor."""
    if spec.alpha_channel < 0 or spec.get_int_attribute("oiio:UnassociatedAlpha", 0) == 1:
        return False
    return kind not in _STRAIGHT


def _straighten(pixels: F32) -> F32:
    """Colour divided by alpha; where alpha is zero, colour as it is."""
    alpha = pixels[:, :, -1:]
    safe = np.where(alpha > 0, alpha, np.float32(1))
    with np.errstate(over="ignore"):
        color = pixels[:, :, :-1] / safe
    color = np.where(np.isfinite(color), color, pixels[:, :, :-1])
    return np.concatenate([color, alpha], axis=2)

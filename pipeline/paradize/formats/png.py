"""PNG pictures of baked maps, through OpenImageIO; the file's bytes depend on the pixels alone."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import OpenImageIO as oiio

from paradize.errors import FormatError
from paradize.files import name_for_library, read_file

if TYPE_CHECKING:
    import numpy.typing as npt

    Codes = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]


MAX_CODES = 1 << 30  # of a picture that is read: 16384 x 16384 texels of four channels


def encode_png(codes: Codes) -> bytes:
    """A PNG of codes (h, w, 1, 3 or 4), 8 or 16 bits by their type; data, so no colour space is named."""
    height, width, channels = codes.shape
    kind = {np.dtype(np.uint8): oiio.UINT8, np.dtype(np.uint16): oiio.UINT16}[codes.dtype]
    spec = oiio.ImageSpec(width, height, channels, kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("oiio:ColorSpace", "data")
    with tempfile.TemporaryDirectory(prefix="paradize-") as folder:
        path = Path(folder) / "map.png"
        target = oiio.ImageOutput.create(str(path))
        if target is None or not target.open(str(path), spec):
            raise FormatError(f"the PNG cannot be written: {oiio.geterror()}")
        if not target.write_image(np.ascontiguousarray(codes)) or not target.close():
            raise FormatError(f"the PNG cannot be written: {target.geterror()}")
        return read_file(path)


def decode_png(path: Path) -> Codes:
    """The codes (h, w, channels) of a PNG, 8 or 16 bits. Raises FormatError for other files."""
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)  # else colour comes multiplied by it
    try:
        with name_for_library(path) as name:
            source = oiio.ImageInput.open(name, hints)
            if source is None:
                raise FormatError(f"no PNG that can be read: {oiio.geterror().strip()}", file=path)
            spec = source.spec()
            if spec.width * spec.height * spec.nchannels > MAX_CODES:
                size = f"{spec.width} x {spec.height} texels of {spec.nchannels} channels"
                raise FormatError(f"{size}, limit {MAX_CODES} codes", file=path)
            kind = oiio.UINT16 if spec.format == oiio.UINT16 else oiio.UINT8
            codes = source.read_image(0, 0, 0, spec.nchannels, kind)
            what = source.geterror().strip()
            source.close()
    except OSError as error:
        raise FormatError(f"cannot be read: {error.strerror}", file=path) from None
    if codes is None or what:
        raise FormatError(what or "no PNG that can be read", file=path)
    return np.asarray(codes).reshape(spec.height, spec.width, spec.nchannels)

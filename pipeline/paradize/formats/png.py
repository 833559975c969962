"""PNG files of baked maps, through OpenImageIO. The bytes depend only on the pixels."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import OpenImageIO as oiio

from paradize.errors import FormatError, unread
from paradize.files import library_path, read_file

if TYPE_CHECKING:
    import numpy.typing as npt

    Texels = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]


MAX_VALUES = 1 << 30  # limit for reading: 16384 x 16384 texels with four channels


def encode_png(texels: Texels) -> bytes:
    """Encodes (h, w, 1, 3 or 4) uint8 or uint16 as PNG with 8 or 16 bits; no colour space is stored."""
    height, width, channels = texels.shape
    component_type = {np.dtype(np.uint8): oiio.UINT8, np.dtype(np.uint16): oiio.UINT16}[texels.dtype]
    spec = oiio.ImageSpec(width, height, channels, component_type)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("oiio:ColorSpace", "data")
    with tempfile.TemporaryDirectory(prefix="paradize-") as folder:
        path = Path(folder) / "map.png"
        target = oiio.ImageOutput.create(str(path))
        if target is None or not target.open(str(path), spec):
            raise FormatError(f"the PNG cannot be written: {oiio.geterror()}")
        if not target.write_image(np.ascontiguousarray(texels)) or not target.close():
            raise FormatError(f"the PNG cannot be written: {target.geterror()}")
        return read_file(path)


def decode_png(path: Path) -> Texels:
    """Reads a PNG as (h, w, channels) uint8 or uint16. Raises FormatError for other files."""
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)  # else colour is multiplied by alpha
    try:
        with library_path(path) as name:
            source = oiio.ImageInput.open(name, hints)
            if source is None:
                raise FormatError(f"is not a readable PNG: {oiio.geterror().strip()}", file=path)
            spec = source.spec()
            if spec.width * spec.height * spec.nchannels > MAX_VALUES:
                size = f"{spec.width} x {spec.height} texels of {spec.nchannels} channels"
                raise FormatError(f"{size}, limit {MAX_VALUES} values", file=path)
            component_type = oiio.UINT16 if spec.format == oiio.UINT16 else oiio.UINT8
            texels = source.read_image(0, 0, 0, spec.nchannels, component_type)
            what = source.geterror().strip()
            source.close()
    except OSError as error:
        raise unread(error, path, kind=FormatError) from None
    if texels is None or what:
        raise FormatError(what or "is not a readable PNG", file=path)
    return np.asarray(texels).reshape(spec.height, spec.width, spec.nchannels)

"""Pictures with changed bytes: each gives finite pixels or one SourceError, whatever the byte."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from paradize.errors import SourceError
from paradize.readers.image import read_image

KINDS = {
    "grey.png": (1, "uint8"),
    "deep.png": (4, "uint16"),
    "strips.tif": (3, "uint16"),
    "float.tif": (1, "float"),
    "photo.jpg": (3, "uint8"),
    "half.exr": (4, "half"),
    "plain.bmp": (3, "uint8"),
    "wide.bmp": (4, "uint8"),
    "plain.ppm": (3, "uint8"),
    "alpha.tga": (4, "uint8"),
    "light.hdr": (3, "float"),
}
TRIES = 60


def written(folder: Path, name: str) -> bytes:
    """A picture of 23 x 17 texels as OpenImageIO writes it."""
    channels, kind = KINDS[name]
    y, x, c = np.mgrid[0:17, 0:23, 0:channels]
    pixels = ((x * 11 + y * 7 + c * 31) % 64 / 63).astype(np.float32)
    image = oiio.ImageBuf(np.ascontiguousarray(pixels))
    path = folder / name
    assert image.write(str(path), kind), image.geterror()
    return path.read_bytes()


def changed(data: bytes, dice: random.Random) -> bytes:
    """The bytes with a few of them changed, a piece cut out, doubled, or all from some place on left off."""
    out = bytearray(data)
    at = dice.randrange(len(out))
    match dice.randrange(4):
        case 0:
            for _ in range(dice.randint(1, 4)):
                # Headers decide most: half of the changes fall into the first bytes.
                where = dice.randrange(min(64, len(out))) if dice.random() < 0.5 else dice.randrange(len(out))
                out[where] = dice.choice((0, 1, 127, 128, 255, dice.randrange(256)))
        case 1:
            del out[at : at + dice.randint(1, 16)]
        case 2:
            out[at:at] = out[at : at + dice.randint(1, 16)]
        case _:
            del out[at:]
    return bytes(out)


@pytest.mark.parametrize("name", KINDS)
def test_a_picture_with_changed_bytes_is_read_or_refused(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_MAX_TEXELS", str(1 << 22))  # a header that lies is refused, not decoded
    data = written(tmp_path, name)
    dice = random.Random(name)
    refused = 0
    for _ in range(TRIES):
        path = tmp_path / f"changed{Path(name).suffix}"
        path.write_bytes(changed(data, dice))
        try:
            image = read_image(path)
        except SourceError as error:
            refused += 1
            assert str(path) in str(error)
        else:
            pixels = image.pixels
            assert pixels.dtype == np.float32
            assert pixels.ndim == 3
            assert 1 <= pixels.shape[2] <= 4
            assert np.isfinite(pixels).all()
    assert refused > 0

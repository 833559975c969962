"""PNG files of every kind, written byte by byte: their pixels are those that were written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paradize.errors import SourceError
from paradize.readers.image import read_image
from tests.pipeline.raw_files import chunk, png

DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}  # of each colour type
KINDS = [(kind, bits) for kind, depths in DEPTHS.items() for bits in depths]


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize(("kind", "bits"), KINDS)
def test_every_kind_of_png_has_the_pixels_that_were_written(
    tmp_path: Path, kind: int, bits: int, interlaced: bool
) -> None:
    """Grey, colour, palette, each with alpha and without, of all depths; of sizes that leave passes empty."""
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[kind]
    for rows, columns in ((1, 1), (2, 5), (9, 13), (33, 31)):
        rng = np.random.default_rng(rows)
        codes = rng.integers(0, 1 << bits, (rows, columns, channels))
        palette = rng.integers(0, 256, (1 << bits, 3))
        chunks = {b"PLTE": palette.astype(np.uint8).tobytes()} if kind == 3 else {}
        image = read_image(png(tmp_path / "a.png", codes, kind, bits, interlaced=interlaced, chunks=chunks))
        wanted = palette[codes[:, :, 0]] / 255 if kind == 3 else codes / ((1 << bits) - 1)
        assert np.array_equal(image.pixels, wanted.astype(np.float32)), (rows, columns)


def test_a_transparent_index_is_alpha(tmp_path: Path) -> None:
    codes = np.arange(16).reshape(4, 4, 1) % 4
    chunks = {b"PLTE": bytes(range(12)), b"tRNS": bytes([0, 100, 255])}
    alpha = read_image(png(tmp_path / "a.png", codes, 3, 2, chunks=chunks)).pixels[:, :, 3]
    assert np.array_equal(np.rint(alpha * 255), np.array([0, 100, 255, 255])[codes[:, :, 0]])


@pytest.mark.parametrize("what", ["sum", "kind", "depth", "no pixels", "signature", "no palette", "cut"])
def test_a_corrupt_png_gives_a_clear_error(tmp_path: Path, what: str) -> None:
    path = png(tmp_path / "a.png", np.arange(64).reshape(8, 8, 1) % 4, 3, 2, chunks={b"PLTE": bytes(12)})
    data = path.read_bytes()
    head = data[16:29]
    wrong = {
        "sum": data[:29] + b"\0\0\0\0" + data[33:],
        "kind": data[:8] + chunk(b"IHDR", head[:9] + b"\5" + head[10:]) + data[33:],
        "depth": data[:8] + chunk(b"IHDR", head[:8] + b"\3" + head[9:]) + data[33:],
        "no pixels": data[:33] + chunk(b"PLTE", bytes(12)) + chunk(b"IEND", b""),
        "signature": b"\x89PNG\n\n\x1a\n" + data[8:],
        "no palette": data[:33] + data[33 + 24 :],
        "cut": data[:60],
    }
    path.write_bytes(wrong[what])
    with pytest.raises(SourceError, match=r"a\.png"):
        read_image(path)

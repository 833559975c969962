"""Bitmaps of text, as GIMP and netpbm write them: 70 digits a line."""

from __future__ import annotations

from pathlib import Path

import pytest

from paradize.errors import SourceError
from paradize.readers.image import read_image

AFTER_IT = ["010111 the end", "010111\nP1\n1 1\n0\n", "010111\x1a"]


@pytest.mark.parametrize(
    "rows", ["010\n111\n", "0 1 0\n1 1 1\n", "0101\n11", "01 # of GIMP\n0111", *AFTER_IT]
)
@pytest.mark.parametrize("head", ["P1\n# by hand\n3 2\n", "P1#c\n3#c\n2 "])
def test_a_bitmap_of_text_has_its_texels_with_blanks_and_without(
    tmp_path: Path, head: str, rows: str
) -> None:
    (tmp_path / "a.pbm").write_text(head + rows)
    image = read_image(tmp_path / "a.pbm")
    assert image.values[:, :, 0].tolist() == [[255, 0, 255], [0, 0, 0]]  # 1 is black
    assert (image.top, image.source_bits) == (255, 8)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("P1\n3 2\n01011", "5 values; its header promises 6"),
        ("P1\n3 2\n010121", "a texel is neither 0 nor 1"),
        ("P1\n3 2\n01 a 111", "a texel is neither 0 nor 1"),
        ("P1\n0 2\n", "no width and height"),
        ("P1\n3 x\n010111", "no width and height"),
    ],
)
def test_a_bitmap_of_text_that_lacks_texels_or_has_others_is_refused(
    tmp_path: Path, text: str, said: str
) -> None:
    (tmp_path / "a.pbm").write_text(text)
    with pytest.raises(SourceError, match=said):
        read_image(tmp_path / "a.pbm")

"""`check` looks at PNG maps: whole files, and normals of unit length."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.maps.bake import bake_maps
from paradize.checks import check_paths
from paradize.formats.png import decode_png, encode_png
from tests.pipeline.heights import save, waves


@pytest.fixture
def maps(tmp_path: Path) -> Path:
    """A folder of PNG maps as `paradize maps --format png` leaves it."""
    heights = waves(24, 32, 1)
    picture = save(tmp_path / "hills.png", ((heights - heights.min()) * 20).astype(np.uint8)[:, :, None])
    folder = tmp_path / "maps"
    folder.mkdir()
    made = bake_maps(picture, source="height", strength=20.0, fmt="png", measure=False)
    for kind, product in made.items():
        (folder / f"hills_{kind}.png").write_bytes(product.data)
    return folder


def codes(path: Path) -> list[str]:
    return [finding.code for finding in check_paths([path])]


def test_png_maps_of_a_bake_pass_as_a_folder_and_one_by_one(maps: Path) -> None:
    assert codes(maps) == []
    assert len(list(maps.iterdir())) == 4
    for file in maps.iterdir():
        assert codes(file) == []


@pytest.mark.parametrize("part", [0.2, 0.6, 0.99])
def test_a_cut_png_is_found(maps: Path, part: float) -> None:
    file = maps / "hills_normal.png"
    file.write_bytes(file.read_bytes()[: int(file.stat().st_size * part)])
    assert codes(maps) == ["PZ102"]


def test_a_png_with_one_wrong_bit_is_found(maps: Path) -> None:
    file = maps / "hills_height.png"
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 4
    file.write_bytes(data)
    assert codes(maps) == ["PZ102"]


def test_a_normal_map_whose_vectors_are_not_unit_is_found_with_its_texels(maps: Path) -> None:
    file = maps / "hills_normal.png"
    texels = decode_png(file).copy()
    texels[5, 7], texels[9, 2] = (128, 128, 128), (255, 255, 128)  # too short, and too long
    file.write_bytes(encode_png(texels))
    (finding,) = check_paths([maps])
    assert (finding.code, finding.place, finding.count) == ("PZ203", "texel (7, 5)", 2)


def test_a_png_of_pixels_keeps_them(tmp_path: Path) -> None:
    """Colour beside alpha, too, is what the file says, not what alpha leaves of it."""
    for kind, channels in ((np.uint8, 3), (np.uint16, 3), (np.uint8, 4), (np.uint16, 4), (np.uint8, 1)):
        size = (5, 3, channels)
        texels = np.random.default_rng(0).integers(0, np.iinfo(kind).max, size, kind, endpoint=True)
        (tmp_path / "a.png").write_bytes(encode_png(texels))
        found = decode_png(tmp_path / "a.png")
        assert found.dtype == kind
        assert (found == texels).all()

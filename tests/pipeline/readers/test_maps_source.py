"""The guess of `paradize maps` for a picture, and heights against oracles in double."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest
from PIL import Image

from paradize.bakers.maps.bake import map_rows
from paradize.readers.heightmap import guess_source
from paradize.readers.image import read_image
from paradize.scene.baker_settings import MapSettings
from tests.pipeline.heights import angles_between, rounded, save, up, waves
from tests.pipeline.raw_files import exr, tiff
from tests.sweeps import sample

Maps = Callable[..., dict[str, Any]]


@pytest.fixture
def maps(tmp_path: Path, paradize: Callable[..., Any]) -> Maps:
    """Runs `paradize maps --json`; its object, with what stood on standard error as "stderr"."""

    def run(path: Path, *words: object, code: int = 0) -> dict[str, Any]:
        done = paradize("maps", path, "-o", tmp_path / "out", "--format", "png", "--json", *words)
        assert done.returncode == code, done.stderr
        report: dict[str, Any] = json.loads(done.stdout)
        return report | {"stderr": done.stderr}

    return run


def grey(side: int = 32) -> npt.NDArray[np.float64]:
    return (waves(side, side, 3).astype(np.float64) / 12.0 + 0.5).clip(0.0, 1.0)


def pictures(folder: Path) -> dict[str, tuple[Path, str]]:
    """By name a picture of every kind and what it is to be taken for."""
    share = grey()
    c8, c16 = (share * 255).round().astype(np.uint8), (share * 65535).round().astype(np.uint16)
    metres = (share * 900).astype(np.float32)
    raw = folder / "N00E000.hgt"
    raw.write_bytes(metres.astype(">i2").tobytes())
    palette = folder / "palette.png"
    Image.fromarray(c8).convert("P").save(palette)
    pgm = folder / "h.pgm"
    pgm.write_bytes(b"P5\n32 32\n1023\n" + (share * 1023).astype(">u2").tobytes())
    return {
        "grey 16": (save(folder / "g16.png", c16[:, :, None], oiio.UINT16), "height"),
        "grey 8": (save(folder / "g8.png", c8[:, :, None]), "color"),
        "grey and alpha 16": (save(folder / "ga16.png", np.dstack([c16, c16]), oiio.UINT16), "color"),
        "rgb 16": (save(folder / "rgb16.png", np.dstack([c16] * 3), oiio.UINT16), "color"),
        "palette": (palette, "color"),
        "pgm of 10 bits": (pgm, "height"),
        "hgt": (raw, "height"),
        "tiff of floats": (tiff(folder / "f.tif", metres), "height"),
        "geotiff of 16 bits": (tiff(folder / "u16.tif", c16, "0", keys=[1, 1, 0, 0]), "height"),
        "tiff of signed": (tiff(folder / "i16.tif", metres.astype(np.int16)), "height"),
        "tiff of uint32": (tiff(folder / "u32.tif", (share * 4e9).astype(np.uint32)), "height"),
        "tiff of 8 bits": (tiff(folder / "u8.tif", c8), "color"),
        "exr of whole numbers": (exr(folder / "u.exr", {"Y": (share * 4e9).astype(np.uint32)}), "height"),
        "exr of halves": (exr(folder / "h.exr", {"Z": share.astype(np.float16)}), "height"),
        "exr of colour": (exr(folder / "c.exr", dict.fromkeys("RGB", metres)), "color"),
    }


def test_a_guess_is_said_and_what_is_named_is_no_guess(tmp_path: Path) -> None:
    path = save(tmp_path / "h.png", (grey() * 65535).round().astype(np.uint16)[:, :, None], oiio.UINT16)
    _, picture = map_rows(path, MapSettings(), uv=None, tier="fast", measure=False)
    assert picture.source == "height" and str(picture.guess).startswith(f"{path}: taken for heights: ")
    _, picture = map_rows(path, MapSettings(source="color"), uv=None, tier="fast", measure=False)
    assert picture.source == "color" and picture.guess is None


def test_holes_that_are_filled_are_said(tmp_path: Path) -> None:
    metres = (waves(32, 32, 8) * 80 + 700).astype(np.float32)
    metres[10, 20] = -9999.0
    path = tiff(tmp_path / "h.tif", metres)
    _, picture = map_rows(path, MapSettings(), uv=None, tier="fast", measure=False)
    assert any("1 pixel without a height (-9999" in text for text in picture.warnings)


@pytest.mark.deep
def test_one_channel_of_more_than_8_bits_is_heights_and_the_guess_is_told(tmp_path: Path, maps: Maps) -> None:
    every = pictures(tmp_path)
    for name, (path, kind) in every.items():
        assert guess_source(read_image(path, finite=False))[0] == kind, name
    for name in ("grey 16", "grey 8", "hgt", "exr of whole numbers"):
        path, kind = every[name]
        result = maps(path, "--only", "height")
        assert result["from"] == kind, name
        word = "heights" if kind == "height" else "colour"
        assert (
            result["guess"].startswith(f"{path}: taken for {word}: ") and result["guess"] in result["stderr"]
        )


@pytest.mark.deep
def test_what_is_said_is_no_guess(tmp_path: Path, maps: Maps) -> None:
    path = save(tmp_path / "h.png", (grey() * 65535).round().astype(np.uint16)[:, :, None], oiio.UINT16)
    for kind in ("color", "height"):
        result = maps(path, "--only", "height", "--from", kind)
        assert result["from"] == kind and result["guess"] is None and "taken for" not in result["stderr"]


@pytest.mark.deep
def test_what_colour_cuts_off_floats_is_told(tmp_path: Path, maps: Maps) -> None:
    metres = (grey() * 417 + 396).astype(np.float32)
    path = exr(tmp_path / "c.exr", dict.fromkeys("RGB", metres))
    (message,) = maps(path, "--only", "height")["warnings"]
    assert f"runs from {metres.min():g} to {metres.max():g}" in message and "--from height" in message
    kept = maps(path, "--only", "height", "--from", "height")
    assert kept["from"] == "height" and not any("counts as" in text for text in kept["warnings"])
    shares = exr(tmp_path / "s.exr", dict.fromkeys("RGB", grey().astype(np.float32)))
    assert maps(shares, "--only", "height")["warnings"] == []
    below = exr(tmp_path / "b.exr", dict.fromkeys("RGB", (grey() - 0.5).astype(np.float32)))
    assert "below 0 counts as 0" in maps(below, "--only", "height")["warnings"][0]


def height_map(path: Path) -> npt.NDArray[np.float64]:
    return np.asarray(Image.open(path), np.float64) / 65535.0


@pytest.mark.deep
def test_the_height_map_of_a_16_bit_dem_holds_its_codes(tmp_path: Path, maps: Maps, corpus: Path) -> None:
    """They were decoded as sRGB colour: 12 dB from the file."""
    names = ["fuji_512_16", "hugo_site_16", "rgbify_elev_512_16", "srtm_coast_513", "terrarium_256_16"]
    for name in names:
        path = corpus / "height" / f"{name}.png"
        result = maps(path, "--only", "height")
        truth = height_map(path)
        assert np.array_equal(height_map(tmp_path / "out" / result["maps"]["height"]["file"]), truth), name


@pytest.mark.parametrize("kind", sample(["float", "hgt", "exr"], every=3))
def test_metres_give_the_maps_of_the_16_bit_picture_of_their_span(
    tmp_path: Path, maps: Maps, kind: str
) -> None:
    """Full white stands S percent of the width high, whatever unit the file counts in."""
    metres = np.rint(waves(64, 64, 8) * 80 + 700).astype(np.float32)
    share = (metres.astype(np.float64) - metres.min()) / np.ptp(metres)
    if kind == "hgt":
        path = tmp_path / "N00E000.hgt"
        path.write_bytes(metres.astype(">i2").tobytes())
    else:
        path = tiff(tmp_path / "m.tif", metres) if kind == "float" else exr(tmp_path / "m.exr", {"Y": metres})
    result = maps(
        path, "--only", "normal,height", "--strength", 20, "--filter", "central", "--wrap", "repeat"
    )
    assert np.abs(height_map(tmp_path / "out" / f"{path.stem}_height.png") - share).max() < 1e-5
    assert "says how high the highest stands" in " ".join(result["warnings"])
    codes = np.asarray(Image.open(tmp_path / "out" / f"{path.stem}_normal.png"), np.float64)[:, :, :3]
    made = np.where(codes == 128, 127, codes) * 2 / 255 - 1
    made[codes == 127] = made[codes == 128] = 0.0
    rise = share * 0.2 * 64
    dx, dy = ((np.roll(rise, -1, axis) - np.roll(rise, 1, axis)) / 2 for axis in (1, 0))
    assert angles_between(made / np.linalg.norm(made, axis=2, keepdims=True), up(dx, dy)).max() < 0.8


@pytest.mark.deep
def test_holes_in_heights_of_maps_are_filled_and_told(tmp_path: Path, maps: Maps) -> None:
    metres = (waves(64, 64, 8) * 80 + 700).astype(np.float32)
    metres[10, 20] = -9999.0
    message = maps(tiff(tmp_path / "h.tif", metres), "--only", "height")
    assert any("1 pixel without a height (-9999" in text for text in message["warnings"])
    codes = (rounded(waves(64, 64, 8), 16)[0] * 60000 + 5000).astype(np.uint16)
    codes[5, 6] = 0
    path = save(tmp_path / "c.png", codes[:, :, None], oiio.UINT16)
    message = maps(path, "--only", "height", "--nodata", 0)
    assert any("(0, as given)" in text for text in message["warnings"])
    assert height_map(tmp_path / "out/c_height.png").min() > 0.05
    message = maps(path, "--from", "color", "--nodata", 0, code=1)
    assert "taken for colour" in message["error"][0]


def test_measure_guesses_alike(tmp_path: Path) -> None:
    from paradize.tradeoff.plan import FileOptions, file_groups

    for name, (path, kind) in pictures(tmp_path).items():
        stages = {group.stage for group in file_groups(path, FileOptions())}
        assert ("terrain" in stages) == (kind == "height"), name

"""three.js in headless Chromium, which shares no line with us, shows our KTX2 files as we say they are.

SwiftShader, the rasteriser, unpacks BC1, BC3, BC4 and BC5 to 8 bits a channel and rounds down twice; the
metrics decode them exactly. All tolerances below that are not float noise are that rounding.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.bakers.color import bake_color
from paradize.bakers.maps.bake import bake_maps
from paradize.data import HeightMap, Texture
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.layout import FORMATS, full_level_count, level_bytes
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.levels import color_levels, normal_levels, value_levels
from paradize.metrics.texels import decode_texels
from tests.e2e.three import ThreePage, three_page

F64 = npt.NDArray[np.float64]

# KTX2Loader of three.js 0.187 knows no two-channel SNORM and no 16-bit integers of one or two channels.
LACKING = {"RG8_SNORM", "R16_UNORM", "RG16_UNORM", "RG16_SNORM"}
# The extension that each family needs; SwiftShader has them all.
NEEDED = {
    "BC1": "WEBGL_compressed_texture_s3tc_srgb",
    "BC3": "WEBGL_compressed_texture_s3tc",
    "BC4": "EXT_texture_compression_rgtc",
    "BC5": "EXT_texture_compression_rgtc",
    "BC7": "EXT_texture_compression_bptc",
    "RGBA16F": "EXT_color_buffer_float",
}
# Largest difference of one texel in 8-bit steps, of the code where the format has one.
STEPS = {"BC1": 1.5 / 255, "BC3": 1.5 / 255, "BC4": 1.01 / 255, "BC5": 1.5 / 127, "BC7": 2e-4}


SLACK_DB = 0.35  # of a PSNR near 40 dB


@dataclass
class Page(ThreePage):
    """The pictures that three.js drew, by name, level and face."""

    drawn: dict[tuple[str, int, int], npt.NDArray[np.float32]] = field(default_factory=dict)

    def take(self, query: dict[str, str], body: bytes) -> None:
        shape = int(query["height"]), int(query["width"]), 4
        key = query["name"], int(query["level"]), int(query["face"])
        self.drawn[key] = np.frombuffer(body, "<f4").reshape(shape)

    def show(self, name: str, data: bytes) -> dict[str, Any]:
        return self.run(f"{name}.ktx2", data, f"window.show('{name}')")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with three_page("show_ktx2.html", Page, tmp_path_factory) as page:
        yield page


def to_light(values: F64) -> F64:
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def to_code(values: F64) -> F64:
    safe = np.maximum(values, 0.0)
    return np.where(safe <= 0.0031308, safe * 12.92, 1.055 * safe ** (1 / 2.4) - 0.055)


def shown_values(page: Page, name: str, texture: Texture, level: int, face: int = 0) -> F64:
    """The texels of a level as three.js drew them, in the codes of the format: sRGB encoded again."""
    drawn = page.drawn[name, level, face].astype(np.float64)
    if texture.format.endswith("_SRGB"):
        drawn = np.dstack([to_code(drawn[:, :, :3]), drawn[:, :, 3:]])
    return drawn


def chance(name: str, width: int, height: int, faces: int) -> Texture:
    """Blocks and texels by chance: every mode, every order of end colours."""
    rng = np.random.default_rng(sum(map(ord, name)) + faces)
    levels = []
    for level in range(full_level_count(width, height)):
        size = level_bytes(name, width, height, level, faces)
        if name in ("RGBA16F", "R32F"):
            kind = "<f2" if name == "RGBA16F" else "<f4"
            levels.append(rng.normal(0, 100, size // FORMATS[name].type_size).astype(kind).tobytes())
        else:
            levels.append(rng.integers(0, 256, size, dtype=np.uint8).tobytes())
    return Texture(name, width, height, tuple(levels), faces)


def require_shown(page: Page, name: str, texture: Texture, faces: int) -> None:
    tolerance = STEPS.get(texture.format[:3], 2e-4 if texture.format.endswith("SRGB") else 1e-6)
    for level in range(len(texture.levels)):
        for face in range(faces):
            expected = decode_texels(texture, level, face).astype(np.float64)
            found = shown_values(page, name, texture, level, face)[:, :, : expected.shape[2]]
            assert found.shape == expected.shape
            worst = float(np.abs(found - expected).max())
            assert worst <= tolerance, f"{name}, level {level}, face {face}: {worst * 255} steps of 255"


def test_this_webgl_has_every_extension_that_our_formats_need(page: Page) -> None:
    offered = page.browser.run("window.offers()")
    assert {family: need for family, need in NEEDED.items() if need not in offered} == {}


@pytest.mark.parametrize("name", sorted(FORMATS.keys() - LACKING))
@pytest.mark.parametrize("zstd_level", [None, 3])
def test_three_shows_every_level_of_every_format_as_the_metrics_decode_it(
    page: Page, name: str, zstd_level: int | None
) -> None:
    texture = chance(name, 36, 20, 1)  # mips of 18 x 10, 9 x 5, 4 x 2, 2 x 1, 1 x 1
    key = f"{name}_{zstd_level}"
    found = page.show(key, encode_ktx2(texture, zstd_level=zstd_level))
    assert found["levels"] == 6
    assert found["colorSpace"] == ("srgb" if name.endswith("_SRGB") else "srgb-linear")
    require_shown(page, key, texture, 1)


@pytest.mark.parametrize("name", sorted(name for name in FORMATS if name.startswith("BC")))
def test_three_shows_the_six_faces_of_a_cube_in_their_places(page: Page, name: str) -> None:
    texture = chance(name, 16, 16, 6)
    key = f"{name}_cube"
    assert page.show(key, encode_ktx2(texture, zstd_level=3))["faces"] == 6
    require_shown(page, key, texture, 6)


def test_of_an_uncompressed_cube_three_shows_the_first_face_only(page: Page) -> None:
    """KTX2Loader makes a flat texture of it: the sky's RGBA16F is right as far as it looks."""
    texture = chance("RGBA16F", 16, 16, 6)
    assert page.show("sky", encode_ktx2(texture))["faces"] == 1
    require_shown(page, "sky", texture, 1)


@pytest.mark.parametrize("name", sorted(LACKING))
def test_what_three_lacks_it_refuses_by_number(page: Page, name: str) -> None:
    """When this fails, three.js has learnt a format: move it to the others."""
    with pytest.raises(RuntimeError, match=f"Unsupported vkFormat: {FORMATS[name].vk}"):
        page.show(name, encode_ktx2(chance(name, 8, 8, 1)))


def test_a_wrong_file_is_noticed_by_this_test(page: Page) -> None:
    texture = chance("BC1_RGB_SRGB", 16, 16, 1)
    page.show("wrong", encode_ktx2(texture))
    with pytest.raises(AssertionError, match="steps of 255"):
        require_shown(page, "wrong", chance("BC1_RGB_SRGB", 16, 16, 6), 1)


def rough_ground(size: int) -> npt.NDArray[np.float32]:
    """(size, size) heights 0..1 that repeat: waves of some lengths."""
    y, x = np.mgrid[0:size, 0:size] * (2 * np.pi / size)
    h = np.sin(3 * x) + np.sin(2 * y + x) + 0.4 * np.sin(7 * x - 5 * y) + 0.2 * np.sin(19 * y + 11 * x)
    return ((h - h.min()) / (h.max() - h.min())).astype(np.float32)


def save(path: Path, values: npt.NDArray[Any], top: int) -> None:
    """A PNG of (h, w, c) values 0..1 with codes 0..top, 255 or 65535; alpha is straight."""
    kind, dtype = (oiio.UINT8, np.uint8) if top == 255 else (oiio.UINT16, np.uint16)
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(np.rint(values * top).astype(dtype)), out.geterror()
    out.close()


def as_texture(page: Page, key: str, texture: Texture) -> Texture:
    """The drawn texels as a texture of plain 8-bit codes, which is all that SwiftShader keeps of a block."""
    count = decode_texels(texture, len(texture.levels) - 1).shape[2]
    kind, top, dtype = "UNORM", 255, np.uint8
    if texture.format.endswith("SNORM"):
        kind, top, dtype = "SNORM", 127, np.int8
    if texture.format.endswith("SRGB"):
        kind = "SRGB"
    name = {1: "R8_", 2: "RG8_"}.get(count, "RGBA8_") + kind
    levels = []
    for level in range(len(texture.levels)):
        codes = np.rint(shown_values(page, key, texture, level) * top).astype(dtype)
        levels.append(np.ascontiguousarray(codes[:, :, : count if count < 3 else 4]).tobytes())
    return Texture(name, texture.width, texture.height, tuple(levels))


@pytest.mark.parametrize("tier", ["balanced", "exact"])
@pytest.mark.parametrize("alpha", [False, True])
def test_colours_that_three_shows_have_the_error_that_the_bake_measured(
    page: Page, tmp_path: Path, tier: str, alpha: bool
) -> None:
    h = rough_ground(64)
    color = np.dstack([0.3 + 0.6 * h, 0.2 + 0.5 * h * h, 0.5 - 0.4 * h])
    if alpha:
        color = np.dstack([color, np.where(h > 0.4, 1.0, 0.0)])
    codes = np.rint(color * 255) / 255
    save(tmp_path / "color.png", codes, 255)
    made = bake_color(tmp_path / "color.png", wrap="repeat", tier=tier, zstd=3)
    texture = decode_ktx2(made.data)
    key = f"color_{tier}_{alpha}"
    page.show(key, made.data)
    source = np.rint(codes * 255).astype(np.uint8)
    cutoff = 0.5 if alpha else None
    # Under a hole the bake spreads colours and measures against those: there, our own measurement is the one.
    measured = color_levels(texture, source, encoded=True, alpha_cutoff=cutoff) if alpha else made.levels
    assert made.levels[0]["psnr_db"] == made.errors["color_psnr_db"]
    shown = color_levels(as_texture(page, key, texture), source, encoded=True, alpha_cutoff=cutoff)
    for level, (ours, theirs) in enumerate(zip(measured, shown, strict=True)):
        if min(texture.width, texture.height) >> level >= 8:  # below, a single texel decides
            assert theirs["psnr_db"] == pytest.approx(ours["psnr_db"], abs=SLACK_DB), (level, ours, theirs)
            if alpha:
                assert theirs["alpha_psnr_db"] >= ours["alpha_psnr_db"] - 1.0, (level, ours, theirs)


def test_normals_and_heights_that_three_shows_have_the_error_that_was_measured(
    page: Page, tmp_path: Path
) -> None:
    save(tmp_path / "h.png", rough_ground(128)[:, :, None], 65535)
    heights = (np.rint(rough_ground(128) * 65535) / 65535).astype(np.float32)
    made = bake_maps(tmp_path / "h.png", source="height", strength=4.0, wrap="repeat")
    page.show("normal", made["normal"].data)
    texture = decode_ktx2(made["normal"].data)
    assert texture.format == "BC5_SNORM"
    slope = 0.04 * 128
    name = made["normal"].filter
    assert name is not None
    ground = HeightMap(heights, (slope, slope), (True, True), name)
    shown = normal_levels(as_texture(page, "normal", texture), ground)
    for level, (ours, theirs) in enumerate(zip(made["normal"].levels, shown, strict=True)):
        assert theirs["mean_deg"] == pytest.approx(ours["mean_deg"], abs=0.25), (level, ours, theirs)
        assert theirs["max_deg"] <= ours["max_deg"] + 1.0, (level, ours, theirs)
    page.show("height", made["height"].data)
    shown = value_levels(as_texture(page, "height", decode_ktx2(made["height"].data)), heights[:, :, None])
    for level, (ours, theirs) in enumerate(zip(made["height"].levels, shown, strict=True)):
        assert theirs["max"] <= ours["max"] + 1.01 / 255, (level, ours, theirs)
        assert theirs["p99"] == pytest.approx(ours["p99"], abs=1.01 / 255), (level, ours, theirs)

"""Promises of the image reader: right pixels or one clear error, never something in between."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import PIL.Image
import PIL.ImageCms
import pytest

from paradize.errors import BakeError, SourceError
from paradize.readers.damage import check_damage
from paradize.readers.image import read_image
from paradize.readers.targa import check_targa
from tests.pipeline.raw_files import exr
from tests.sweeps import CORPUS_DEEP, sample


def write(path: Path, pixels: np.ndarray, kind: object, **attributes: object) -> Path:
    """A picture of (h, w, c) values through OpenImageIO."""
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    for key, value in attributes.items():
        spec.attribute("oiio:" + key, value)
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec), target.geterror()
    assert target.write_image(np.ascontiguousarray(pixels)), target.geterror()
    assert target.close()
    return path


def expand(pixels: np.ndarray) -> np.ndarray:
    """Any of 1 to 4 channels as red, green, blue, alpha."""
    height, width, channels = pixels.shape
    color = np.repeat(pixels[:, :, :1], 3, axis=2) if channels < 3 else pixels[:, :, :3]
    alpha = pixels[:, :, -1:] if channels in (2, 4) else np.ones((height, width, 1))
    return np.concatenate([color, alpha], axis=2)


def test_every_pngsuite_file_has_the_pixels_that_its_json_states(corpus: Path) -> None:
    compared = 0
    for path in sorted((corpus / "images/pngsuite").glob("*.png")):
        truth = corpus / "images/pngsuite-json" / f"{path.stem}.json"
        if not truth.exists():
            continue
        image = read_image(path)
        height, width, _ = image.pixels.shape
        expected = np.array(json.loads(truth.read_text())).reshape(height, width, 4)
        got = np.rint(expand(image.pixels) * (65535 if image.source_bits == 16 else 255))
        assert np.array_equal(got, expected), path.name
        compared += 1
    assert compared >= 30


def test_every_corrupt_pngsuite_file_gives_a_clear_error(corpus: Path) -> None:
    files = sorted((corpus / "images/pngsuite").glob("x*.png"))
    assert len(files) >= 6
    for path in files:
        with pytest.raises(SourceError, match=path.name):
            read_image(path)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize(("kind", "top"), [(oiio.UINT8, 255), (oiio.UINT16, 65535)])
def test_integers_of_one_to_four_channels_are_divided_exactly(
    tmp_path: Path, channels: int, kind: object, top: int
) -> None:
    dtype = np.uint8 if top == 255 else np.uint16
    codes = (np.arange(5 * 7 * channels) * 7919 % (top + 1)).reshape(5, 7, channels).astype(dtype)
    image = read_image(write(tmp_path / "a.png", codes, kind, UnassociatedAlpha=1))
    assert image.pixels.dtype == np.float32
    assert image.pixels.shape == (5, 7, channels)
    assert np.array_equal(image.pixels, codes.astype(np.float32) / np.float32(top))
    assert (image.color_space, image.source_bits) == ("srgb", 8 if top == 255 else 16)


@pytest.mark.parametrize(("kind", "bits"), [(oiio.HALF, 16), (oiio.FLOAT, 32)])
def test_floats_come_as_they_are_and_are_linear(tmp_path: Path, kind: object, bits: int) -> None:
    values = np.array([[[-3.5], [0.0], [0.25]], [[1.0], [65504.0], [1e-3]]], np.float32)
    values = values.astype(np.float16).astype(np.float32)
    image = read_image(write(tmp_path / "a.exr", values, kind))
    assert np.array_equal(image.pixels, values)
    assert (image.color_space, image.source_bits) == ("linear", bits)


def test_signed_integers_are_numbers_as_they_are(tmp_path: Path) -> None:
    metres = np.array([[[-32768], [-7]], [[0], [8849]]], np.int16)
    image = read_image(write(tmp_path / "a.tif", metres, oiio.INT16))
    assert np.array_equal(image.pixels, metres.astype(np.float32))
    assert (image.color_space, image.source_bits) == ("linear", 16)


def test_colour_under_transparent_texels_survives(tmp_path: Path) -> None:
    codes = np.array([[[200, 100, 50, 0], [100, 100, 100, 1], [9, 8, 7, 255]]], np.uint8)
    for name in ("a.png", "a.tga", "a.tif"):
        image = read_image(write(tmp_path / name, codes, oiio.UINT8, UnassociatedAlpha=1))
        assert np.array_equal(np.rint(image.pixels * 255), codes), name


def test_premultiplied_alpha_is_undone(tmp_path: Path) -> None:
    straight = np.array([[[0.5, 0.25, 1.0, 0.5], [0.3, 0.2, 0.1, 0.0], [2.0, 1.0, 0.0, 1.0]]], np.float32)
    stored = straight.copy()
    stored[0, 0, :3] *= 0.5
    image = read_image(write(tmp_path / "a.exr", stored, oiio.FLOAT))
    assert np.allclose(image.pixels, straight, atol=1e-7)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (3, 5)])
def test_any_size_from_one_texel_up_is_read(tmp_path: Path, size: tuple[int, int]) -> None:
    codes = np.arange(size[0] * size[1] * 3, dtype=np.uint8).reshape(*size, 3)
    assert read_image(write(tmp_path / "a.png", codes, oiio.UINT8)).pixels.shape == (*size, 3)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.tga", "a.tif", "a.exr", "a.bmp", "a.ppm", "a.hdr"])
@pytest.mark.parametrize("share", sample([0.0, 0.05, 0.3, 0.6, 0.9], every=2))
def test_a_cut_file_is_refused(tmp_path: Path, name: str, share: float) -> None:
    rng = np.random.default_rng(5)
    codes = rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)
    kind = oiio.FLOAT if name.endswith(("exr", "hdr")) else oiio.UINT8
    pixels = codes.astype(np.float32) / 255 if kind == oiio.FLOAT else codes
    path = write(tmp_path / name, pixels, kind)
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
    with pytest.raises(SourceError, match=name):
        read_image(path)


@pytest.mark.parametrize("compression", ["none", "rle"])
def test_a_targa_cut_before_its_last_texel_is_refused(tmp_path: Path, compression: str) -> None:
    codes = np.zeros((16, 16, 3), np.uint8)
    codes[::3, ::5] = 200
    path = tmp_path / "a.tga"
    spec = oiio.ImageSpec(16, 16, 3, oiio.UINT8)
    spec.attribute("compression", compression)
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    assert target.write_image(codes)
    assert target.close()
    data = path.read_bytes()
    assert np.array_equal(np.rint(read_image(path).pixels * 255), codes)
    texels_end = data.rfind(b"TRUEVISION") - 8 - 495 if b"TRUEVISION" in data else len(data)
    for length in range(texels_end // 2, texels_end - 600 if texels_end > 1200 else texels_end - 1, 7):
        path.write_bytes(data[:length])
        with pytest.raises(SourceError):
            read_image(path)


@pytest.mark.parametrize("compression", [None, "tga_rle"])
def test_a_targa_of_grey_and_alpha_is_not_red_and_green(tmp_path: Path, compression: str | None) -> None:
    codes = np.stack([np.arange(0, 240, 5), np.arange(255, 15, -5)], axis=1).reshape(6, 8, 2).astype(np.uint8)
    PIL.Image.fromarray(codes, "LA").save(tmp_path / "a.tga", compression=compression)
    assert np.array_equal(read_image(tmp_path / "a.tga").values, codes)


def test_a_picture_that_says_to_be_turned_is_told(tmp_path: Path) -> None:
    said = PIL.Image.Exif()
    said[0x112] = 6
    PIL.Image.new("RGB", (8, 4)).save(tmp_path / "a.jpg", exif=said)
    image = read_image(tmp_path / "a.jpg")
    assert image.values.shape == (4, 8, 3) and "orientation 6" in image.notes[0]


def test_damage_is_told_without_the_place_that_the_decoder_read_from(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).integers(0, 256, (64, 64, 3), np.uint8)
    PIL.Image.fromarray(noise).save(tmp_path / "a.jpg")
    data = (tmp_path / "a.jpg").read_bytes()
    (tmp_path / "a.jpg").write_bytes(data[:900] + bytes(200) + data[-2:])
    with pytest.raises(SourceError, match="damaged or cut") as caught:
        read_image(tmp_path / "a.jpg")
    assert '("a.jpg")' in caught.value.what


@pytest.mark.parametrize("bits", [15, 16, 24])
def test_a_targa_with_a_palette_ends_where_its_last_texel_does(tmp_path: Path, bits: int) -> None:
    """Colours of a palette take whole bytes: two where they have 15 bits."""
    head = struct.pack("<BBBHHBHHHHBB", 3, 1, 1, 0, 4, bits, 0, 0, 5, 2, 8, 0)
    start = head + b"abc" + bytes(4 * ((bits + 7) // 8))
    path = tmp_path / "a.tga"
    path.write_bytes(start + bytes(10))
    check_targa(path)
    path.write_bytes(start + bytes(9))
    with pytest.raises(SourceError, match="5 x 2 texels need more; save or export it again"):
        check_targa(path)


def test_runs_of_a_targa_are_counted_head_and_all(tmp_path: Path) -> None:
    """A run of 128 texels, then two packets of texels as they are: 1 + 3, 1 + 3 * 60, 1 + 3 * 4 bytes."""
    head = struct.pack("<BBBHHBHHHHBB", 0, 0, 10, 0, 0, 0, 0, 0, 64, 3, 24, 0)
    texels = bytes([255, 1, 2, 3, 59]) + bytes(180) + bytes([3]) + bytes(12)
    path = tmp_path / "a.tga"
    path.write_bytes(head + texels)
    check_targa(path)
    for length in range(1, len(texels)):
        path.write_bytes(head + texels[:length])
        with pytest.raises(SourceError, match="64 x 3 texels need more"):
            check_targa(path)


def test_codes_stay_the_files_codes_and_no_float_copy_is_kept(tmp_path: Path) -> None:
    for kind, dtype in ((oiio.UINT8, np.uint8), (oiio.UINT16, np.uint16)):
        codes = (np.arange(4 * 5 * 3) * 211 % 256).reshape(4, 5, 3).astype(dtype)
        image = read_image(write(tmp_path / "a.png", codes, kind))
        assert image.values.dtype == dtype
        assert np.array_equal(image.values, codes)
        assert image.pixels is not image.pixels


def pgm(body: bytes, *, top: int = 9, size: str = "4 2") -> bytes:
    return f"P5\n# by hand\n{size}\n{top}\n".encode() + body


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.pgm", pgm(bytes(7)), "7 bytes of texels; its header promises 8"),
        ("b.pgm", pgm(bytes([0, 9, 10, 0, 0, 0, 0, 0])), "a value of 10; its header says 9"),
        ("c.pgm", b"P2\n4 2\n9\n1 2 3 4 5 6 7\n", "7 values; its header promises 8"),
        ("d.pgm", b"P2\n4 2\n9\n1 2 3 4 5 6 7 10\n", "not a number in 0..9"),
    ],
)
def test_a_portable_map_that_contradicts_its_header_is_refused(
    tmp_path: Path, name: str, data: bytes, message: str
) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(SourceError, match=message):
        read_image(path)
    path.write_bytes(pgm(bytes(range(8))))
    assert np.array_equal(np.rint(read_image(path).pixels[:, :, 0] * 9), np.arange(8).reshape(2, 4))


def test_a_jpeg_without_its_end_is_refused_wherever_it_is_cut(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    path = write(tmp_path / "a.jpg", rng.integers(0, 256, (48, 48, 3), dtype=np.uint8), oiio.UINT8)
    data = path.read_bytes()
    read_image(path)
    for length in [*range(len(data) // 2, len(data) - 2, 37), len(data) - 1]:
        path.write_bytes(data[:length])
        with pytest.raises(SourceError):
            read_image(path)


def test_bytes_between_the_segments_of_a_jpegs_header_are_skipped_and_told(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    path = write(tmp_path / "a.jpg", rng.integers(0, 256, (48, 48, 3), dtype=np.uint8), oiio.UINT8)
    data, sound = path.read_bytes(), read_image(path)
    table = data.index(b"\xff\xdb")
    path.write_bytes(data[:table] + b"junk" + data[table:])
    spoilt = read_image(path)
    assert spoilt.notes == ("4 bytes of its header belong to nothing and are skipped",) and sound.notes == ()
    assert np.array_equal(spoilt.values, sound.values)
    path.write_bytes(data[:-400] + b"\xff\x05junk" + data[-400:])  # among the texels
    with pytest.raises(SourceError, match="damaged or cut"):
        read_image(path)


def test_a_jpeg_of_several_scans_without_the_last_bytes_of_one_is_read_and_told(tmp_path: Path) -> None:
    """As some programs of old wrote them; a picture of one scan that is cut is damaged."""
    rng = np.random.default_rng(2)
    path, colors = tmp_path / "a.jpg", rng.integers(0, 256, (48, 48, 3), dtype=np.uint8)
    for scans, told in ((True, True), (False, False)):
        PIL.Image.fromarray(colors).save(path, progressive=scans, quality=90)
        data = path.read_bytes()
        path.write_bytes(data[:-40] + b"\xff\xd9")
        if told:
            (note,) = read_image(path).notes
            assert note == "some of its data are missing; a part of it may be grey or coarse"
        else:
            with pytest.raises(SourceError, match="damaged or cut"):
                read_image(path)
    path.write_bytes(data.replace(b"\x08\x00\x30\x00\x30", b"\x0c\x00\x30\x00\x30"))  # 12 bits
    with pytest.raises(SourceError, match=r"is not read: .*precision 12.*save it as a PNG"):
        read_image(path)


def test_a_bitmap_whose_texels_leave_its_palette_or_its_file_is_refused(tmp_path: Path) -> None:
    head = (
        b"BM"
        + struct.pack("<IHHI", 0, 0, 0, 62)
        + struct.pack("<IiiHHIIiiII", 40, 4, 2, 1, 8, 0, 0, 0, 0, 2, 0)
    )
    palette, rows = bytes([0, 0, 0, 0, 255, 255, 255, 0]), bytes([0, 1, 0, 1, 1, 0, 1, 0])
    path = tmp_path / "a.bmp"
    path.write_bytes(head + palette + rows)
    assert read_image(path).values[:, :, 0].tolist() == [[255, 0, 255, 0], [0, 255, 0, 255]]
    for body, message in (
        (bytes([0, 1, 0, 2, 1, 0, 1, 0]), "its palette has 2"),
        (rows[:6], "damaged or cut"),
    ):
        path.write_bytes(head + palette + body)
        with pytest.raises(SourceError, match=message):
            read_image(path)


def test_what_fills_the_rows_of_a_bitmap_is_no_texel(tmp_path: Path) -> None:
    """Rows are multiples of four bytes; what stands behind the last texel of one may be anything."""
    head = (
        b"BM"
        + struct.pack("<IHHI", 0, 0, 0, 62)
        + struct.pack("<IiiHHIIiiII", 40, 5, 2, 1, 8, 0, 0, 0, 0, 2, 0)
    )
    rows = bytes([0, 1, 0, 1, 1, 99, 99, 99, 1, 0, 0, 0, 0, 99, 99, 99])
    path = tmp_path / "a.bmp"
    path.write_bytes(head + bytes([0, 0, 0, 0, 255, 255, 255, 0]) + rows)
    check_damage(path, "bmp")
    assert read_image(path).values[:, :, 0].tolist() == [[255, 0, 0, 0, 0], [0, 255, 0, 255, 255]]


def test_a_tiff_whose_strips_leave_the_file_is_refused(tmp_path: Path) -> None:
    codes = np.random.default_rng(2).integers(0, 256, (32, 32, 3), dtype=np.uint8)
    path = write(tmp_path / "a.tif", codes, oiio.UINT8)
    data = bytearray(path.read_bytes())
    (at,) = struct.unpack_from("<I", data, 4)
    for k in range(struct.unpack_from("<H", data, at)[0]):
        tag, _, count, value = struct.unpack_from("<HHII", data, at + 2 + 12 * k)
        if tag == 279:  # the strips' lengths: the last one grows beyond the file
            where = at + 10 + 12 * k if count == 1 else value + 4 * (count - 1)
            struct.pack_into("<I", data, where, 10 * len(data))
    path.write_bytes(data)
    with pytest.raises(SourceError, match=rf"texels end at byte \d+ of {len(data)}"):
        check_damage(path, "tiff")  # by its own reckoning, whatever the decoder finds
    with pytest.raises(SourceError, match="damaged or cut"):
        read_image(path)


def test_a_tiff_that_leaves_strips_out_is_refused_and_its_header_never_read_as_texels(tmp_path: Path) -> None:
    path = write(tmp_path / "a.tif", np.ones((64, 64, 3), np.float32), oiio.FLOAT)
    data = bytearray(path.read_bytes())
    (at,) = struct.unpack_from("<I", data, 4)
    for k in range(struct.unpack_from("<H", data, at)[0]):
        tag, _, count, value = struct.unpack_from("<HHII", data, at + 2 + 12 * k)
        if tag in (273, 279):  # the strips' places and lengths
            struct.pack_into("<I", data, at + 10 + 12 * k if count == 1 else value, 0)
    path.write_bytes(data)
    with pytest.raises(SourceError, match=r"are left out \(sparse\); save it whole"):
        read_image(path)


def test_what_is_no_picture_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.png").write_bytes(b"")
    (tmp_path / "text.png").write_text("this is no picture")
    for name in ("missing.png", "empty.png", "text.png", "."):
        with pytest.raises(SourceError):
            read_image(tmp_path / name)


@pytest.mark.parametrize("faces", [0, 0xFE00])
def test_the_faces_of_a_cube_map_are_no_picture(tmp_path: Path, faces: int) -> None:
    """A DDS file of 4 x 4 texels, flat or six times."""
    head = np.zeros(32, "<u4")
    head[0] = int.from_bytes(b"DDS ", "little")
    head[1:5] = [124, 0x100F, 4, 4]
    head[19:28] = [32, 0x41, 0, 32, 0xFF, 0xFF00, 0xFF0000, 0xFF000000, 0x1000 | (0x8 if faces else 0)]
    head[28] = faces
    path = tmp_path / "a.dds"
    path.write_bytes(head.tobytes() + bytes(range(64)) * (6 if faces else 1))
    if not faces:
        assert read_image(path).values.shape == (4, 4, 4)
        return
    with pytest.raises(SourceError, match="cube map"):
        read_image(path)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_texel_that_is_no_number_is_refused_with_its_place(tmp_path: Path, bad: float) -> None:
    values = np.zeros((600, 6, 3), np.float32)
    for row, count in ((571, 1), (2, 2)):
        values[row, 5, 1] = bad
        path = write(tmp_path / "a.exr", values, oiio.FLOAT)
        with pytest.raises(SourceError, match=rf"texel \(5, {row}\).* in channel 1, {count} such"):
            read_image(path)


def test_a_refusal_is_one_message_and_nothing_of_the_decoders(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "a.png", np.zeros((64, 64, 3), np.uint8), oiio.UINT8)
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(SourceError):
        read_image(path)
    print("still here", file=sys.stderr)
    assert capfd.readouterr().err == "still here\n"


def bomb(width: int, height: int) -> bytes:
    """A PNG of one colour whose file is small whatever its size: rows are never decoded if it is refused."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(bytes(1000), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(32769, 1), (20000, 20000), (2**31 - 1, 2**31 - 1)])
def test_a_bomb_is_refused_before_it_is_decoded(tmp_path: Path, size: tuple[int, int]) -> None:
    path = tmp_path / "bomb.png"
    path.write_bytes(bomb(*size))
    with pytest.raises(SourceError):
        read_image(path)


@pytest.mark.parametrize("name", ["a.png", "a.tif", "a.bmp", "a.exr"])
def test_a_picture_of_more_bytes_than_the_limit_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kind = oiio.HALF if name == "a.exr" else oiio.UINT8
    path = write(tmp_path / name, np.zeros((1024, 352, 3), np.float32 if name == "a.exr" else np.uint8), kind)
    monkeypatch.setenv("PARADIZE_MAX_MB", "1")
    with pytest.raises(SourceError, match=r"more than 1 MB.*raise PARADIZE_MAX_MB"):
        read_image(path)
    monkeypatch.setenv("PARADIZE_MAX_MB", "4")
    assert read_image(path).values.shape == (1024, 352, 3)


def test_the_limits_are_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for shape in ((8, 9, 3), (9, 8, 3)):
        path = write(tmp_path / "a.png", np.zeros(shape, np.uint8), oiio.UINT8)
        with monkeypatch.context() as settings, pytest.raises(SourceError, match="at most 8 per side"):
            settings.setenv("PARADIZE_MAX_SIDE", "8")
            read_image(path)
    path = write(tmp_path / "a.png", np.zeros((8, 8, 3), np.uint8), oiio.UINT8)
    for name, number, message in (
        ("PARADIZE_MAX_SIDE", "4", "at most 4 per side"),
        ("PARADIZE_MAX_TEXELS", "63", "63 in all"),
    ):
        with monkeypatch.context() as settings:
            settings.setenv(name, number)
            with pytest.raises(SourceError, match=message):
                read_image(path)
            settings.setenv(name, "64")
            assert read_image(path).values.shape == (8, 8, 3)
            settings.setenv(name, "many")
            with pytest.raises(BakeError, match=name):
                read_image(path)


SURVIVE = """
import resource, sys
from pathlib import Path
from paradize.errors import SourceError
from paradize.readers.image import read_image
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
for name in sys.stdin.read().splitlines():
    try:
        pixels = read_image(Path(name)).pixels
    except SourceError as error:
        assert name in str(error), str(error)
        print("refused", name)
    else:
        print("read", name)
"""


def survive(files: list[Path]) -> dict[str, int]:
    """Reads the files in a process of its own, within 8 GiB and 100 s; what came of them."""
    names = "\n".join(map(str, files))
    command = [sys.executable, "-c", SURVIVE]
    done = subprocess.run(
        command, input=names, capture_output=True, text=True, timeout=300, env={**os.environ}
    )
    assert done.returncode == 0, done.stderr[-2000:]
    lines = done.stdout.splitlines()
    assert len(lines) == len(files)
    return {word: sum(line.startswith(word) for line in lines) for word in ("read", "refused")}


def malformed(sources: Path) -> list[Path]:
    return sorted(path for path in (sources / "malformed").rglob("*") if path.is_file())


@CORPUS_DEEP
def test_a_sample_of_malformed_files_is_survived(sources: Path) -> None:
    counts = survive(malformed(sources)[::8])
    assert counts["refused"] > counts["read"]


@pytest.mark.deep
def test_every_malformed_file_is_survived(sources: Path) -> None:
    counts = survive(malformed(sources))
    assert counts["refused"] > counts["read"]


@pytest.mark.parametrize("top", [1, 2, 7, 100, 127, 254, 255, 256, 1000, 1023, 4095, 32767, 65534, 65535])
def test_each_code_of_a_pgm_is_its_share_of_the_files_largest(tmp_path: Path, top: int) -> None:
    """Codes of 0..100 came out up to a whole step of 255 too low."""
    codes = np.arange(-(-(top + 1) // 256) * 256).reshape(-1, 256).clip(0, top)
    raw, text = tmp_path / "raw.pgm", tmp_path / "text.pgm"
    head = f"# largest below\n256 {len(codes)}\n{top}\n".encode()
    raw.write_bytes(b"P5\n" + head + codes.astype(">u2" if top > 255 else "u1").tobytes())
    text.write_bytes(b"P2\n" + head + b" ".join(b"%d" % code for code in codes.flat) + b"\n")
    for path in (raw, text):
        image = read_image(path)
        assert np.array_equal(image.pixels[:, :, 0], (codes / top).astype(np.float32))
        assert image.source_bits == (16 if top > 255 else 8) and image.top == top


def test_of_several_pictures_in_a_file_the_first_is_read_and_told(tmp_path: Path) -> None:
    pages = [PIL.Image.new("RGB", (4, 4), color) for color in ("red", "green")]
    pages[0].save(tmp_path / "two.tif", save_all=True, append_images=pages[1:])
    pages[0].save(tmp_path / "one.tif")
    two = read_image(tmp_path / "two.tif")
    assert two.values[0, 0].tolist() == [255, 0, 0]
    assert two.notes == ("holds several pictures; the first is read",)
    assert read_image(tmp_path / "one.tif").notes == ()


def test_smaller_copies_of_a_picture_are_no_pictures_and_a_mask_is_told(tmp_path: Path) -> None:
    """As GDAL writes overviews, and masks of the pixels that count."""
    roles = {"overviews": (1, 1), "mask": (4,), "both": (5, 1), "picture": (1, 0)}
    for name, further in roles.items():
        pages = [PIL.Image.new("L", (4, 4), 9) for _ in (0, *further)]
        for page, role in zip(pages[1:], further, strict=True):
            page.encoderinfo = {"tiffinfo": {254: role}}
        pages[0].save(tmp_path / f"{name}.tif", save_all=True, append_images=pages[1:])
    notes = {name: read_image(tmp_path / f"{name}.tif").notes for name in roles}
    assert notes["overviews"] == () and notes["picture"] == ("holds several pictures; the first is read",)
    assert notes["mask"] == notes["both"]
    assert notes["mask"][0].startswith("has a mask, which is not read")


@pytest.mark.parametrize(("codec", "name"), [(34887, "LERC"), (50002, "scheme 50002")])
def test_a_tiff_whose_compression_is_not_read_is_not_called_damaged(
    tmp_path: Path, codec: int, name: str
) -> None:
    PIL.Image.new("L", (4, 4)).save(tmp_path / "a.tif", compression="tiff_lzw")
    entry = struct.pack("<HHI", 259, 3, 1)
    data = (tmp_path / "a.tif").read_bytes()
    assert data.count(entry + struct.pack("<I", 5)) == 1
    data = data.replace(entry + struct.pack("<I", 5), entry + struct.pack("<I", codec))
    (tmp_path / "a.tif").write_bytes(data)
    with pytest.raises(
        SourceError, match=f"is compressed by {name}, which is not read; save it with Deflate"
    ):
        read_image(tmp_path / "a.tif")


def test_the_fourth_channel_of_a_photoshop_picture_is_its_alpha(tmp_path: Path) -> None:
    planes = np.random.default_rng(1).integers(0, 256, (4, 6, 8), np.uint8)
    for channels in (3, 4):
        head = b"8BPS" + struct.pack(">H6xHIIHH", 1, channels, 6, 8, 8, 3)
        (tmp_path / f"{channels}.psd").write_bytes(head + bytes(14) + planes[:channels].tobytes())
    three, four = (read_image(tmp_path / f"{channels}.psd") for channels in (3, 4))
    assert np.array_equal(three.values, np.moveaxis(planes[:3], 0, 2)) and three.notes == ()
    assert np.array_equal(four.values, np.moveaxis(planes, 0, 2))
    assert four.notes == ("its fourth channel is taken for alpha, as game engines take it",)
    version = (tmp_path / "4.psd").read_bytes().replace(b"8BPS\0\1", b"8BPS\0\2")
    (tmp_path / "large.psb").write_bytes(version.replace(bytes(14), bytes(18)))
    deep = head.replace(struct.pack(">HH", 8, 3), struct.pack(">HH", 16, 3))
    (tmp_path / "deep.psd").write_bytes(deep + bytes(14) + np.repeat(planes, 2).tobytes())
    for name in ("large.psb", "deep.psd"):
        image = read_image(tmp_path / name)
        assert image.values.shape == (6, 8, 3) and "more channels than its colours" in image.notes[0]
    (tmp_path / "4.psd").write_bytes(head + bytes(14) + planes[:3].tobytes() + bytes(48))
    assert read_image(tmp_path / "4.psd").values.shape == (6, 8, 3), "an empty channel hides nothing"


def test_colours_of_another_profile_are_told_and_data_has_none(tmp_path: Path) -> None:
    profile = PIL.ImageCms.ImageCmsProfile(PIL.ImageCms.createProfile("sRGB")).tobytes()
    named = "sRGB built-in".encode("utf-16-be")
    assert named in profile
    red, green = (profile.index(tag) for tag in (b"rXYZ", b"gXYZ"))  # each: name, offset, size
    swapped = bytearray(profile)
    swapped[red + 4 : red + 8] = profile[green + 4 : green + 8]
    swapped[green + 4 : green + 8] = profile[red + 4 : red + 8]
    profiles = {
        "own": profile,
        "renamed": profile.replace(named, "Camera colour".encode("utf-16-be")),
        "broken": profile[:100],
        "other": bytes(swapped),
    }
    for name, data in profiles.items():
        for kind in ("jpg", "avif"):
            PIL.Image.new("RGB", (4, 4)).save(tmp_path / f"{name}.{kind}", icc_profile=data)
            image = read_image(tmp_path / f"{name}.{kind}")
            assert image.notes == () and len(image.color_notes) == (name == "other"), (name, kind)
    assert image.color_notes[0] == (
        "its colours are of the profile 'sRGB built-in', read as if they were sRGB; convert it to sRGB"
    )
    assert read_image(tmp_path / "other.jpg", color_space="data").color_notes == ()


def with_chunk(path: Path, chunk: bytes) -> None:
    """Writes a chunk, its name and data, after the head of a PNG."""
    data, size = path.read_bytes(), struct.pack(">I", len(chunk) - 4)
    path.write_bytes(data[:33] + size + chunk + struct.pack(">I", zlib.crc32(chunk)) + data[33:])


@pytest.mark.parametrize(
    ("kind", "body", "said"),
    [
        (b"cICP", bytes([12, 13, 0, 1]), "srgb_p3d65_scene, read as if they were sRGB; convert it to sRGB"),
        (
            b"gAMA",
            struct.pack(">I", 55556),
            "g18_rec709_scene, read as if they were sRGB; convert it to sRGB",
        ),
        (b"gAMA", struct.pack(">I", 45455), ""),
        (b"gAMA", struct.pack(">I", 100000), "says that it is linear, and is read so"),
    ],
)
def test_colours_that_a_header_says_to_be_others_are_told(
    tmp_path: Path, kind: bytes, body: bytes, said: str
) -> None:
    path = tmp_path / "a.png"
    PIL.Image.new("RGB", (2, 2), (99, 99, 99)).save(path)
    with_chunk(path, kind + body)
    notes = read_image(path).color_notes
    assert len(notes) == bool(said) and all(note.endswith(said) for note in notes)
    assert read_image(path, color_space="data").color_notes == ()
    if said.startswith("says"):
        assert read_image(path, color_space="srgb").color_notes == ()


def test_a_profile_in_a_png_precedes_its_gamma_and_cicp_both(tmp_path: Path) -> None:
    profile = PIL.ImageCms.ImageCmsProfile(PIL.ImageCms.createProfile("sRGB")).tobytes()
    path = tmp_path / "a.png"
    PIL.Image.new("RGB", (2, 2), (99, 99, 99)).save(path, icc_profile=profile)
    with_chunk(path, b"gAMA" + struct.pack(">I", 100000))
    picture = read_image(path)
    assert picture.color_space == "srgb" and picture.color_notes == ()
    with_chunk(path, b"cICP" + bytes([1, 8, 0, 1]))  # linear; it precedes both
    assert read_image(path).color_space == "linear"


def test_an_openexr_of_other_primaries_is_told(tmp_path: Path) -> None:
    pixels = np.full((2, 2, 3), 0.5, np.float32)
    for name, red, told in (("rec709", 0.64, False), ("aces", 0.7347, True)):
        primaries = (red, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
        path = tmp_path / f"{name}.exr"
        spec = oiio.ImageSpec(2, 2, 3, oiio.FLOAT)
        spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), primaries)
        out = oiio.ImageOutput.create(str(path))
        assert out.open(str(path), spec) and out.write_image(pixels)
        out.close()
        assert ["of other primaries" in note for note in read_image(path).color_notes] == [True] * told


def test_a_png_of_high_dynamic_range_is_refused_as_colours(tmp_path: Path) -> None:
    PIL.Image.new("RGB", (4, 4)).save(tmp_path / "a.png")
    with_chunk(tmp_path / "a.png", b"cICP" + bytes([9, 16, 0, 1]))  # BT.2020 primaries, PQ, RGB, full range
    with pytest.raises(
        SourceError, match=r"colours are of high dynamic range \(PQ\), not sRGB; save it as Op"
    ):
        read_image(tmp_path / "a.png")
    assert read_image(tmp_path / "a.png", color_space="data").values.shape == (4, 4, 3)


def test_an_openexr_that_holds_a_part_of_its_picture_is_told(tmp_path: Path) -> None:
    spec = oiio.ImageSpec(4, 3, 3, "half")
    spec.x, spec.y, spec.full_width, spec.full_height = 5, 6, 16, 12
    target = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert target.open(str(tmp_path / "a.exr"), spec) and target.write_image(np.ones((3, 4, 3), np.float32))
    assert target.close()
    PIL.Image.new("L", (4, 3)).save(tmp_path / "a.png")
    with_chunk(
        tmp_path / "a.png", b"oFFs" + struct.pack(">iiB", 5, 6, 0)
    )  # its place on a page, as GIMP has it
    assert read_image(tmp_path / "a.png").notes == ()
    (said,) = read_image(tmp_path / "a.exr").notes
    assert said == (
        "its 4 x 3 texels begin at (5, 6) of a picture of 16 x 12; they are read as a whole picture"
    )


def test_colours_that_are_no_rgb_are_refused(tmp_path: Path) -> None:
    """OpenImageIO hands L, a and b over as red, green and blue."""
    PIL.Image.new("LAB", (4, 4)).save(tmp_path / "a.tif")
    with pytest.raises(SourceError, match="its colours are CIELAB, not RGB; save it as RGB"):
        read_image(tmp_path / "a.tif")


@pytest.mark.parametrize(
    ("names", "kept"),
    [
        ("R G B Z", "R G B"),
        ("R G B id", "R G B"),
        ("Y right.Y", "Y"),
        ("Y Z", "Y"),
        ("BY RY Y", "Y"),
        ("L.Depth.Z L.Main.A L.Main.B L.Main.G L.Main.R", "L.Main.R L.Main.G L.Main.B L.Main.A"),
        ("Red G B A Depth", "Red G B A"),
        ("one.R one.G one.B R G B", "R G B"),
        ("Normal.X Normal.Y Normal.Z Depth", "Normal.X Normal.Y Normal.Z"),
        ("A Z", "A"),
        ("R G", "R G"),
        ("A Y", "Y A"),
        ("X Y Z", "X Y Z"),
        ("N.X N.Y", "N.X N.Y"),
        ("U V", "U V"),
        ("A G R", "R G"),
        ("red green blue alpha", "red green blue alpha"),
        ("P Q S", "P Q S"),
    ],
)
def test_channels_of_an_openexr_are_read_by_name_and_others_are_told(
    tmp_path: Path, names: str, kept: str
) -> None:
    """Alpha is 1: it divides nothing."""
    levels = {
        name: 1.0 if name.endswith(("A", "alpha")) else 0.01 * (k + 1) for k, name in enumerate(names.split())
    }
    planes = {name: np.full((2, 3), level, np.float32) for name, level in levels.items()}
    picture = read_image(exr(tmp_path / "a.exr", planes))
    wanted = [levels[name] for name in kept.split()]
    found = picture.values[0, 0].tolist()
    if len(kept.split()) == 2 and not kept.endswith("A"):  # red and green: a third one is added
        assert found.pop() == 0.0
    assert found == pytest.approx(wanted)
    left = [name for name in sorted(levels) if name not in kept.split()]
    assert len(picture.notes) == bool(left)
    for note in picture.notes:
        read, _, rest = note.partition("; left out: ")
        assert read == f"channels read: {', '.join(kept.split())}" and sorted(rest.split(", ")) == left


def test_alpha_divides_colours_and_no_numbers(tmp_path: Path) -> None:
    """Heights, normals and roughness beside an alpha that means something else."""
    planes = {name: np.full((2, 2), level, np.float32) for name, level in (("Y", 0.5), ("A", 0.25))}
    file = exr(tmp_path / "a.exr", planes)
    assert read_image(file).values[0, 0].tolist() == [2.0, 0.25]
    assert read_image(file, color_space="data").values[0, 0].tolist() == [0.5, 0.25]


def test_alpha_of_the_layer_that_is_read_divides_its_colours(tmp_path: Path) -> None:
    levels = {"a.A": 0.5, "b.R": 0.25, "b.G": 0.25, "b.B": 0.25, "b.A": 0.25}
    planes = {name: np.full((1, 1), level, np.float32) for name, level in levels.items()}
    assert read_image(exr(tmp_path / "a.exr", planes)).values[0, 0].tolist() == [1.0, 1.0, 1.0, 0.25]


def test_a_targa_that_says_so_is_multiplied_by_alpha(tmp_path: Path) -> None:
    """The byte of attributes in the extension area of version 2; brighter than alpha is white."""
    head = struct.pack("<BBB5xHHHHBB", 0, 0, 2, 0, 0, 2, 1, 32, 8 | 32)
    texels = bytes([0, 20, 50, 100, 10, 20, 200, 100])
    extension = struct.pack("<H", 495) + bytes(492) + b"\4"
    foot = struct.pack("<II", len(head + texels), 0) + b"TRUEVISION-XFILE.\0"
    (tmp_path / "a.tga").write_bytes(head + texels + extension + foot)
    picture = read_image(tmp_path / "a.tga")
    assert picture.pixels[0] == pytest.approx(
        np.array([[0.5, 0.2, 0.0, 100 / 255], [1.0, 0.2, 0.1, 100 / 255]]), abs=1e-6
    )


def test_a_file_that_its_decoder_finds_cut_is_called_cut(tmp_path: Path) -> None:
    texels = PIL.Image.fromarray(np.random.default_rng(1).integers(0, 256, (16, 16), np.uint8))
    for name in ("a.gif", "a.tga"):
        path = tmp_path / name
        texels.save(path)
        path.write_bytes(path.read_bytes()[:-60])
        with pytest.raises(SourceError, match=r"damaged or cut: .*; save or export it again"):
            read_image(path)


@pytest.mark.parametrize(
    "history",
    [
        b"\tpfilt -1 a.hdr\n" * 200,
        b"x" * 128 + b"\n",
        b"FORMAT=32-bit_rle_rgbe\n" + b"\tpfilt -1 a.hdr\n" * 200,  # added behind the format
    ],
)
def test_radiance_pictures_with_a_long_history_are_read_as_those_without(
    history: bytes, tmp_path: Path
) -> None:
    texels = b"EXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + bytes([128, 64, 32, 129]) * 2
    short, long = tmp_path / "short.hdr", tmp_path / "long.hdr"
    short.write_bytes(b"#?RADIANCE\n" + texels)
    long.write_bytes(b"#?RADIANCE\n" + history + texels)
    assert np.array_equal(read_image(long).pixels, read_image(short).pixels)
    many = b"EXPOSURE=2\n" * 200  # nothing in them can be left out
    for begin, broken, words in (
        (history, texels[:-3], "damaged or cut"),
        (history.replace(b"FORMAT", b"F"), texels.replace(b"FORMAT", b"F"), "no FORMAT"),
        (many, texels, "no FORMAT"),
    ):
        long.write_bytes(b"#?RADIANCE\n" + begin + broken)
        with pytest.raises(SourceError, match=words) as caught:
            read_image(long)
        assert str(caught.value).startswith(f"{long}: ")

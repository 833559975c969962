"""JPEGs with a gain map (Ultra HDR): textures are as other programs show them, skies have all their light."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt
import PIL.Image
import pytest

from paradize.bakers.cubemap import read_faces
from paradize.readers.gain_map import LEFT_OUT
from paradize.readers.image import read_image

STOPS = 3  # that the brightest texel is brighter than white
SUN = 2.0**STOPS
XMP_AFTER_A_THUMBNAIL = b"\xff\xe1" + (60_002).to_bytes(2, "big") + bytes(60_000)
FILL_BYTES = b"\xff\xff"
RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
GOOGLE = "http://ns.google.com/photos/1.0/container/"
ITEM = '<rdf:li rdf:parseType="Resource"><Container:Item Item:Mime="image/jpeg" Item:Semantic="{}"/></rdf:li>'


def jpeg(texels: npt.NDArray[np.uint8], about: str, before: bytes = b"") -> bytes:
    """A JPEG with XMP that says this about its gain map. before: bytes before the segment of the XMP."""
    stream = io.BytesIO()
    PIL.Image.fromarray(texels).save(stream, "jpeg", quality=100)
    names = f'xmlns:rdf="{RDF}" xmlns:Container="{GOOGLE}" xmlns:Item="{GOOGLE}item/"'
    about = f'xmlns:hdrgm="http://ns.adobe.com/hdr-gain-map/1.0/" hdrgm:Version="1.0" {about}'
    text = (
        f'<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF {names}><rdf:Description {about}</rdf:RDF></x:xmpmeta>'
    )
    xmp = b"http://ns.adobe.com/xap/1.0/\0" + text.encode()
    plain = stream.getvalue()
    return plain[:2] + before + b"\xff\xe1" + (len(xmp) + 2).to_bytes(2, "big") + xmp + plain[2:]


def photograph(path: Path, before: bytes = b"") -> Path:
    """A picture of 32 x 16 texels, half of them grey, half brighter than white, as phones save it."""
    half = np.zeros((16, 32, 3), np.uint8)
    half[:, 16:] = 255
    gain = f'hdrgm:GainMapMin="0" hdrgm:GainMapMax="{STOPS}" hdrgm:Gamma="1" hdrgm:HDRCapacityMin="0"'
    rest = f'hdrgm:HDRCapacityMax="{STOPS}" hdrgm:OffsetSDR="0" hdrgm:OffsetHDR="0"'
    second = jpeg(half[:, :, 0], f'{gain} {rest} hdrgm:BaseRenditionIsHDR="False"/>')
    items = ITEM.format("Primary") + ITEM.format(f'GainMap" Item:Length="{len(second)}')
    listed = f"><Container:Directory><rdf:Seq>{items}</rdf:Seq></Container:Directory></rdf:Description>"
    path.write_bytes(jpeg(np.maximum(half, 120), listed, before) + second)
    return path


@pytest.mark.parametrize("before", [b"", XMP_AFTER_A_THUMBNAIL, FILL_BYTES])
def test_a_texture_with_a_gain_map_is_what_other_programs_show(tmp_path: Path, before: bytes) -> None:
    path = photograph(tmp_path / "photo.jpg", before)
    image = read_image(path)
    assert (image.color_space, image.top, image.color_notes[0]) == ("srgb", 255, LEFT_OUT)
    assert np.array_equal(image.values, np.asarray(PIL.Image.open(path).convert("RGB")))


def test_numbers_are_not_brightened_by_a_gain_map(tmp_path: Path) -> None:
    image = read_image(photograph(tmp_path / "rough.jpg"), color_space="data")
    assert (image.color_space, image.top) == ("data", 255)


def test_a_sky_has_the_light_of_a_gain_map(tmp_path: Path) -> None:
    faces = read_faces([photograph(tmp_path / "sky.jpg")])
    assert float(faces.light.max()) == pytest.approx(SUN, rel=0.1)
    assert not any(LEFT_OUT in warning for warning in faces.warnings)


@pytest.mark.parametrize("mode", ["RGB", "CMYK", "L"])
def test_a_jpeg_whose_notes_name_a_gain_map_that_is_not_there_is_read_as_any_other(
    tmp_path: Path, mode: str
) -> None:
    PIL.Image.new(mode, (8, 8), 90).save(tmp_path / "plain.jpg")
    plain = (tmp_path / "plain.jpg").read_bytes()
    noted = jpeg(np.zeros((1, 1), np.uint8), "/>")
    size = int.from_bytes(noted[4:6], "big")
    (tmp_path / "noted.jpg").write_bytes(plain[:2] + noted[2 : 4 + size] + plain[2:])
    found, wanted = (read_image(tmp_path / f"{name}.jpg") for name in ("noted", "plain"))
    assert np.array_equal(found.values, wanted.values)
    assert (found.notes, found.color_notes) == (wanted.notes, wanted.color_notes)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("way", [b"\x00\x02abcd", b"\x00\x03\x00\x63\x00\x00", b"\x00\x63\x01\x01\x01\x01"])
def test_a_turn_that_no_number_tells_is_none(tmp_path: Path, way: bytes) -> None:
    """Of the type, count 4 or 1, and the value of EXIF."""
    count = (4 if way[1] == 2 else 1).to_bytes(4, "big")
    exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12" + way[:2] + count + way[2:] + bytes(4)
    before = b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif
    assert read_image(photograph(tmp_path / "photo.jpg", before)).notes == ()

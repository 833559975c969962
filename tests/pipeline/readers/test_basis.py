"""KTX2 pictures of Basis Universal, as glTF holds them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from paradize.errors import SourceError
from paradize.readers import basis
from paradize.readers.image import read_image
from paradize.readers.model import read_model
from tests.pipeline.readers.gltf.made import shown, square

pytest.importorskip("opengl_basisu", reason="opengl-basisu has no package for Linux on ARM")

Texel = tuple[int, int, int, int]
RED, GLASS = (250, 20, 10, 255), (10, 20, 250, 128)
_SOLID = 0x17  # the code of a block of one colour, five bits
_HEAD = 80  # bytes


def uastc(*colors: Texel, layers: int = 0, faces: int = 1) -> bytes:
    """A picture of 4 x 4 texels of each colour, side by side.

    Sources: Binomial, "UASTC Texture Specification", 2020; The Khronos Group, "Khronos Data Format
    Specification 1.3", 2019.
    """
    alpha = any(color[3] < 255 for color in colors)
    sample = struct.pack("<HBBIII", 0, 127, 3 if alpha else 0, 0, 0, 0xFFFFFFFF)
    block = struct.pack("<HHHH4B4B8B", 0, 0, 2, 40, 166, 1, 2, 0, 3, 3, 0, 0, 16, *bytes(7)) + sample
    descriptor = struct.pack("<I", 4 + len(block)) + block
    texels = b"".join(
        (_SOLID | int.from_bytes(bytes(color), "little") << 5).to_bytes(16, "little") for color in colors
    )
    start = _HEAD + 24 + len(descriptor)
    start += -start % 16
    size = len(texels) * faces * max(layers, 1)
    head = struct.pack("<9I", 0, 1, 4 * len(colors), 4, 0, layers, faces, 1, 0)
    index = struct.pack("<4I2Q", _HEAD + 24, len(descriptor), 0, 0, 0, 0)
    data = b"\xabKTX 20\xbb\r\n\x1a\n" + head + index + struct.pack("<3Q", start, size, size) + descriptor
    return data.ljust(start, b"\0") + texels * faces * max(layers, 1)


def test_it_has_the_colours_of_its_blocks(tmp_path: Path) -> None:
    path = tmp_path / "a.ktx2"
    for colors, channels in (((RED, RED), 3), ((RED, GLASS), 4)):
        path.write_bytes(uastc(*colors))
        image = read_image(path)
        assert image.values.shape == (4, 8, channels)
        for column, color in ((0, colors[0]), (7, colors[1])):
            assert image.values[2, column].tolist() == [*color[:channels]]
        assert (image.color_space, image.source_bits, image.top) == ("srgb", 8, 255)
    assert read_image(path, color_space="data").color_space == "data"


@pytest.mark.parametrize("beside", [True, False])
def test_gltf_shows_it(tmp_path: Path, beside: bool) -> None:
    made, primitive = square(TEXCOORD_0=np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32))
    data = uastc(RED)
    (tmp_path / "red.ktx2").write_bytes(data)
    where = {"uri": "red.ktx2"} if beside else {"bufferView": made.view(data), "mimeType": "image/ktx2"}
    texture = made.add("textures", extensions={"KHR_texture_basisu": {"source": made.add("images", **where)}})
    made.tree["extensionsUsed"] = made.tree["extensionsRequired"] = ["KHR_texture_basisu"]
    look = {"baseColorTexture": {"index": texture}}
    primitive["material"] = made.add("materials", pbrMetallicRoughness=look)
    model = read_model(shown(primitive, made).glb(tmp_path / "a.glb"))
    (material,) = model.materials.values()
    assert "color" in material.maps and not model.warnings


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (uastc(RED, layers=2), "several layers are not one picture"),
        (uastc(RED, faces=6), "the six faces of a cube map are not one picture"),
        (uastc(RED)[:-1], "is not a readable Basis Universal picture"),
        (uastc(RED)[:60], "is not a readable Basis Universal picture"),
        (uastc(RED)[:30], "is not a readable picture"),
        (uastc(RED).replace(struct.pack("<2I", 4, 4), struct.pack("<2I", 4, 40000), 1), "at most 32768"),
    ],
)
def test_others_are_refused_in_one_message(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "a.ktx2"
    path.write_bytes(data)
    with pytest.raises(SourceError, match=message) as refusal:
        read_image(path)
    assert "\n" not in str(refusal.value)


def test_without_the_library_one_message_says_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.ktx2"
    path.write_bytes(uastc(RED))
    monkeypatch.setattr(basis, "has_reader", lambda: False)
    with pytest.raises(SourceError, match=r"opengl-basisu, which decodes it, is not installed; npx .* PNG"):
        read_image(path)

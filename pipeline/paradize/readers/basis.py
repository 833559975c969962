"""Reads KTX2 textures of Basis Universal (ETC1S, UASTC), as KHR_texture_basisu puts them into glTF.

Other KTX2 textures are for a GPU, and no source of a bake. Source: The Khronos Group, "KTX File Format
Specification, Version 2.0", 2020.
"""

from __future__ import annotations

import struct
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError
from paradize.files import read_file
from paradize.readers.limits import require_size
from paradize.readers.notes import six_faces

if TYPE_CHECKING:
    from pathlib import Path

    from paradize.data import U8

_MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
HEAD_BYTES = 40
_PNG = "npx @gltf-transform/cli ktxdecompress IN.glb OUT.glb makes PNG of it"


def is_basis(head: bytes) -> bool:
    """Whether the file that begins with these HEAD_BYTES bytes is such a texture: its format is none of
    Vulkan's."""
    return head.startswith(_MAGIC) and head[12:16] == bytes(4)


def has_reader() -> bool:
    """Whether the library that decodes them is installed."""
    try:
        return bool(version("opengl-basisu"))
    except PackageNotFoundError:
        return False


def read_basis(path: Path, head: bytes, color_space: str | None) -> Image | None:
    """The largest level; None for a file that is no such texture. head: its first HEAD_BYTES bytes or more.

    Raises SourceError where it is damaged, beyond the limits, a volume, a cube map or an array, and where the
    library is missing. Its note of sRGB is not asked: glTF says by its use how a picture is coded.
    """
    if len(head) < HEAD_BYTES or not is_basis(head):
        return None
    if not has_reader():
        what = "is a Basis Universal picture, and opengl-basisu, which decodes it, is not installed"
        raise SourceError(what, file=path, mend=_PNG)
    width, height, depth, layers, faces = struct.unpack_from("<5I", head, 20)
    if faces == 6:
        raise six_faces(path)
    if depth > 1 or layers > 1:
        raise SourceError("several layers are not one picture", file=path, mend="save one layer")
    require_size(width, height, 4, path)
    import opengl_basisu  # here: not every machine has it

    try:
        texture = opengl_basisu.Texture(read_file(path))
        values = texture.transcode("rgba8").data
    except ValueError as error:
        what = f"is not a readable Basis Universal picture: {error}"
        raise SourceError(what, file=path, mend="export the model again") from None
    texels: U8 = np.ascontiguousarray(values if texture.has_alpha else values[:, :, :3], np.uint8)
    return Image(texels, color_space or "srgb", 8, 255)

"""Up to which mip triangles that show a point of a texture keep its colour, on textures made by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from paradize.build.materials.flat_colors import OFF, measure_flat
from paradize.build.trim import with_flat_colors
from paradize.data import Lod, Mesh, Texture
from paradize.formats.glb.encode import encode_glb
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.material import Wrap

SIDE = 8


def kept(
    key: str,
    fmt: str,
    levels: list[Any],
    *,
    u: float = 0.5 / SIDE,
    v: float = 0.5 / SIDE,
    down: bool = False,
    share: float = 1.0,
    wrap: tuple[Wrap, Wrap] | None = None,
) -> int:
    """The level up to which a triangle at (u, v) keeps its colour. share: its own, of a surface whose rest
    shows all of the texture. levels: codes of each, spread over its columns, or (down) over its rows."""
    area = [[0, 0, 0], [share, 0, 0], [0, 1, 0], [0, 0, 1], [1 - share, 0, 1], [0, 1, 1]]
    uvs = [[u, v]] * 3 + [[0, 0], [1, 0], [0, 1]]
    faces = [[0, 1, 2], [3, 4, 5]][: 1 if share == 1.0 else 2]
    mesh = Mesh(np.float32(area), np.array(faces, np.uint32), uvs=np.float32(uvs))
    if share == 1.0:
        mesh = Mesh(mesh.positions[:3], mesh.triangles, uvs=np.float32(uvs)[:3])
    sides = [SIDE >> k for k in range(4)]
    channels = {"R8_UNORM": 1, "RG8_SNORM": 2, "RGBA8_SRGB": 4}[fmt]
    planes = [np.zeros((side, side, channels), np.uint8) for side in sides]
    for plane, values in zip(planes, levels, strict=False):
        codes = np.array(values, np.uint8).reshape(1, -1, channels)
        plane[...] = codes.swapaxes(0, 1) if down else codes
    texture = Texture(fmt, SIDE, SIDE, tuple(plane.tobytes() for plane in planes))
    data = {key: encode_ktx2(texture)}
    glb = encode_glb((Lod(mesh, 0.0, 0.0),), "post")
    return measure_flat("post", glb, data, {key: len(levels) - 1}, wrap)[key]


def test_a_level_counts_while_its_colour_is_off_by_no_more_than_is_accepted() -> None:
    assert 7 / 255 < OFF < 9 / 255
    assert kept("height", "R8_UNORM", [[128], [135]]) == 1
    assert kept("height", "R8_UNORM", [[128], [137]]) == 0
    assert kept("height", "R8_UNORM", [[128], [128], [137]]) == 1
    assert kept("height", "R8_UNORM", [[128], [128], [128], [128]]) == 3


def test_dark_colours_count_as_the_eye_sees_them_and_normals_by_half_the_chord() -> None:
    assert kept("color", "RGBA8_SRGB", [[0, 0, 0, 255], [7, 0, 0, 255]]) == 0  # 0.002 of the light
    assert kept("color", "RGBA8_SRGB", [[200, 0, 0, 255], [207, 0, 0, 255]]) == 1
    assert kept("normal", "RG8_SNORM", [[0, 0], [0, 6]]) == 1
    assert kept("normal", "RG8_SNORM", [[0, 0], [0, 9]]) == 0


@pytest.mark.parametrize(("share", "level"), [(0.005, 1), (0.02, 0)])
def test_what_so_little_of_the_surface_shows_may_change(share: float, level: int) -> None:
    assert kept("height", "R8_UNORM", [[128], [255]], share=share) == level


def test_colours_are_read_between_texels_as_the_player_reads_them() -> None:
    middle = [[0, 0, 100, 0, 0, 0, 0, 0], [1, 133, 0, 0]]  # a quarter of 1 and three quarters of 133 are 100
    assert kept("height", "R8_UNORM", middle, u=2.5 / SIDE) == 1
    assert kept("height", "R8_UNORM", middle, v=2.5 / SIDE, down=True) == 1
    lower = [[0, 0, 0, 0, 0, 100, 0, 0], [0, 0, 137, 0]]  # three quarters of 137 are 103
    assert kept("height", "R8_UNORM", lower, v=5.5 / SIDE, down=True) == 1
    edge = [[100, 100, 0, 0, 0, 0, 0, 0], [100, 100, 100, 100]]
    assert kept("height", "R8_UNORM", edge, u=0.0) == 1
    assert (
        kept("height", "R8_UNORM", edge, u=0.0, wrap=("repeat", "clamp")) == 0
    )  # half of it lies on the other side
    beside = [[100, 100, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0]]
    for u, way, level in ((1.0, "clamp", 1), (1.0, "repeat", 0), (2.0, "mirror", 0), (1.0, "mirror", 1)):
        assert kept("height", "R8_UNORM", beside, u=u, wrap=(way, "clamp")) == level
    around = [[0, 0, 100, 100, 0, 0, 0, 0], [0, 100, 100, 60]]
    assert kept("height", "R8_UNORM", around, u=1.0 + 3.0 / SIDE) == 1  # maps go around whatever is asked


def test_what_flat_triangles_keep_is_never_less_than_all_ask_for_nor_more_than_the_others_do() -> None:
    others = {"level": 3, "view": "camera", "texels": 2.0}
    detail = {"level": 1, "view": "flight", "texels": 9.0, "others": others}
    assert with_flat_colors(detail, 3) == others and with_flat_colors(detail, 5) == others
    assert with_flat_colors(detail, 2) == {"level": 2, "view": "flight", "texels": 9.0}
    assert with_flat_colors(detail, 0) == {"level": 1, "view": "flight", "texels": 9.0}
    unseen = detail | {"others": others | {"view": None}}
    assert with_flat_colors(unseen, 5) == {"level": 3, "view": "flight", "texels": 9.0}

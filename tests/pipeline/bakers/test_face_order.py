"""Six pictures that do not meet as the faces of a cube map are told, with the order in which they do."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.bakers.cubemap import bake_cubemap
from paradize.errors import SourceError
from paradize.stages.cubemap import directions
from paradize.stages.face_order import better_order
from tests.pipeline.heights import save

F32 = npt.NDArray[np.float32]
NAMES = ("rt", "lf", "up", "dn", "ft", "bk")


def sky(side: int = 16) -> list[F32]:
    """Faces of a sky that looks different everywhere, and meets at the edges."""
    s, t = np.meshgrid(*[(np.arange(side) + 0.5) * (2.0 / side) - 1.0] * 2)
    ways = [directions(face, s, t) for face in range(6)]
    units = [way / np.sqrt((way * way).sum(axis=2, keepdims=True)) for way in ways]
    return [(1.0 + way * (0.3, 0.6, 0.8) + 0.3 * way[..., ::-1]).astype(np.float32) for way in units]


def saved(folder: Path, faces: list[F32]) -> list[Path]:
    texels = [np.ascontiguousarray(face) for face in faces]
    return [save(folder / f"{name}.exr", face, oiio.FLOAT) for name, face in zip(NAMES, texels, strict=True)]


def test_faces_that_meet_are_not_told(tmp_path: Path) -> None:
    assert bake_cubemap(saved(tmp_path, sky())).warnings == []


@pytest.mark.parametrize("order", [(0, 5, 1, 4, 2, 3), (0, 1, 2, 3, 5, 4), (4, 5, 2, 3, 0, 1)])
def test_faces_in_a_wrong_order_are_told_with_the_right_one(order: tuple[int, ...], tmp_path: Path) -> None:
    paths = saved(tmp_path, sky())
    (told,) = bake_cubemap([paths[face] for face in order]).warnings
    names = told.partition("would meet in the order ")[2].split(", ")
    assert names == [path.name for path in paths]
    assert bake_cubemap([tmp_path / name for name in names]).warnings == []


def test_faces_that_are_turned_are_told_with_the_turn(tmp_path: Path) -> None:
    faces = sky()
    faces[2] = np.rot90(faces[2])
    (told,) = bake_cubemap(saved(tmp_path, faces)).warnings
    assert told.endswith("and turn clockwise, in degrees: up.exr by 90")
    faces[2] = np.rot90(faces[2], -1)
    assert bake_cubemap(saved(tmp_path, faces)).warnings == []


def test_faces_that_meet_in_no_order_are_left_alone(tmp_path: Path) -> None:
    noise = np.random.default_rng(5).random((6, 16, 16, 3)).astype(np.float32)
    assert bake_cubemap(saved(tmp_path, list(noise))).warnings == []


def test_seams_that_nobody_sees_are_left_alone(tmp_path: Path) -> None:
    faint = [1.0 + 0.01 * face for face in sky()]
    assert bake_cubemap(saved(tmp_path, [*faint[3:], *faint[:3]])).warnings == []


def test_light_below_zero_counts_as_none() -> None:
    faces = np.stack(sky())
    faces[1, 0, 3] = -5.0
    assert better_order(faces[[1, 0, 2, 3, 4, 5]]) == ((1, 0, 2, 3, 4, 5), (0,) * 6)


def test_a_sky_of_one_colour_is_told(tmp_path: Path) -> None:
    black = np.zeros((16, 16, 3), np.float32)
    (told,) = bake_cubemap(saved(tmp_path, [black] * 6)).warnings
    assert "the whole sky is of one colour" in told
    assert bake_cubemap(saved(tmp_path, [*[black] * 5, black + 1.0])).warnings == []


@pytest.mark.parametrize(
    ("sides", "says"),
    [
        ((12, 12), "12 x 12 texels; the side of a face is a power of two; resize all six to 16 x 16"),
        ((8, 8), "8 x 8 texels, and the first face has 16 x 16; all six are of one size; resize it to 16"),
        ((8, 16), '16 x 8 texels; the faces of a cube map are square; of a panorama write faces = ["pan'),
    ],
)
def test_a_face_of_a_wrong_size_is_refused_with_the_size(
    sides: tuple[int, int], says: str, tmp_path: Path
) -> None:
    faces = saved(tmp_path, sky())
    odd = save(tmp_path / "odd.exr", np.ones((*sides, 3), np.float32), oiio.FLOAT)
    with pytest.raises(SourceError, match=re.escape(says)):
        bake_cubemap([*faces[:5], odd])


@pytest.mark.parametrize(
    ("sides", "says"),
    [
        ((6, 8), "this looks like a cross of six faces; cut these out, and write them as six files"),
        ((8, 6), "this looks like a cross of six faces; cut these out, and write them as six files"),
        ((12, 2), "this looks like a row of six faces; cut these out, and write them as six files"),
        ((2, 12), "this looks like a row of six faces; cut these out, and write them as six files"),
        ((6, 10), "if it shows all directions, resize it to 10 x 5; else write the six faces of a cube map"),
    ],
)
def test_what_is_no_panorama_is_refused_as_what_it_is(
    sides: tuple[int, int], says: str, tmp_path: Path
) -> None:
    picture = save(tmp_path / "sky.exr", np.ones((*sides, 3), np.float32), oiio.FLOAT)
    with pytest.raises(SourceError, match=re.escape(says)):
        bake_cubemap([picture])

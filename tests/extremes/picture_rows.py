"""Rows of the stages of pictures: luminance, colour mips, cube maps, blocks; held to numpy's float64."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Image, Texture
from paradize.kernels.maps import Levels
from paradize.metrics.texels import decode_texels
from paradize.stages.compress import LevelWriter, encode_rows
from paradize.stages.cubemap import cube_mips, cut_faces, encode_cube
from paradize.stages.face_order import FaceOrder, better_order
from paradize.stages.height import height_from_color
from paradize.stages.mips import color_rows
from tests.extremes.planes import EVEN_SKIES, HEIGHTS, NO_SIDES, pictures, read_picture, unit_of
from tests.extremes.table import EXTREMES, Row
from tests.pipeline import map_truth as truth

F32 = npt.NDArray[np.float32]
LEVELS = Levels(black=0.1, white=0.9, gamma=1.5, contrast=1.25, brightness=0.05)
NOT_READ = {"nan": "maps need finite numbers", "inf": "maps need finite numbers"}


def _height(picture: F32) -> F32:
    read_picture(picture)
    return height_from_color(Image(picture, "srgb", 32), LEVELS)


def _height_error(picture: F32, made: F32) -> float:
    wide = picture.astype(np.float64)
    bright = np.abs(wide)
    light = np.where(bright <= 0.04045, bright / 12.92, ((bright + 0.055) / 1.055) ** 2.4) * np.sign(wide)
    y = light @ [0.2126, 0.7152, 0.0722]
    t = np.clip((y - 0.1) / 0.8, 0, 1) ** (1 / 1.5)
    return float(np.abs(made - np.clip((t - 0.5) * 1.25 + 0.55, 0, 1)).max())


def _colors(picture: F32) -> list[np.ndarray]:
    read_picture(picture)
    found: list[dict[int, np.ndarray]] = [{} for _ in range(max(picture.shape[:2]).bit_length())]

    def keep(level: int, first: int, codes: np.ndarray) -> None:
        found[level][first] = codes.copy()

    color_rows(picture, keep, encoded=True)
    return [np.concatenate([bands[first] for first in sorted(bands)]) for bands in found]


def _color_error(picture: F32, made: list[np.ndarray]) -> float:
    """Codes from the float64 mean of means of linear light, encoded."""
    light, worst = truth.decode_srgb(np.clip(picture.astype(np.float64), 0, 1)), 0.0
    for level, found in enumerate(made):
        light = truth.mean(light, 1) if level else light
        worst = max(worst, float(np.abs(found[:, :, :3] - 255 * truth.encode_srgb(light)).max()))
    return worst


def _planes_to_cube(name: str, side: int) -> F32:
    plane = np.resize(HEIGHTS[name](), (side, side)) if name != "zero" else np.zeros((0, 0), np.float32)
    if name in ("nan", "inf"):
        plane[3, 5] = float(name)
    faces = [np.stack([np.roll(plane, 3 * face + c) for c in range(3)], axis=2) for face in range(6)]
    return np.ascontiguousarray(np.stack(faces))


def _cube_inputs() -> dict[str, Any]:
    sides = {"one": 1, "many": 64, "largest": 256}
    names = [name for name in HEIGHTS if name != "sliver"]
    return {name: lambda n=name: _planes_to_cube(n, sides.get(n, 16)) for name in names}


def _cube(faces: F32) -> tuple[list[F32], Texture]:
    for face in faces:
        read_picture(face)
    levels = cube_mips(faces)
    return levels, encode_cube(levels)


def _face_places(face: int, s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """OpenGL 3.3, table 3.21: the direction of (s, t), each -1 to 1, on a face."""
    one = np.ones_like(s)
    return np.stack(
        [
            (one, -t, -s),
            (-one, -t, s),
            (s, one, t),
            (s, -one, -t),
            (s, -t, one),
            (-s, -t, -one),
        ][face],
        axis=-1,
    )


def _looked_up(faces: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """The texel that each direction (n, 3) meets, by trying every face."""
    size = faces.shape[1]
    out = np.zeros((len(direction), faces.shape[3]))
    major = np.abs(direction).argmax(axis=1)
    rows = np.arange(len(direction))
    found = 2 * major + (direction[rows, major] < 0)
    basis = [_face_places(face, *np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])) for face in range(6)]
    for face, (origin, at_s, at_t) in enumerate(basis):
        part = direction[found == face]
        part = part / np.abs(part).max(axis=1, keepdims=True)
        s, t = part @ (at_s - origin), part @ (at_t - origin)
        column, row = (np.clip(((k + 1) / 2 * size).astype(int), 0, size - 1) for k in (s, t))
        out[found == face] = faces[face, row, column]
    return out


def _cube_error(faces: F32, made: tuple[list[F32], Texture]) -> float:
    """Each coarse texel from the 16 finer ones about it, found by their directions, in float64, of the
    largest; and half floats within a 2048th of what they hold."""
    levels, texture = made
    worst = 0.0
    for fine, coarse in pairwise(levels):
        if fine.shape[1] > 64:
            continue
        size, half = fine.shape[1], coarse.shape[1]
        row, column, j, i = (k.ravel() for k in np.indices((half, half, 4, 4)))
        s, t = ((2 * at + k - 1 + 0.5) * 2 / size - 1 for at, k in ((column, i), (row, j)))
        # Texels beyond an edge count as much as the edge's own texels there.
        near = [np.minimum(np.abs(k), 1.0) for k in (s, t)]
        weight = np.array([1, 3, 3, 1])[i] * np.array([1, 3, 3, 1])[j]
        weight = (weight / (1 + near[0] ** 2 + near[1] ** 2) ** 1.5).reshape(half, half, 16, 1)
        for face in range(6):
            texels = _looked_up(fine.astype(np.float64), _face_places(face, s, t)).reshape(half, half, 16, -1)
            wanted = (texels * weight).sum(axis=2) / weight.sum(axis=2)
            worst = max(worst, float(np.abs(coarse[face] - wanted).max()))
    halves = np.frombuffer(texture.levels[0], np.float16).reshape(*faces.shape[:3], 4)[..., :3]
    held = np.clip(faces.astype(np.float64), -65504, 65504)
    rounding = np.abs(halves - held) / np.maximum(np.abs(held), 2.0**-14)
    return max(worst / max(unit_of(faces), np.finfo(np.float32).tiny), float(rounding.max()) - 2.0**-11, 0.0)


def _cut(light: F32) -> F32:
    read_picture(light)
    return cut_faces(light)


def _encoded(fmt: str) -> Any:
    def run(picture: F32) -> Texture:
        read_picture(picture)
        rows = picture
        if fmt.endswith("SRGB"):
            alpha = np.full((*picture.shape[:2], 1), 255)
            codes = np.rint(np.clip(picture, 0, 1) * 255)
            rows = np.concatenate([codes, alpha], axis=2).astype(np.uint8)
        elif picture.shape[2] > 2:
            rows = np.ascontiguousarray(picture[:, :, :2])
        writer = LevelWriter(fmt, *picture.shape[:2], 1)
        writer.put(0, 0, encode_rows(rows, fmt, threads=2))
        return writer.texture()

    return run


def _encoding_error(picture: F32, made: Texture) -> float:
    """The root mean square of what the texture's own reader finds, against what was to be stored."""
    found = decode_texels(made).astype(np.float64)
    channels = min(found.shape[2], picture.shape[2])
    low = -1.0 if made.format.endswith("SNORM") else 0.0
    wanted = np.clip(picture.astype(np.float64), low, 1.0)[:, :, :channels]
    return float(np.sqrt(((found[:, :, :channels] - wanted) ** 2).mean()))


def _order(faces: F32) -> FaceOrder | None:
    for face in faces:
        read_picture(face)
    return better_order(faces)


def _seam(faces: list[np.ndarray]) -> float:
    """The mean difference of the square root of the light where two faces meet, found by the places of their
    outermost texels on the cube's edges."""
    size = len(faces[0])
    middles, ends = (np.arange(size) + 0.5) * 2 / size - 1, np.ones(size)
    sides = (
        (middles, -ends, np.s_[0, :]),
        (middles, ends, np.s_[-1, :]),
        (-ends, middles, np.s_[:, 0]),
        (ends, middles, np.s_[:, -1]),
    )
    met: dict[tuple[float, ...], list[float]] = {}
    for face, light in enumerate(faces):
        bright = np.sqrt(light.astype(np.float64).clip(0).mean(axis=2))
        for s, t, side in sides:
            for place, value in zip(_face_places(face, s, t).tolist(), bright[side], strict=True):
                met.setdefault(tuple(np.round(place, 6)), []).append(float(value))
    return float(np.mean([abs(first - second) for first, second in met.values()]))


def _order_error(faces: F32, made: FaceOrder | None) -> float:
    if made is None:
        return 1.0
    turned = [np.rot90(faces[face], -turns) for face, turns in zip(made.faces, made.turns, strict=True)]
    return _seam(turned) / _seam(list(faces))


def _mixed_up(light: float, side: int = 16) -> F32:
    """A sky that looks different everywhere, of about this light, with three faces in wrong places, one of
    them turned."""
    s, t = np.meshgrid(*[(np.arange(side) + 0.5) * 2 / side - 1] * 2)
    ways = [_face_places(face, s, t) for face in (4, 1, 0, 3, 2, 5)]
    units = [way / np.sqrt((way**2).sum(axis=2, keepdims=True)) for way in ways]
    faces = np.stack([light * (1 + unit * (0.3, 0.6, 0.8) + 0.3 * unit[:, :, ::-1]) for unit in units])
    faces[2] = np.rot90(faces[2])
    return np.ascontiguousarray(faces, np.float32)


MIXED_UP: dict[str, Any] = {
    "many": lambda: _mixed_up(1.0, 64),
    "tiny": lambda: _mixed_up(1e-30),
    "huge": lambda: _mixed_up(1e30),
    "denormal": lambda: _mixed_up(1e-41),
    "largest": lambda: _mixed_up(1.0, 256),
}
UNREADABLE = {name: make for name, make in _cube_inputs().items() if name in NOT_READ}
PICTURES = pictures(3)
ROWS = [
    Row(
        "stages.height",
        PICTURES,
        _height,
        _height_error,
        "of 1",
        2e-6,
        refused=NOT_READ | {"zero": "shape (0, 0", "huge": "no linear light in float32"},
    ),
    Row(
        "stages.mips",
        PICTURES,
        _colors,
        _color_error,
        "codes",
        0.501,
        part="colour",
        refused=NOT_READ | {"zero": "no levels of 0 x 0 texels"},
    ),
    Row(
        "stages.cubemap",
        _cube_inputs(),
        _cube,
        _cube_error,
        "of the largest",
        1e-6,
        absent={"sliver": "faces are square"},
        refused=NOT_READ | {"zero": "a cube map"},
    ),
    Row(
        "stages.cubemap",
        EVEN_SKIES,
        _cut,
        lambda light, made: np.abs(made.astype(np.float64) / light[0, 0, 0] - 1).max(),
        "of the light",
        1e-6,
        part="panorama",
        absent=NO_SIDES,
        refused={"zero": "no panorama", "nan": "need finite numbers", "inf": "need finite numbers"},
    ),
    Row(
        "stages.face_order",
        MIXED_UP | UNREADABLE,
        _order,
        _order_error,
        "of the seams as given",
        0.4,
        absent=dict.fromkeys(
            EXTREMES.keys() - MIXED_UP.keys() - NOT_READ.keys(), "no sky that meets in one order alone"
        ),
        refused=NOT_READ,
    ),
    *[
        Row(
            "stages.compress",
            PICTURES,
            _encoded(fmt),
            _encoding_error,
            "of 1, RMS",
            limit,
            part=fmt,
            refused=NOT_READ | {"zero": "a texture of 0 x 0 texels"},
        )
        for fmt, limit in (
            ("BC1_RGB_SRGB", 0.15),
            ("BC7_SRGB", 0.03),
            ("BC5_SNORM", 0.02),
            ("BC5_UNORM", 0.02),
            ("RG8_SNORM", 0.004),
            ("RG16_UNORM", 1e-5),
        )
    ],
]

"""Bakes six pictures, or a panorama, into a cube map with mips and its measured error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.bakers.product import MapProduct
from paradize.data import Texture
from paradize.errors import SourceError
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.kernels.maps import linear_light
from paradize.metrics.panorama import panorama_errors
from paradize.metrics.source import sky_error
from paradize.readers.image import read_image
from paradize.scene.baker_settings import CubemapSettings
from paradize.stages import cubemap, face_order

F32 = npt.NDArray[np.float32]
Values = npt.NDArray[Any]


@dataclass(frozen=True)
class Faces:
    """The six faces of a sky. light: (6, n, n, 3) linear. pictures: the values of each, and whether they are
    sRGB. panorama: the same of the picture that they were cut out of, if one was given."""

    light: F32
    pictures: list[tuple[Values, bool]]
    panorama: tuple[Values, bool] | None
    warnings: list[str]

    def errors(self, texture: Texture) -> dict[str, float]:
        """The largest error of level 0, relative to a texel's brightest channel: against the pictures, and of
        sampled texels against the panorama."""
        found = {"sky_max_relative": sky_error(texture, self.pictures)}
        if self.panorama:
            values, encoded = self.panorama
            found |= panorama_errors(texture, values, encoded=encoded)
        return found


def bake_cubemap(paths: Sequence[Path], settings: CubemapSettings | None = None) -> MapProduct:
    """A half-float cube map with mips of six square pictures of one size, a power of two, +X -X +Y -Y +Z -Z,
    or of one panorama, twice as wide as high, with north (-Z) in its middle and east (+X) to the right of it.

    sRGB pictures are linearised. settings: None: as they are by themselves.
    Raises SourceError.
    """
    faces = read_faces(paths)
    texture = cubemap.encode_cube(cubemap.cube_mips(faces.light))
    size = texture.width
    data = encode_ktx2(texture, zstd_level=(settings or CubemapSettings()).zstd)
    errors = faces.errors(texture)
    return MapProduct(
        data=data,
        width=size,
        height=size,
        format=texture.format,
        error=errors["sky_max_relative"],
        metric="sky_max_relative",
        tier="balanced",
        errors=errors,
        warnings=faces.warnings,
    )


def read_faces(paths: Sequence[Path]) -> Faces:
    """Raises as bake_cubemap."""
    if len(paths) not in (1, 6):
        raise SourceError(f"a cube map has six faces, or one panorama, not {len(paths)}")
    light: list[F32] = []
    pictures: list[tuple[Values, bool]] = []
    warnings: list[str] = []
    notes: dict[str, list[Path]] = {}
    for path in paths:
        image = read_image(path, light=True)
        rows, columns, channels = image.values.shape
        if len(paths) == 1:
            _require_panorama(path, rows, columns)
        else:
            _require_face(path, rows, columns, light[0].shape[0] if light else rows)
        pictures.append((image.values, image.color_space == "srgb"))
        pixels = linear_light(image.values, encoded=pictures[-1][1])
        coarse = ("8 bits per channel: a sky shows bands",) if image.source_bits == 8 else ()
        for note in (*image.notes, *image.color_notes, *coarse):
            notes.setdefault(note, []).append(path)
        if float(pixels.max()) > cubemap.HALF_MAX:
            warnings.append(f"{path}: brighter than {cubemap.HALF_MAX:g}, which half floats end at")
        light.append(np.repeat(pixels[:, :, :1], 3, axis=2) if channels < 3 else pixels[:, :, :3])
    for note, (first, *others) in notes.items():
        warnings.append(f"{first}: {note}{f' ({len(others)} more faces too)' if others else ''}")
    if all((pixels == light[0][0, 0]).all() for pixels in light):
        warnings.append(f"{paths[0]}: the whole sky is of one colour; if it should show more, save it again")
    if len(paths) == 6:
        faces = np.stack(light)
        return Faces(faces, pictures, None, [*warnings, *_other_order(paths, faces)])
    faces = cubemap.cut_faces(light[0])
    return Faces(faces, [(face, False) for face in faces], pictures[0], warnings)


def _other_order(paths: Sequence[Path], faces: F32) -> list[str]:
    """A warning where the faces would meet far better in another order, or turned."""
    better = face_order.better_order(faces)
    if better is None:
        return []
    names = [paths[face].name for face in better.faces]
    turned = [f"{name} by {90 * turns}" for name, turns in zip(names, better.turns, strict=True) if turns]
    turn = f", and turn clockwise, in degrees: {', '.join(turned)}" if turned else ""
    what = "the faces do not meet along their edges, as if in a wrong order"
    return [f"{paths[0]}: {what}; they would meet in the order {', '.join(names)}{turn}"]


def _require_face(path: Path, rows: int, columns: int, size: int) -> None:
    if rows != columns:
        what = f"{columns} x {rows} texels; the faces of a cube map are square"
        raise SourceError(what, file=path, mend='of a panorama write faces = ["panorama.exr"]')
    if rows & (rows - 1):
        fit = 2 ** round(math.log2(rows))
        what = f"{columns} x {rows} texels; the side of a face is a power of two"
        raise SourceError(what, file=path, mend=f"resize all six to {fit} x {fit}")
    if rows != size:
        what = f"{columns} x {rows} texels, and the first face has {size} x {size}; all six are of one size"
        raise SourceError(what, file=path, mend=f"resize it to {size} x {size}")


def _require_panorama(path: Path, rows: int, columns: int) -> None:
    if columns == 2 * rows:
        return
    what = f"{columns} x {rows} texels; a panorama of all directions is twice as wide as high"
    shapes = {(4, 3): "cross", (3, 4): "cross", (6, 1): "row", (1, 6): "row"}
    part = math.gcd(columns, rows)
    shape = shapes.get((columns // part, rows // part))
    fit = f"if it shows all directions, resize it to {columns} x {columns // 2}"
    mend = f"{fit}; else write the six faces of a cube map"
    if shape:
        what = f"{what}, and this looks like a {shape} of six faces"
        mend = "cut these out, and write them as six files"
    raise SourceError(what, file=path, mend=mend)

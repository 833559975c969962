"""Bakes six pictures into a cube map with mips and its measured error."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.bakers.product import MapProduct
from paradize.errors import SourceError
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.kernels.maps import linear_light
from paradize.metrics.source import sky_error
from paradize.readers.image import read_image
from paradize.scene.baker_settings import CubemapSettings
from paradize.stages import cubemap

F32 = npt.NDArray[np.float32]
Values = npt.NDArray[Any]


def bake_cubemap(paths: Sequence[Path], settings: CubemapSettings | None = None) -> MapProduct:
    """Six square pictures of one size, a power of two, +X -X +Y -Y +Z -Z, as a half-float cube map with mips.

    sRGB pictures are linearised. The error is the largest of any channel, relative to the texel's brightest.
    settings: None: as they are by themselves.
    Raises SourceError.
    """
    stack, pictures, warnings = read_faces(paths)
    texture = cubemap.encode_cube(cubemap.cube_mips(stack))
    error = sky_error(texture, pictures)
    size = stack.shape[1]
    data = encode_ktx2(texture, zstd_level=(settings or CubemapSettings()).zstd)
    return MapProduct(
        data=data,
        width=size,
        height=size,
        format=texture.format,
        error=error,
        metric="sky_max_relative",
        tier="balanced",
        errors={"sky_max_relative": error},
        warnings=warnings,
    )


def read_faces(paths: Sequence[Path]) -> tuple[F32, list[tuple[Values, bool]], list[str]]:
    """Linear light (6, n, n, 3) of six pictures, what their files hold, with whether that is sRGB, and
    warnings. Raises as bake_cubemap."""
    if len(paths) != 6:
        raise SourceError(f"a cube map has six faces, not {len(paths)}")
    faces: list[F32] = []
    pictures: list[tuple[Values, bool]] = []
    warnings: list[str] = []
    notes: dict[str, list[Path]] = {}
    for path in paths:
        image = read_image(path)
        rows, columns, channels = image.values.shape
        size = faces[0].shape[0] if faces else rows
        if rows != columns or rows & (rows - 1) or rows != size:
            what = f"{columns} x {rows} texels; faces are square, powers of two, and of one size ({size})"
            raise SourceError(what, file=path, mend="resize it; cut a panorama into six such faces")
        pictures.append((image.values, image.color_space == "srgb"))
        pixels = linear_light(image.values, encoded=pictures[-1][1])
        coarse = ("8 bits per channel: a sky shows bands",) if image.source_bits == 8 else ()
        for note in (*image.notes, *image.color_notes, *coarse):
            notes.setdefault(note, []).append(path)
        if float(pixels.max()) > cubemap.HALF_MAX:
            warnings.append(f"{path}: brighter than {cubemap.HALF_MAX:g}, which half floats end at")
        faces.append(np.repeat(pixels[:, :, :1], 3, axis=2) if channels < 3 else pixels[:, :, :3])
    for note, (first, *others) in notes.items():
        warnings.append(f"{first}: {note}{f' ({len(others)} more faces too)' if others else ''}")
    return np.stack(faces), pictures, warnings

"""Draws the pictures of colour and metalness of a material whose file has one of what is reflected instead
(material.Material.reflected)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.build.materials.model_pictures import read_picture
from paradize.formats.png import encode_png
from paradize.kernels.maps import linear_light
from paradize.kernels.math import srgb_to_linear
from paradize.material import REPEATED, MapSource, Material, Picture
from paradize.readers.metal import metal_of
from paradize.stages.resample import resized

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    Values = npt.NDArray[Any]

_LEAST = 0.1  # metalness: pictures of wood and paint reach it nowhere
_ROWS = 64


def with_metal_pictures(material: Material) -> Material:
    """The material with such pictures as bytes (material.Picture.data); where nothing reflects as a metal, as
    it is but without `reflected`. A picture without alpha is smooth, as glTF says.

    Raises SourceError for a picture that cannot be read.
    """
    if material.reflected is None:
        return material
    plain = replace(material, reflected=None)
    reflected, color = material.reflected.source, material.maps.get("color")
    specular, has_alpha = _colors(reflected)
    if not has_alpha:
        maps = {role: source for role, source in material.maps.items() if role != "smoothness"}
        plain = replace(plain, maps=maps, roughness=1.0 - material.smoothness)
    diffuse = np.full((1, 1, 3), 255, np.uint8) if color is None else _colors(color)[0]
    rows, columns = (max(a, b) for a, b in zip(specular.shape[:2], diffuse.shape[:2], strict=True))
    across, down = (way == "repeat" for way in reflected.wrap or REPEATED)
    specular, diffuse = (
        of if of.shape[:2] == (rows, columns) else resized(_light(of), rows, columns, (across, down))
        for of in (specular, diffuse)
    )
    thresholds = srgb_to_linear((np.arange(255) + 0.5) / 255.0)
    colors = np.empty((rows, columns, 3), np.uint8)
    metal = np.empty((rows, columns, 1), np.uint8)
    for first in range(0, rows, _ROWS):
        part = slice(first, first + _ROWS)
        light, share = metal_of(
            _light(diffuse[part]) * material.color, _light(specular[part]) * material.reflected.color
        )
        colors[part] = np.searchsorted(thresholds, light)
        metal[part, :, 0] = np.rint(255.0 * share)
    if metal.max() < 255.0 * _LEAST:
        return plain
    shown, shiny = (_drawn(codes, reflected.picture) for codes in (colors, metal))
    maps = {
        "color": replace(color or reflected, picture=shown, channel="rgb", srgb=True),
        "metalness": replace(reflected, picture=shiny, channel="r", srgb=False),
    }
    return replace(plain, color=(1.0, 1.0, 1.0), metalness=1.0, maps=plain.maps | maps)


def _drawn(codes: npt.NDArray[np.uint8], of: Picture) -> Picture:
    return replace(of, data=encode_png(codes))


def _colors(source: MapSource) -> tuple[Values, bool]:
    """The colours (h, w, 3) of a picture, and whether it has alpha."""
    values = read_picture(source.picture, "srgb").values
    channels = values.shape[2]
    colors = values[:, :, :3] if channels >= 3 else values[:, :, [0, 0, 0]]
    return np.ascontiguousarray(colors), channels in (2, 4)


def _light(colors: Values) -> F32:
    """The linear light of integers that are sRGB, 0..1; floats are light."""
    if colors.dtype == np.float32:
        return colors.clip(0.0, 1.0)
    return linear_light(colors, encoded=True)

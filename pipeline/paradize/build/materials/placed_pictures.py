"""Draws the pictures of maps anew that lie on a material's texture coordinates in another way than its other
maps (material.MapSource.placed)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.build.materials.model_pictures import read_picture
from paradize.errors import SourceError
from paradize.formats.png import encode_png
from paradize.material import REPEATED, MapSource, Material, Picture, Placed, Wrap
from paradize.stages.resample import placed

if TYPE_CHECKING:
    import numpy.typing as npt

MOST_TEXELS = 8192  # a side
_BLOCK = 4  # texels: sides of blocks


def with_placed_pictures(material: Material) -> Material:
    """The material with the pictures of such maps as bytes (material.Picture.data), for its coordinates.
    Raises SourceError for a picture that cannot be read, or that no PNG can hold."""
    if not any(source.placed for source in material.maps.values()):
        return material
    leading = material.leading
    maps = {role: _drawn(source, leading) for role, source in material.maps.items()}
    return replace(material, maps=maps)


def _drawn(source: MapSource, leading: MapSource | None) -> MapSource:
    if source.placed is None:
        return source
    data = _png(source.picture, source.placed, source.wrap or REPEATED)
    wrap = leading.wrap if leading else None
    return replace(source, picture=replace(source.picture, data=data), placed=None, wrap=wrap)


def _png(picture: Picture, on: Placed, wrap: tuple[Wrap, Wrap]) -> bytes:
    image = read_picture(picture, "data")
    values: npt.NDArray[np.generic] = image.values
    if values.shape[2] == 2:  # grey with alpha, as PNG is written here
        values = values[:, :, [0, 0, 0, 1]]
    top = 1.0
    if image.values.dtype == np.float32:
        low, high = float(image.values.min()), float(image.values.max())
        if low < 0.0 or high > 1.0:
            what = f"holds {low:g} to {high:g}, and lies on the surface in another way than the colour"
            raise SourceError(
                what, file=picture.file, mend="save it with 16 bits, or draw it in the colour's layout"
            )
    else:
        top = 255.0 if image.values.dtype == np.uint8 else 65535.0
    rows, columns = (_side(values.shape[1 - axis], on[axis][0]) for axis in (1, 0))
    drawn = placed(values.astype(np.float32) / np.float32(top), rows, columns, on, wrap)
    deep = top != 255.0
    codes = np.rint(np.clip(drawn, 0.0, 1.0) * (65535.0 if deep else 255.0))
    return encode_png(codes.astype(np.uint16 if deep else np.uint8))


def _side(texels: int, tiles: float) -> int:
    """How many texels keep those of the picture, `tiles` times beside each other."""
    exact = texels * abs(tiles)
    whole = round(exact) if abs(exact - round(exact)) < 1e-6 else -(-int(np.ceil(exact)) // _BLOCK) * _BLOCK
    return max(1, min(int(whole), MOST_TEXELS))

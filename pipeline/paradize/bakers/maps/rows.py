"""Makes any rows of the maps of one picture: heights, normals and gloss at level 0, and their means."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from paradize.map_table import MAPS
from paradize.metrics.levels import encoding_error, filter_error, open_error
from paradize.metrics.source import true_gloss
from paradize.stages import gutter
from paradize.stages.filters import FAST_FILTER, REFERENCE_FILTER
from paradize.stages.gloss import GlossSettings, gloss_map
from paradize.stages.height import luminance_plane
from paradize.stages.mips import gloss_bundle
from paradize.stages.normal import normal_rows
from paradize.stages.sweep import bands_of

if TYPE_CHECKING:
    from paradize.data import HeightMap, Image, Texture
    from paradize.stages.sweep import Bundle

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Layout:
    """The UV islands of a map. islands: (h, w) int32, the island's number; -1 outside, or if `filled`, -2 -
    flat index of the texel that the gutter copies (stages.gutter.with_source). mask: the texels that shine;
    None: all."""

    islands: I32
    filled: bool
    mask: npt.NDArray[np.bool_] | None

    def source(self, first: int, last: int) -> I32:
        """Returns the flat indices (n, w) of the texels that these rows copy."""
        return gutter.source_rows(self.islands, first, last)


def filter_errors(height_map: HeightMap) -> dict[str, float]:
    """Returns the angles between the filter's normals and the true ones, degrees: the error of the filter
    alone."""
    return _parts("normal_filter", filter_error(height_map))


def no_worse_than_fast(height_map: HeightMap) -> HeightMap:
    """Returns the height map with a filter that is no worse than tier `fast`'s by any of filter_errors.

    This is the filter that `auto` chose, if its measured errors allow it. Otherwise the map gets the slopes
    of tier `exact`: for 8- and 16-bit heights limited to what their rounding leaves open, for floats those of
    the reference filter. `auto` predicts errors from a spectrum, which says little about small maps and UV
    islands.
    """
    if height_map.filter_name in (FAST_FILTER, REFERENCE_FILTER):
        return height_map
    own, fast = (
        filter_errors(height_map),
        filter_errors(replace(height_map, filter_name=FAST_FILTER, clamp_slopes=False)),
    )
    if all(own[name] <= fast[name] for name in own):
        return height_map
    return (
        replace(height_map, filter_name=REFERENCE_FILTER)
        if height_map.height_levels is None
        else replace(height_map, clamp_slopes=True)
    )


def open_angles(height_map: HeightMap) -> dict[str, float]:
    """Returns the angles that the half steps of the source leave open, degrees. Errors count only beyond."""
    return _parts("normal_open", open_error(height_map))


def encoding_errors(shown: Texture | F32, height_map: HeightMap) -> dict[str, float]:
    """Returns the error of storing level 0 of a normal map: a texture, or decoded x and y (h, w, 2)."""
    return _parts("normal_encoding", encoding_error(shown, height_map))


def _parts(name: str, found: dict[str, float]) -> dict[str, float]:
    return {
        f"{name}_deg": found["mean_deg"],
        f"{name}_p99_deg": found["p99_deg"],
        f"{name}_max_deg": found["max_deg"],
    }


class MapRows:
    """Rows of every map of a picture, level 0.

    names: the maps that will be requested. unit: (low, span) of the heights that become 0..1 in the height
    map. picture: the source of brightness; None: the heights. truth: the brightness that metrics compare
    with. If there is a UV layout, gutters are filled. For that only the normals along the borders of islands
    are kept in memory, beside the heights.
    """

    def __init__(
        self,
        height_map: HeightMap,
        names: tuple[str, ...],
        unit: tuple[float, float],
        picture: Image | None,
        gloss: GlossSettings,
        layout: Layout | None,
        truth: F32 | None = None,
    ) -> None:
        self.height_map, self.names = height_map, names
        self._unit, self._picture, self._gloss, self._layout = unit, picture, gloss, layout
        self._truth = truth
        self._border: gutter.Border | None = None
        if layout is not None and layout.filled and names != ("height",):
            self._border = gutter.Border(layout.islands, partial(normal_rows, height_map))

    def with_heights(self, height_map: HeightMap) -> MapRows:
        """These rows with other heights, or another filter."""
        return MapRows(
            height_map=height_map,
            names=self.names,
            unit=self._unit,
            picture=self._picture,
            gloss=self._gloss,
            layout=self._layout,
            truth=self._truth,
        )

    def rows(self, name: str, first: int, last: int) -> F32:
        """Rows of "normal" (n, w, 3), unit; of a map of values (n, w, its channels), 0..1."""
        if name == "normal":
            return self._normal_rows(first, last)
        if name == "height":
            return self._height_rows(first, last)[:, :, None]
        if name != "gloss":
            raise ValueError(f"no rows are made for the map {name!r}")
        mask = None
        if self._layout is not None and self._layout.mask is not None:
            mask = self._part(self._layout.mask, first, last)
        return gloss_map(self._brightness(first, last), self._gloss, mask)

    def truth(self, name: str) -> F32:
        """The reference of "height" or "gloss", from the picture itself (metrics/source.py)."""
        if name not in ("height", "gloss"):
            raise ValueError(f"no reference is made for the map {name!r}")
        height_map, (low, span), look = self.height_map, self._unit, self._gloss
        heights = height_map.heights if height_map.reference_heights is None else height_map.reference_heights
        mask = None if self._layout is None else self._layout.mask
        light = None if name == "height" or self._picture is None else self._truth
        out = np.empty((*heights.shape, MAPS[name].channels), np.float32)
        for first, last in bands_of(*heights.shape):
            shown = self._part(heights if light is None else light, first, last)
            if light is None and (low, span) != (0.0, 1.0):
                shown = ((shown.astype(np.float64) - low) / span).astype(np.float32)
            if name == "height":
                out[first:last, :, 0] = shown
                continue
            out[first:last] = true_gloss(shown, look.levels, look.specular, look.smoothness)
            if mask is not None:
                out[first:last, :, 0] *= self._part(mask, first, last)
        return out

    def bundle(self, names: Collection[str], first: int, last: int) -> Bundle:
        """Collects the rows of some maps (see stages.sweep)."""
        bundle: Bundle = {}
        if "normal" in names or "gloss" in names:
            bundle["normal"] = self.rows("normal", first, last)
        for name in names:
            if MAPS[name].kind == "value" and name != "gloss":
                bundle[name] = self.rows(name, first, last)
        if "gloss" in names:
            bundle |= gloss_bundle(self.rows("gloss", first, last))
        return bundle

    def _part(self, texels: npt.NDArray[Any], first: int, last: int) -> npt.NDArray[Any]:
        """Rows of a map (h, w, ...), gutters filled."""
        if self._layout is None or not self._layout.filled:
            return texels[first:last]
        return gutter.gathered(texels, self._layout.source(first, last))

    def _normal_rows(self, first: int, last: int) -> F32:
        normals = normal_rows(self.height_map, first, last)
        if self._border is not None:
            self._border.fill(normals, first)
        return normals

    def _height_rows(self, first: int, last: int) -> F32:
        low, span = self._unit
        rows = self._part(self.height_map.heights, first, last)
        if (low, span) == (0.0, 1.0):
            return rows
        return ((rows.astype(np.float64) - low) / span).astype(np.float32)

    def _brightness(self, first: int, last: int) -> F32:
        if self._picture is None:
            return self._height_rows(first, last)
        part: Any = self._part(self._picture.values, first, last)
        return luminance_plane(replace(self._picture, values=part))

"""Rows of the maps of authored pictures, level 0, and what metrics compare them with.

Pictures of one map may have different sizes: the map takes the larger size along each axis, and the smaller
picture is enlarged as a sampler would show it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from paradize.bakers.authored.pictures import RolePicture, Values
from paradize.bakers.maps.rows import Layout, MapRows
from paradize.data import AuthoredNormals, HeightMap
from paradize.metrics.authored import (
    true_normals,
    true_resized,
    true_shares,
)
from paradize.stages import gutter
from paradize.stages.authored import NormalCoding, decoded_normals, shares
from paradize.stages.filters import REFERENCE_FILTER
from paradize.stages.resample import resized
from paradize.stages.sweep import bands_of

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Size = tuple[int, int]
Wrap = tuple[bool, bool]
Layouts = Callable[[Size], "Layout | None"]  # the UV layout on a map of this size


def _filled(values: Values, layout: Layout | None, first: int, last: int) -> Values:
    """Rows of a picture, gutters filled."""
    if layout is None or not layout.filled:
        return values[first:last]
    return gutter.gathered(values, layout.source(first, last))


@dataclass(frozen=True)
class Channel:
    """A channel of a map: offset + gain * the picture's share of 1, within 0..1; without a picture `offset`
    alone. truth: the same by metrics/authored.py, in float64."""

    picture: RolePicture | None
    offset: float
    gain: float
    truth: Callable[[F64], F64]


class ValueRows:
    """Rows of a map of values: "height", "gloss" without its spread, "occlusion"."""

    def __init__(self, channels: Sequence[Channel], layouts: Layouts, wrap: Wrap) -> None:
        sizes = [channel.picture.size for channel in channels if channel.picture is not None]
        self.size = max(size[0] for size in sizes), max(size[1] for size in sizes)
        self.layout = layouts(self.size)
        self.channels, self._wrap = channels, wrap
        self._planes = [self._plane(channel, layouts) for channel in channels]

    def _plane(self, channel: Channel, layouts: Layouts) -> Values | None:
        """The picture's values (h, w) at the map's size."""
        if channel.picture is None or channel.picture.size == self.size:
            return None if channel.picture is None else channel.picture.values
        return resized(shares(self._whole(channel.picture, layouts), gain=1.0), *self.size, self._wrap)

    @staticmethod
    def _whole(picture: RolePicture, layouts: Layouts) -> Values:
        """A picture of another size than the map, with gutters of its own."""
        return _filled(picture.values, layouts(picture.size), 0, picture.size[0])

    def rows(self, first: int, last: int) -> F32:
        """Rows (n, w, c), 0..1, gutters filled."""
        made = [
            np.full((last - first, self.size[1]), channel.offset, np.float32)
            if plane is None
            else shares(_filled(plane, self.layout, first, last), gain=channel.gain, offset=channel.offset)
            for channel, plane in zip(self.channels, self._planes, strict=True)
        ]
        return np.stack(made, axis=2)

    def truth(self, layouts: Layouts) -> F32:
        """The reference (h, w, c)."""
        out = np.empty((*self.size, len(self.channels)), np.float32)
        for k, channel in enumerate(self.channels):
            if channel.picture is None:
                out[:, :, k] = channel.offset
                continue
            plane: Values = channel.picture.values
            if channel.picture.size != self.size:
                own = np.clip(true_shares(self._whole(channel.picture, layouts)), 0.0, 1.0)
                plane = true_resized(own, *self.size, self._wrap).astype(np.float32)
            for first, last in bands_of(*self.size):
                found = channel.truth(true_shares(_filled(plane, self.layout, first, last)))
                out[first:last, :, k] = np.clip(found, 0.0, 1.0)  # a map holds no more of floats
        return out

    def constant(self) -> tuple[float, ...] | None:
        """The values of the channels where all texels are equal; None where they are not."""
        first = self.rows(0, 1)[0, 0]
        if any((self.rows(*band) != first).any() for band in bands_of(*self.size)):
            return None
        return tuple(float(value) for value in first)


class NormalRows:
    """Rows of a normal map. size: None: its picture's; else it is made to fit: normals that beside other maps
    of another size tell how much they spread."""

    def __init__(
        self,
        picture: RolePicture,
        coding: NormalCoding,
        layouts: Layouts,
        wrap: Wrap,
        size: Size | None = None,
    ) -> None:
        self.size = size or picture.size
        self.layout = layouts(self.size)
        self._picture, self._coding = picture, coding
        self._own = layouts(picture.size)
        self._wrap = wrap
        self._resized = None
        if picture.size != self.size:
            whole = np.concatenate([self._decoded(*band) for band in bands_of(*picture.size)])
            self._resized = resized(whole, *self.size, wrap)

    def _decoded(self, first: int, last: int) -> F32:
        return decoded_normals(_filled(self._picture.values, self._own, first, last), self._coding)

    def rows(self, first: int, last: int) -> F32:
        """Normals (n, w, 3), green up, gutters filled: unit at the picture's own size, else their means."""
        if self._resized is None:
            return self._decoded(first, last)
        rows: F32 = _filled(self._resized, self.layout, first, last)
        return rows

    def truth(self) -> AuthoredNormals:
        """The reference of the metrics."""
        coding = self._coding
        vectors = true_normals(
            self._picture.values
            if self._resized is None
            else _filled(self._picture.values, self._own, 0, self._picture.size[0]),
            signed=coding.signed,
            without_z=coding.without_z,
            green_down=coding.green_down,
            scale=coding.scale,
        )
        if self._resized is not None:
            return _fitted(vectors, self.size, self._wrap, self.layout)
        return AuthoredNormals(vectors, None if self.layout is None else self.layout.islands)

    def constant(self) -> tuple[float, ...] | None:
        """(0, 0, 1) where every normal is; None where one is not."""
        for first, last in bands_of(*self.size):
            if self.rows(first, last)[:, :, :2].any():
                return None
        return 0.0, 0.0, 1.0


class MadeGloss:
    """Rows of gloss that is made of a picture, beside normals of another."""

    def __init__(self, made: MapRows, layouts: Layouts) -> None:
        self.size = made.height_map.heights.shape
        self.layout = layouts(self.size)
        self._made = made

    def rows(self, first: int, last: int) -> F32:
        """Rows (n, w, 2), 0..1, gutters filled."""
        return self._made.rows("gloss", first, last)

    def truth(self, _: Layouts) -> F32:
        """The reference (h, w, 2)."""
        return self._made.truth("gloss")

    def constant(self) -> tuple[float, ...] | None:
        """None: it stays a texture, as gloss without other normals does."""
        return None


class MadeNormals:
    """Rows of normals that are made of another picture, for the gloss of this size beside them."""

    def __init__(self, made: MapRows, layouts: Layouts, wrap: Wrap, size: Size) -> None:
        self._made, self._layout, self._wrap, self._size = made, layouts(size), wrap, size
        self._resized = None
        if made.height_map.heights.shape != size:
            self._resized = resized(_whole(made), *size, wrap)

    def rows(self, first: int, last: int) -> F32:
        """Normals (n, w, 3), gutters filled: unit at the picture's own size, else their means."""
        if self._resized is None:
            return self._made.rows("normal", first, last)
        rows: F32 = _filled(self._resized, self._layout, first, last)
        return rows

    def truth(self) -> HeightMap | AuthoredNormals:
        """The reference of the metrics: the heights; of another size the normals of the reference filter."""
        known = self._made.height_map
        if self._resized is None:
            return known
        heights = known.heights if known.reference_heights is None else known.reference_heights
        vectors = _whole(
            self._made.with_heights(
                replace(known, heights=heights, filter_name=REFERENCE_FILTER, clamp_slopes=False)
            )
        )
        return _fitted(vectors, self._size, self._wrap, self._layout)


def _whole(made: MapRows) -> F32:
    """All normals (h, w, 3) of a picture."""
    return np.concatenate([made.rows("normal", *band) for band in bands_of(*made.height_map.heights.shape)])


def _fitted(vectors: F32, size: Size, wrap: Wrap, layout: Layout | None) -> AuthoredNormals:
    """The reference of normals (h, w, 3) on a map of another size."""
    planes = (vectors[:, :, k].astype(np.float64) for k in range(3))
    made = np.stack([true_resized(plane, *size, wrap) for plane in planes], axis=2).astype(np.float32)
    return AuthoredNormals(made, None if layout is None else layout.islands)

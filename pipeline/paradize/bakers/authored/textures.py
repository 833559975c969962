"""The mips of an authored map in a format, and the measured error of each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from paradize.bakers.authored.rows import MadeGloss, MadeNormals, NormalRows, ValueRows
from paradize.data import AuthoredNormals, HeightMap, Texture
from paradize.metrics.levels import gloss_levels, normal_levels, value_levels
from paradize.stages.compress import LevelWriter, encode_rows
from paradize.stages.mips import gloss_bundle, gloss_rows, half_maps, unit_rows
from paradize.stages.sweep import level_count, sweep

if TYPE_CHECKING:
    from collections.abc import Callable

    from paradize.bakers.product import LevelErrors
    from paradize.stages.sweep import Bundle

F32 = npt.NDArray[np.float32]


class NormalMap:
    """The textures of a normal map: means of vectors, made unit."""

    def __init__(self, rows: NormalRows, *, measure: bool) -> None:
        self.rows = rows
        self._truth = rows.truth() if measure else None

    def texture(self, fmt: str, tier: str) -> Texture:
        """Every level in a format."""
        return _swept(self.rows.size, fmt, tier, lambda *band: {"normal": self.rows.rows(*band)}, unit_rows)

    def errors(self, texture: Texture) -> LevelErrors:
        """The errors of each level; empty without measuring."""
        return [] if self._truth is None else normal_levels(texture, self._truth)


class ValueMap:
    """The textures of a map whose channels are averaged one by one."""

    def __init__(self, rows: ValueRows, truth: F32 | None) -> None:
        self.rows, self._truth = rows, truth

    def texture(self, fmt: str, tier: str) -> Texture:
        """Every level in a format."""
        return _swept(
            self.rows.size,
            fmt,
            tier,
            lambda *band: {"value": self.rows.rows(*band)},
            lambda bundle, level: bundle["value"],
        )

    def errors(self, texture: Texture) -> LevelErrors:
        """The errors of each level; empty without measuring."""
        return [] if self._truth is None else value_levels(texture, self._truth)


class GlossMap:
    """The textures of gloss: smoothness as squared roughness, widened by what averaging took from the normals
    beside it (normals; None: there are none)."""

    def __init__(
        self,
        rows: ValueRows | MadeGloss,
        normals: NormalRows | MadeNormals | None,
        truth: F32 | None,
    ) -> None:
        self.rows, self._normals, self._truth = rows, normals, truth
        self._normal_truth: AuthoredNormals | HeightMap | None = None
        if truth is not None:
            self._normal_truth = self._upright() if normals is None else normals.truth()

    def _upright(self) -> AuthoredNormals:
        layout = self.rows.layout
        vectors = np.broadcast_to(np.array([0.0, 0.0, 1.0], np.float32), (*self.rows.size, 3))
        return AuthoredNormals(vectors, None if layout is None else layout.islands)

    def texture(self, fmt: str, tier: str) -> Texture:
        """Every level in a format."""

        def source(first: int, last: int) -> Bundle:
            bundle = gloss_bundle(self.rows.rows(first, last))
            if self._normals is not None:
                bundle["normal"] = self._normals.rows(first, last)
            return bundle

        def values(bundle: Bundle, level: int) -> F32:
            if self._normals is None:
                upright = np.zeros((*bundle["variance"].shape[:2], 3), np.float32)
                upright[:, :, 2] = 1.0
                bundle = bundle | {"normal": upright}
            return gloss_rows(bundle, level)

        return _swept(self.rows.size, fmt, tier, source, values)

    def errors(self, texture: Texture) -> LevelErrors:
        """The errors of each level; empty without measuring."""
        if self._truth is None or self._normal_truth is None:
            return []
        return gloss_levels(texture, self._truth, self._normal_truth)


def _swept(
    size: tuple[int, int],
    fmt: str,
    tier: str,
    source: Callable[[int, int], Bundle],
    values: Callable[[Bundle, int], F32],
) -> Texture:
    """values: what a band of a level holds."""
    writer = LevelWriter(fmt, *size, level_count(*size))

    def visit(level: int, first: int, bundle: Bundle) -> None:
        writer.put(level, first, encode_rows(values(bundle, level), fmt, tier=tier))

    sweep(*size, source, visit, halve=half_maps)
    return writer.texture()

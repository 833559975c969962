"""The bumps that a scene lays on a mesh -> what light sees of each level of detail, against the source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paradize.metrics.mapped_normal import normal_error
from paradize.stages.tangents import tangent_frames

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from paradize.data import Mesh
    from paradize.metrics.surface import Judge

MAPPED = ("mapped_mean_deg", "mapped_p99_deg", "mapped_max_deg")


@dataclass(frozen=True)
class Bumps:
    """A picture whose brightness is the height of a mesh's surface, as bake_maps reads it.

    strength: percent of the width that white stands above black. relief: as scene.Relief. wrap: "repeat" or
    "clamp"; clamped, slopes stay inside the UV islands of the OBJ `layout`, where it has any.
    """

    picture: Path
    strength: float
    relief: Mapping[str, Any]
    wrap: str
    tier: str
    layout: Path | None = None

    def vectors(self) -> npt.NDArray[np.float32]:
        """The finest normal map, (h, w, 3) unit vectors, green up, before blocks cost it anything."""
        from paradize.bake_maps import picture_rows, relief_levels

        rows, _ = picture_rows(
            self.picture,
            only=("normal",),
            source="color",
            strength=self.strength,
            wrap=self.wrap,
            tier=self.tier,
            filter_name=self.relief["filter"],
            destep=self.relief["destep"],
            uv=self.layout,
            levels=relief_levels(self.relief),
        )
        return rows.whole("normal")


class Light:
    """What levels are judged with besides their shape: their tangent frames and the bumps laid on them.

    method: the tier of tangent frames. Each level's frames are kept for whoever needs them next.
    """

    def __init__(self, bumps: Bumps, method: str = "mikktspace") -> None:
        self.bumps = bumps
        self.method = method
        self._vectors: npt.NDArray[np.float32] | None = None
        self._framed: list[tuple[Mesh, Mesh]] = []

    def framed(self, mesh: Mesh) -> Mesh:
        """The mesh with tangents; made once."""
        for known, framed in self._framed:
            if known is mesh:
                return framed
        framed = tangent_frames(replace(mesh, tangents=None), self.method)
        self._framed.append((mesh, framed))
        return framed

    def errors(self, judge: Judge, level: Mesh, samples: int, apart: float) -> dict[str, float]:
        """normal_mean_deg and so on of a level and mapped_mean_deg and so on: degrees between the normals
        that it and the source show at the same place, as they are and turned by the map in their own tangent
        frames. judge: its `shown` with tangents. apart: the level's error_max."""
        if self._vectors is None:
            self._vectors = self.bumps.vectors()
        framed = self.framed(level)
        judge.split(level, framed)
        repeat = self.bumps.wrap == "repeat"
        return normal_error(judge, framed, samples, apart=apart, normal_map=self._vectors, repeat=repeat)

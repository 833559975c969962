"""The bumps that a scene lays on a mesh -> what light sees of each level of detail, against the source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paradize.metrics.mapped_normal import SAMPLES, normal_error
from paradize.metrics.surface import Judge

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from paradize.data import Mesh

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


def mapped_errors(
    source: Mesh, levels: Sequence[tuple[Mesh, Mapping[str, float]]], bumps: Bumps
) -> list[dict[str, float]]:
    """mapped_mean_deg, mapped_p99_deg and mapped_max_deg of each level: degrees between the normals that it
    and the source show at the same place, both turned by the map in their own tangent frames.

    source, levels: with normals, texture coordinates and tangents; a level that is the source, triangles and
    all, has no error. With each level what is known of it: its error_max.
    """
    judge = Judge(source)
    vectors = None
    found = []
    for level, errors in levels:
        if level is source:
            found.append(dict.fromkeys(MAPPED, 0.0))
            continue
        if vectors is None:
            vectors = bumps.vectors()
        told = normal_error(
            judge,
            level,
            SAMPLES,
            apart=errors["error_max"],
            normal_map=vectors,
            repeat=bumps.wrap == "repeat",
        )
        found.append({key: told[key.replace("mapped", "normal")] for key in MAPPED})
    return found

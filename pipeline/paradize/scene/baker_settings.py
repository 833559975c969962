"""The settings of the bakers: one frozen dataclass each, made from a scene or from the command line.

`asdict` of one is what the job's key hashes and what a worker is sent. A setting of an object that bears the
same name in `settings.py` is taken over by itself: `of_object`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from paradize.scene.settings import SIMPLIFIERS, UNWRAPPERS, SceneObject


@dataclass(frozen=True, kw_only=True)
class MeshSettings:
    """What decides a GLB, beside its source and tier.

    lods: levels at most, level 0 included, 1 to 8. max_error: largest surface distance of any level, of the
    bounding box's diagonal (None: a tenth of it, or the largest of `lod_errors` where that is more).
    lod_ratio: triangles of a level, of those of the one before, 0.05 to 0.95. lod_errors: rising bounds of
    the levels after the source, of the diagonal, instead of lod_ratio: each is the coarsest mesh inside its
    bound. sight, instances: for levels by what the flight sees, as lods_from_path.py takes them.
    simplifier: what makes the levels, one of SIMPLIFIERS; another than ours has tier balanced alone.
    atlas: make texture coordinates where there are none or they overlap; painted: only where there are none,
    since maps are painted for those there are. unwrapper: what makes them, one of UNWRAPPERS.
    weld_m: join places at most this far apart. crease_deg: 0 to 180, where normals are missing and the file
    names no smoothing groups: faces at a larger angle meet in an edge. tangents: the tier of tangent frames,
    as stages/tangents names them.
    quantise: vertices as codes inside these limits (metric -> worst value; none: as stages/quantise.py has
    it); None: as floats.
    base_colors: linear RGB by material, instead of the Kd of materials without a colour map. attributes: of
    the mesh (glTF's names), those that the GLB holds; None: all.
    """

    lods: int = 4
    max_error: float | None = None
    lod_ratio: float = 0.5
    lod_errors: Sequence[float] = ()
    sight: dict[str, Any] | None = None
    instances: Sequence[Mapping[str, Any]] = ()
    simplifier: str = SIMPLIFIERS[0]
    atlas: bool = False
    painted: bool = False
    unwrapper: str = UNWRAPPERS[0]
    weld_m: float = 0.0
    crease_deg: float = 45.0
    tangents: str = "mikktspace"
    quantise: Mapping[str, float] | None = None
    base_colors: Mapping[str, Sequence[float]] | None = None
    attributes: Sequence[str] | None = None

    @classmethod
    def of_object(cls, item: SceneObject, **more: Any) -> MeshSettings:
        """Of a scene's object, and what it alone does not tell."""
        names = [one.name for one in fields(cls) if hasattr(item, one.name)]
        return cls(**{name: getattr(item, name) for name in names} | more)

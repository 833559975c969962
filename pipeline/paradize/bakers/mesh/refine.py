"""Tier `exact` of levels of detail: brings each level of `balanced` nearer to the source with no more
triangles.

Every candidate is measured, and taken only if no error of the level becomes worse. So the tier is never worse
than `balanced`, by any metric that a budget may name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from paradize.data import Mesh
from paradize.errors import SourceError
from paradize.metrics.mapped_normal import normal_error, uv_shift
from paradize.metrics.surface import Original
from paradize.stages.lod import VARIANTS, simplify
from paradize.stages.refine import fit_normals, fit_positions
from paradize.stages.validate import validate_mesh
from paradize.vectors import lengths

# By how much a candidate's error may be above balanced's, as a share: what samples of a surface leave open.
_SLACK = {
    "error_max": 0.0,
    "error_rms": 0.0,
    "uv_shift_p99": 0.01,
    "uv_shift_max": 0.01,
    "normal_p99_deg": 0.01,
    "normal_mean_deg": 0.01,
}
_SHARES = (1.0, 0.5, 0.25)  # of the move to the fitted positions or normals


@dataclass
class RefinedLevel:
    """A level while it is refined. base: errors that it must not exceed, by the names of _SLACK."""

    reference: Original
    base: Mapping[str, float]
    mesh: Mesh
    samples: int
    errors: dict[str, float] = field(init=False)

    def __post_init__(self) -> None:
        self.errors = dict(self.base)

    def accept_if_better(self, mesh: Mesh, fitted: Callable[[], Iterator[Mesh]] | None = None) -> bool:
        """Accepts the mesh if it is better: no error exceeds the base, and the mean ratio of errors to the
        base falls. Quick measurements come first. fitted: the same mesh with other normals, which are
        tried first."""
        reference, samples = self.reference, self.samples
        errors_found = reference.distance(mesh, samples)
        if not self._inside(errors_found):
            return False
        errors_found |= uv_shift(reference, mesh, samples)
        if not self._inside(errors_found):
            return False
        for fitted_mesh in (*(fitted() if fitted else ()), mesh):
            errors = errors_found | normal_error(
                reference, fitted_mesh, samples, surface_error=errors_found["error_max"]
            )
            if self._inside(errors) and self._score(errors) < self._score(self.errors):
                self.mesh, self.errors = fitted_mesh, errors
                return True
        return False

    def _inside(self, errors: Mapping[str, float]) -> bool:
        return all(errors[key] <= (1.0 + _SLACK[key]) * self.base[key] for key in _SLACK if key in errors)

    def _score(self, errors: Mapping[str, float]) -> float:
        return sum(errors[key] / self.base[key] for key in _SLACK if self.base[key] > 0.0)


def refine_level(
    reference: Original,
    before: Mesh,
    level: Mesh,
    errors: Mapping[str, float],
    seams_kept: bool,
    samples: int,
) -> tuple[Mesh, dict[str, float]]:
    """Refines a level of balanced. Returns a mesh of at most as many triangles whose errors are no worse,
    and its errors. before: the level before it. seams_kept: whether its triangles end at texture seams."""
    best = RefinedLevel(reference, errors, level, samples)
    for start, method, variant in _candidates(reference.mesh, before):
        other = simplify(start, len(level.triangles), method, original=reference.mesh, variant=variant)
        try:
            mesh, _ = validate_mesh(other.mesh)
        except SourceError:  # nothing would be left
            continue
        if len(mesh.triangles) <= len(level.triangles) and other.seams_kept >= seams_kept:
            best.accept_if_better(mesh)
    _fit(best)
    return best.mesh, best.errors


def _candidates(source: Mesh, before: Mesh) -> Iterator[tuple[Mesh, str, float]]:
    """Yields other ways to make the level: start mesh, method and weight of attributes."""
    yield before, "meshoptimizer", VARIANTS[0]
    for variant in VARIANTS[before is source :]:
        yield source, "paradize", variant


def _fit(best: RefinedLevel) -> None:
    """Moves the vertices towards the source as far as no error grows, and fits their normals."""
    level, source = best.mesh, best.reference.mesh
    reach_m = best.errors["error_max"] * best.reference.diagonal_m
    points = level.positions.astype(np.float64)
    move = fit_positions(source, level, reach_m) - points
    for share in (*_SHARES, 0.0):
        moved = replace(level, positions=(points + share * move).astype(np.float32)) if share else level
        try:
            mesh, _ = validate_mesh(moved)
        except SourceError:  # triangles without area
            continue
        if len(mesh.triangles) == len(level.triangles) and best.accept_if_better(
            mesh, partial(_with_fitted_normals, source, mesh)
        ):
            return


def _with_fitted_normals(source: Mesh, level: Mesh) -> Iterator[Mesh]:
    """Yields the level with normals fitted to the source's, fully and partly."""
    if source.normals is None or level.normals is None:
        return
    move = fit_normals(source, level) - level.normals
    for share in _SHARES:
        mixed = level.normals + np.float32(share) * move
        length = lengths(mixed)
        normals = np.where((length > 0.1)[:, None], mixed / np.maximum(length, 0.1)[:, None], level.normals)
        yield replace(level, normals=np.ascontiguousarray(normals, np.float32))

"""Simplifies a mesh by the simplifier of a name."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import version

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.kernels import openmesh
from paradize.stages.lod.collapse import simplify_collapse
from paradize.stages.lod.meshoptimizer import simplify_meshoptimizer
from paradize.stages.lod.positions import POSITIONS_ONLY, simplify_positions
from paradize.stages.lod.surface import NEAR_TARGET, Simplified
from paradize.tiers import SIMPLIFIERS

LEAST_TRIANGLES = 4
VARIANTS = (1.0, 0.25, 0.06)  # weights of attributes that tier `exact` tries with our own simplifier
# A mesh full of hard edges or seams has nothing to collapse. If a level cannot be reached with them, these
# attributes are released, in this order, and taken from the original surface again.
_RELEASED = (("normals",), ("normals", "uvs", "uvs1"))


def simplify(
    mesh: Mesh,
    target: int,
    method: str = "paradize",
    *,
    original: Mesh | None = None,
    variant: float = 1.0,
    uv_weight: float = 1.0,
) -> Simplified:
    """Returns a mesh of about `target` triangles (1 or more); more, with a note, where seams and borders hold
    them. Above 1.2 times as many it tries again without normals, then also without texture coordinates, which
    are then taken from `original`: the result's seams_kept is False.

    mesh: validated, with normals. original: the surface that attributes are taken from (default: the mesh).
    Simplifiers that see only positions start from it. variant: factor on our weights of attributes, above 0.
    uv_weight: factor on the weights of texture coordinates, for both methods with attributes.

    The result has no tangents, because each level gets new ones. Raises BakeError for an unknown method, or
    if a library returns something that is not a mesh.
    """
    if method not in SIMPLIFIERS:
        raise BakeError(f"no simplifier {method!r}", mend=f"use one of {', '.join(SIMPLIFIERS)}")
    mesh = replace(mesh, tangents=None)
    original = mesh if original is None else replace(original, tangents=None)
    if method in POSITIONS_ONLY:
        return simplify_positions(mesh, target, original, method)

    def attempt(released: tuple[str, ...]) -> Simplified:
        if method == "meshoptimizer":
            return simplify_meshoptimizer(mesh, target, original, released, uv_weight)
        return simplify_collapse(mesh, target, original, released, variant, uv_weight)

    best = attempt(())
    for released in _RELEASED:
        if not best.note or len(best.mesh.triangles) <= NEAR_TARGET * target:
            break
        level = attempt(released)
        if len(level.mesh.triangles) < 0.95 * len(best.mesh.triangles):
            best = level
    return best


def simplifier_version(name: str) -> str | None:
    """Returns the version of a simplifier's library; None for our own."""
    if name == "openmesh":
        return openmesh.VERSION
    return None if name == "paradize" else version(name)

"""`paradize mesh`: an OBJ into a GLB with tangent frames and levels of detail."""

from __future__ import annotations

import argparse
from pathlib import Path

from paradize.cli.single_file import add_common, bake_file
from paradize.cli.values import number, rising, whole
from paradize.scene.settings import SIMPLIFIERS, UNWRAPPERS


def add(sub: argparse.ArgumentParser) -> None:
    """What `paradize mesh` takes."""
    sub.add_argument("input", type=Path, metavar="IN.obj")
    sub.add_argument("-o", "--out", type=Path, metavar="OUT.glb", required=True)
    sub.add_argument(
        "--lods", type=whole(1, 8), default=4, metavar="N", help="levels, the source counted (4)"
    )
    sub.add_argument(
        "--max-error", type=number(0.0, 1.0), metavar="F", help="largest error, a share of the diagonal"
    )
    sub.add_argument(
        "--ratio",
        type=number(0.05, 0.95),
        default=0.5,
        metavar="R",
        help="triangles of a level, of those of the one before (0.5)",
    )
    sub.add_argument(
        "--errors",
        type=rising(0.0, 1.0),
        default=(),
        metavar="A,B",
        help="levels by error instead: the coarsest mesh inside each bound, shares of the diagonal",
    )
    sub.add_argument(
        "--tangents",
        choices=("face", "vertex", "mikktspace"),
        default="mikktspace",
        help="tangent frames: the mean at each vertex, or those of MikkTSpace (mikktspace); face is vertex",
    )
    sub.add_argument(
        "--simplifier",
        choices=SIMPLIFIERS,
        default=SIMPLIFIERS[0],
        help="what makes the levels (paradize); fast-simplification and openmesh know positions alone: "
        "texture coordinates are taken from the source again, and seams are let go; they take one material, "
        "openmesh manifolds only",
    )
    sub.add_argument("--atlas", action="store_true", help="make a UV layout")
    sub.add_argument(
        "--unwrapper",
        choices=UNWRAPPERS,
        help="what makes the UV layout (paradize); as --atlas, by that one",
    )
    sub.add_argument(
        "--quantise", action="store_true", help="vertices as 16-bit codes; what that costs is told"
    )
    sub.add_argument(
        "--weld", type=number(0.0, 1e6), default=0.0, metavar="METRES", help="join places this near (0: none)"
    )
    sub.add_argument(
        "--crease",
        type=number(0.0, 180.0),
        default=45.0,
        metavar="DEGREES",
        help="where normals are missing, faces at a larger angle meet in an edge (45)",
    )
    add_common(sub)


def run(arguments: argparse.Namespace) -> int:
    """The exit code."""
    settings = {key: getattr(arguments, key) for key in ("lods", "max_error", "tangents", "simplifier")}
    settings |= {"lod_ratio": arguments.ratio, "lod_errors": arguments.errors}
    settings["quantise"] = {} if arguments.quantise else None
    settings["atlas"] = arguments.atlas or arguments.unwrapper is not None
    settings["unwrapper"] = arguments.unwrapper or UNWRAPPERS[0]
    settings |= {"weld_m": arguments.weld, "crease_deg": arguments.crease}
    return bake_file(arguments, "mesh", settings, arguments.out)

"""`paradize mesh`: bakes a model into a GLB with tangent frames and levels of detail."""

from __future__ import annotations

import argparse

from paradize.cli.options import add_common, add_crease, help_of
from paradize.cli.single_file import add_budget, bake_file
from paradize.cli.values import number, path, rising, whole
from paradize.scene import ranges
from paradize.scene.baker_settings import MeshSettings
from paradize.scene.settings import SceneObject
from paradize.tiers import SIMPLIFIERS, UNWRAPPERS


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize mesh`."""
    sub.add_argument("input", type=path, metavar="IN.obj|glb|gltf|ply|stl", help="the model")
    sub.add_argument("-o", "--out", type=path, metavar="OUT.glb", required=True, help="the file to write")
    sub.add_argument(
        "--lods",
        type=whole(**ranges.LODS),
        default=MeshSettings.lods,
        metavar="N",
        help=help_of(SceneObject, "lods"),
    )
    sub.add_argument(
        "--max-error",
        type=number(**ranges.MAX_ERROR),
        metavar="F",
        help="largest distance of a level from the source, a share of the diagonal of its bounding box (0.1, "
        "or the largest of --errors)",
    )
    sub.add_argument(
        "--ratio",
        dest="lod_ratio",
        type=number(**ranges.LOD_RATIO),
        default=MeshSettings.lod_ratio,
        metavar="R",
        help=help_of(SceneObject, "lod_ratio"),
    )
    instead = sub.add_mutually_exclusive_group()
    instead.add_argument(
        "--errors",
        dest="lod_errors",
        type=rising(**ranges.MAX_ERROR),
        default=(),
        metavar="A,B",
        help="levels by error instead: the coarsest mesh inside each bound, shares of the diagonal",
    )
    instead.add_argument(
        "--screen-size",
        dest="size_px",
        type=number(**ranges.LOD_SIZE_PX),
        metavar="PIXELS",
        help="levels by how they look instead: level 1 is the coarsest mesh that looks like the source at so "
        "many pixels along its diagonal, each next one at half as many",
    )
    sub.add_argument(
        "--tangents",
        choices=ranges.TANGENTS,
        default=MeshSettings.tangents,
        help=help_of(SceneObject, "tangents"),
    )
    sub.add_argument(
        "--simplifier",
        choices=SIMPLIFIERS,
        default=MeshSettings.simplifier,
        help=help_of(SceneObject, "simplifier"),
    )
    sub.add_argument(
        "--atlas", action="store_true", help="make UVs for a model without them, or whose UVs overlap"
    )
    sub.add_argument(
        "--unwrapper",
        choices=UNWRAPPERS,
        help="make UVs like --atlas, by this library (paradize)",
    )
    sub.add_argument("--quantise", action="store_true", help="16-bit vertices; their error is measured")
    sub.add_argument(
        "--weld",
        dest="weld_m",
        type=number(**ranges.WELD_M),
        default=MeshSettings.weld_m,
        metavar="METRES",
        help=help_of(SceneObject, "weld_m"),
    )
    add_crease(sub)
    add_budget(sub, "mesh")
    add_common(sub)


def run(arguments: argparse.Namespace) -> int:
    """Bakes the model by the options as the file of -o. Returns the exit code."""
    settings = MeshSettings.of(
        arguments,
        quantise={} if arguments.quantise else None,
        screen_size=None if arguments.size_px is None else {"size_px": arguments.size_px},
        atlas=arguments.atlas or arguments.unwrapper is not None,
        unwrapper=arguments.unwrapper or MeshSettings.unwrapper,
    )
    return bake_file(arguments, "mesh", settings, arguments.out)

"""`paradize terrain`: bakes a heightmap into a GLB under a bound on its vertical error."""

from __future__ import annotations

import argparse

from paradize.cli import options
from paradize.cli.options import add_common, help_of
from paradize.cli.single_file import add_budget, add_nodata, bake_file
from paradize.cli.values import number, path
from paradize.scene import ranges
from paradize.scene.baker_settings import TerrainSettings
from paradize.scene.settings import Terrain


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize terrain`."""
    sub.add_argument(
        "input",
        type=path,
        metavar="IN.png",
        help="the heightmap: a grey picture, .hgt, .asc, .tif, .exr, .raw",
    )
    sub.add_argument("-o", "--out", type=path, metavar="OUT.glb", required=True, help="the file to write")
    options.add_relief(
        sub,
        required=True,
        size="",
        height="(floats, signed integers, .hgt and .asc are metres and need none)",
        max_error="(default: a thousandth of H, or of the range of metres; of 8 bits a step, H / 255)",
    )
    sub.add_argument(
        "--scale",
        type=number(**ranges.HEIGHT_SCALE),
        default=Terrain.height_scale,
        metavar="F",
        help=help_of(Terrain, "height_scale"),
    )
    add_nodata(sub)
    sub.add_argument("--quantise", action="store_true", help="16-bit vertices, inside the same bound")
    add_budget(sub, "terrain")
    add_common(sub)


def run(arguments: argparse.Namespace) -> int:
    """Runs the command; returns the exit code."""
    settings = TerrainSettings.of(
        arguments,
        size_m=tuple(arguments.size),
        height_m=arguments.height,
        height_scale=arguments.scale,
        max_error_m=arguments.max_error,
    )
    return bake_file(arguments, "terrain", settings, arguments.out)

"""`paradize terrain`: a heightmap into a GLB under a bound on its vertical error."""

from __future__ import annotations

import argparse
from pathlib import Path

from paradize.cli import options
from paradize.cli.single_file import add_common, add_nodata, bake_file
from paradize.cli.values import number


def add(sub: argparse.ArgumentParser) -> None:
    """What `paradize terrain` takes."""
    sub.add_argument("input", type=Path, metavar="IN.png")
    sub.add_argument("-o", "--out", type=Path, metavar="OUT.glb", required=True)
    options.add_relief(
        sub,
        required=True,
        size="",
        height="(floats, signed integers and .hgt are metres and need none)",
        max_error="(default: a thousandth of H, or of what the heights span)",
    )
    sub.add_argument(
        "--scale", type=number(-1e6, 1e6), default=1.0, metavar="F", help="heights times F, of metres too (1)"
    )
    add_nodata(sub)
    sub.add_argument(
        "--quantise", action="store_true", help="vertices as 16-bit codes, inside the same bound"
    )
    add_common(sub)


def run(arguments: argparse.Namespace) -> int:
    """The exit code."""
    settings = {
        "size_m": tuple(arguments.size),
        "height_m": arguments.height,
        "height_scale": arguments.scale,
        "nodata": arguments.nodata,
        "max_error_m": arguments.max_error,
        "quantise": arguments.quantise,
    }
    return bake_file(arguments, "terrain", settings, arguments.out)

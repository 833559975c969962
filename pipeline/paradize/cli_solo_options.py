"""The options of the commands that bake one file."""

from __future__ import annotations

import argparse
from pathlib import Path

from paradize import cli_options
from paradize.cli_options import number, rising, whole

MAPS = ("normal", "height", "gloss", "dudv")


def _maps(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in MAPS:
            raise argparse.ArgumentTypeError(f"{name!r} is no map; allowed: {', '.join(MAPS)}")
    return [name for name in MAPS if name in names]


def _names(text: str) -> list[str]:
    names = [name for name in text.split(",") if name]
    if not names:
        raise argparse.ArgumentTypeError(f"{text!r} names nothing")
    return names


_FILTER_HELP = (
    "auto (looks at the heights), central, scharr, fourth, eighth, smooth2 to smooth16, "
    "quintic3 to quintic16, septic4 to septic16, spectral"
)


def _filter(text: str) -> str:
    from paradize.scene import FILTERS

    if text not in FILTERS:
        raise argparse.ArgumentTypeError(f"{text!r} is no filter; {_FILTER_HELP}")
    return text


def _budget(text: str) -> dict[str, float]:
    """METRIC=LIMIT, apart by commas: what [budget] holds in a scene."""
    from paradize.budget import METRICS

    found = {}
    for part in text.split(","):
        metric, _, limit = (word.strip() for word in part.partition("="))
        if metric not in METRICS:
            raise argparse.ArgumentTypeError(f"{metric!r} is no metric; there are {', '.join(METRICS)}")
        found[metric] = number(0.0, METRICS[metric].high)(limit)
    return found


def _nodata(text: str) -> float | str:
    if text in ("auto", "none"):
        return text
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no number; allowed: a number, auto or none") from None


def add_nodata(sub: argparse.ArgumentParser) -> None:
    """What commands take that read heights."""
    sub.add_argument(
        "--nodata",
        type=_nodata,
        default="auto",
        metavar="V",
        help="the number that means no height; none; auto: what the file says, and numbers far off (auto)",
    )


def add_common(sub: argparse.ArgumentParser) -> None:
    """What all of them take."""
    what = "largest errors accepted (of dB the least); beyond them: a warning, with --tier auto an error; "
    what += "of what is not measured: an error"
    sub.add_argument("--budget", type=_budget, default={}, metavar="METRIC=LIMIT,...", help=what)
    cli_options.add_common(sub)


def add_maps(sub: argparse.ArgumentParser) -> None:
    """What `paradize maps` takes."""
    sub.add_argument("input", type=Path, metavar="IN.png")
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", required=True)
    sub.add_argument("--only", type=_maps, default=list(MAPS), metavar="A,B", help=", ".join(MAPS))
    sub.add_argument(
        "--from",
        dest="source",
        choices=("auto", "color", "height"),
        default="auto",
        help="what IN holds (auto: heights where it has one channel of 16 bits or floats, else colour)",
    )
    add_nodata(sub)
    sub.add_argument(
        "--strength",
        type=number(0.0, 1e6),
        default=1.0,
        metavar="S",
        help="full white stands S percent of the map's width high (1)",
    )
    sub.add_argument(
        "--wrap", choices=("repeat", "clamp"), default="clamp", help="what lies beyond the border"
    )
    sub.add_argument(
        "--green", choices=("up", "down"), default="up", help="which way green points in normals"
    )
    sub.add_argument("--format", dest="fmt", choices=("ktx2", "png"), default="ktx2")
    sub.add_argument("--uv", type=Path, metavar="IN.obj", help="the UV layout that the map is for")
    sub.add_argument(
        "--gloss-groups", type=_names, metavar="A,B", help="only these groups of the layout shine"
    )
    sub.add_argument("--report", type=Path, metavar="DIR", help="draw a contact sheet there, as <IN>.png")
    sub.add_argument("--filter", type=_filter, default="auto", metavar="F", help=_FILTER_HELP)
    sub.add_argument(
        "--destep", action="store_true", help="smooth the steps of an 8-bit source, within half a step"
    )
    for name, default, low, text in (
        ("black", 0.0, -1e6, "the value that becomes 0"),
        ("white", 1.0, -1e6, "the value that becomes 1"),
        ("gamma", 1.0, 1e-3, "above 1 lifts the middle of the heights"),
        ("contrast", 1.0, -1e6, "about one half"),
        ("brightness", 0.0, -1e6, "added to the heights"),
    ):
        what = f"{text} ({default:g})"
        sub.add_argument(f"--{name}", type=number(low, 1e6), default=default, metavar="X", help=what)
    sub.add_argument("--invert", action="store_true", help="white is low")
    sub.add_argument(
        "--zstd",
        type=whole(1, 22),
        nargs="?",
        const=10,
        metavar="LEVEL",
        help="supercompress KTX2 (level 10)",
    )
    add_common(sub)


def add_mesh(sub: argparse.ArgumentParser) -> None:
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
    sub.add_argument("--atlas", action="store_true", help="make a UV layout")
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


def add_terrain(sub: argparse.ArgumentParser) -> None:
    """What `paradize terrain` takes."""
    sub.add_argument("input", type=Path, metavar="IN.png")
    sub.add_argument("-o", "--out", type=Path, metavar="OUT.glb", required=True)
    sub.add_argument(
        "--size",
        type=number(1e-6, 1e6),
        nargs=2,
        required=True,
        metavar=("X", "Z"),
        help="metres, first to last pixel",
    )
    sub.add_argument(
        "--height",
        type=number(-1e6, 1e6),
        metavar="H",
        help="metres from black to white (floats, signed integers and .hgt are metres and need none)",
    )
    sub.add_argument(
        "--scale", type=number(-1e6, 1e6), default=1.0, metavar="F", help="heights times F, of metres too (1)"
    )
    add_nodata(sub)
    sub.add_argument(
        "--max-error",
        type=number(0.0, 1e6),
        metavar="M",
        help="metres; 0: exact (default: a thousandth of H, or of what the heights span)",
    )
    sub.add_argument(
        "--quantise", action="store_true", help="vertices as 16-bit codes, inside the same bound"
    )
    add_common(sub)

"""`paradize maps`: bakes a colour or height map into normal, height, gloss and du/dv maps; or casts the
occlusion map of a model."""

from __future__ import annotations

import argparse

from paradize.cli.options import add_common, add_crease, help_of
from paradize.cli.single_file import add_budget, add_nodata, bake_file
from paradize.cli.values import number, path, whole
from paradize.errors import BakeError
from paradize.map_table import DERIVED
from paradize.scene import ranges
from paradize.scene.baker_settings import MapSettings, OcclusionSettings
from paradize.scene.settings import FILTERS, Relief, SceneObject

_CAST = "occlusion"


def _maps(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if names == [_CAST]:
        return names
    if _CAST in names:
        raise argparse.ArgumentTypeError(f"{_CAST} is cast from a model, by itself: --only {_CAST}")
    for name in names:
        if name not in DERIVED:
            known = ", ".join((*DERIVED, _CAST))
            raise argparse.ArgumentTypeError(f"{name!r} is not a map that this command bakes; known: {known}")
    return [name for name in DERIVED if name in names]


def _names(text: str) -> list[str]:
    names = [name for name in text.split(",") if name]
    if not names:
        raise argparse.ArgumentTypeError(f"{text!r} is empty; write names, separated by commas")
    return names


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize maps`."""
    sub.add_argument(
        "input",
        type=path,
        metavar="IN.png|obj|glb|gltf|ply|stl",
        help="a picture; with --only occlusion a model: .obj, .glb, .gltf, .ply or .stl",
    )
    sub.add_argument("-o", "--out", type=path, metavar="DIR", required=True, help="the folder to write into")
    sub.add_argument(
        "--only",
        type=_maps,
        default=list(DERIVED),
        metavar="A,B",
        help=f"of {', '.join(DERIVED)} (all); or {_CAST}: cast from the mesh of a model, IN",
    )
    sub.add_argument(
        "--from",
        dest="source",
        choices=("auto", "color", "height"),
        default="auto",
        help="what IN holds (auto: heights if it has one channel of 16 bits or floats, else colour)",
    )
    add_nodata(sub)
    sub.add_argument(
        "--strength",
        type=number(**ranges.STRENGTH),
        default=MapSettings.strength,
        metavar="S",
        help=f"height of full white, in percent of the map's width ({MapSettings.strength:g})",
    )
    sub.add_argument(
        "--wrap",
        choices=("repeat", "clamp"),
        default="clamp",
        help="how the map continues beyond its border (clamp)",
    )
    sub.add_argument(
        "--green", choices=("up", "down"), default="up", help="direction of green in normals (up)"
    )
    sub.add_argument(
        "--format", dest="fmt", choices=("ktx2", "png"), default="ktx2", help="format of the files (ktx2)"
    )
    sub.add_argument(
        "--uv", type=path, metavar="IN.obj|glb|gltf|ply|stl", help="the model whose UVs the map is for"
    )
    sub.add_argument(
        "--gloss-groups",
        type=_names,
        default=(),
        metavar="A,B",
        help="only these groups or materials of that model shine",
    )
    sub.add_argument(
        "--occlusion-px",
        type=whole(**ranges.OCCLUSION_PX),
        default=OcclusionSettings.occlusion_px,
        metavar="N",
        help=help_of(SceneObject, "occlusion_px"),
    )
    sub.add_argument(
        "--occlusion-reach",
        type=number(**ranges.OCCLUSION_REACH),
        default=OcclusionSettings.occlusion_reach,
        metavar="X",
        help=help_of(SceneObject, "occlusion_reach"),
    )
    sub.add_argument(
        "--materials",
        dest="layout_materials",
        type=_names,
        default=(),
        metavar="A,B",
        help="only the triangles of these materials lie on the map (all)",
    )
    sub.add_argument(
        "--see-through",
        type=_names,
        default=(),
        metavar="A,B",
        help="materials that hold back no light in the occlusion map",
    )
    add_crease(sub)
    sub.add_argument("--report", type=path, metavar="DIR", help="also draw a contact sheet, DIR/<IN>.png")
    sub.add_argument("--filter", choices=FILTERS, default=Relief.filter, help=help_of(Relief, "filter"))
    sub.add_argument("--destep", action="store_true", help=help_of(Relief, "destep"))
    for name, limit in (
        ("black", ranges.LEVEL),
        ("white", ranges.LEVEL),
        ("gamma", ranges.GAMMA),
        ("contrast", ranges.LEVEL),
        ("brightness", ranges.LEVEL),
    ):
        default, what = getattr(Relief, name), help_of(Relief, name)
        sub.add_argument(f"--{name}", type=number(**limit), default=default, metavar="X", help=what)
    sub.add_argument("--invert", action="store_true", help=help_of(Relief, "invert"))
    sub.add_argument(
        "--zstd",
        type=whole(**ranges.ZSTD),
        nargs="?",
        const=10,
        metavar="LEVEL",
        help="supercompress KTX2 (level 10)",
    )
    add_budget(sub, "maps")
    add_common(sub)


def run(arguments: argparse.Namespace) -> int:
    """Runs the command; returns the exit code."""
    if arguments.report and arguments.fmt != "ktx2":
        raise BakeError("a contact sheet needs KTX2 maps", mend="leave out --format png or --report")
    if arguments.only == [_CAST]:
        return bake_file(arguments, "occlusion", OcclusionSettings.of(arguments, budget={}))
    return bake_file(arguments, "maps", MapSettings.of(arguments, budget={}), uv=arguments.uv)

"""Options that several commands share."""

from __future__ import annotations

import argparse
import re
from dataclasses import fields

from paradize.cli.values import number, path, whole
from paradize.scene import ranges
from paradize.scene.settings import SceneObject
from paradize.tiers import TIER_OPTIONS


def help_of(table: type, name: str) -> str:
    """The meaning of a field of a scene, and its default, as the help of an option. table: its dataclass."""
    (field,) = (field for field in fields(table) if field.name == name)
    text = str(field.metadata["meaning"])
    if field.default is not None and field.default is not False:
        value = f"{field.default:g}" if isinstance(field.default, float) else str(field.default)
        text += f" ({value} {field.metadata['unit']}".rstrip() + ")"
    return text.replace("%", "%%")


def add_json(sub: argparse.ArgumentParser, text: str = "print one JSON object on standard output") -> None:
    """Declares --json."""
    sub.add_argument("--json", action="store_true", help=text)


def add_crease(sub: argparse.ArgumentParser) -> None:
    """Declares --crease, of models that lack normals."""
    sub.add_argument(
        "--crease",
        dest="crease_deg",
        type=number(**ranges.CREASE_DEG),
        default=SceneObject.crease_deg,
        metavar="DEGREES",
        help=help_of(SceneObject, "crease_deg"),
    )


def add_common(
    sub: argparse.ArgumentParser,
    jobs: str = "threads at most (default: $PARADIZE_THREADS, else cores)",
    tier: str | None = "balanced",
) -> None:
    """Declares the options of every baker. jobs: the help of -j. tier: the default."""
    sub.add_argument("-j", "--jobs", type=whole(1, 4096), metavar="N", help=jobs)
    what = "speed against accuracy; auto: the cheapest tier whose measured error is inside the budget"
    sub.add_argument(
        "--tier", choices=TIER_OPTIONS, default=tier, help=f"{what} (default: {tier or 'as the scene says'})"
    )
    add_json(sub)


def add_relief(
    sub: argparse.ArgumentParser, *, required: bool, size: str, height: str, max_error: str
) -> None:
    """Declares the options of commands that make a terrain from a heightmap. size, height, max_error: the end
    of each help text."""
    from paradize.scene.settings import Terrain

    size_m, heights_m, error_m = (
        number(**ranges.SIZE_M),
        number(**ranges.HEIGHT_M),
        number(**ranges.MAX_ERROR_M),
    )
    sub.add_argument(
        "--size",
        type=size_m,
        nargs=2,
        required=required,
        metavar=("X", "Z"),
        help=f"width and depth in metres, first to last pixel{size}",
    )
    sub.add_argument("--height", type=heights_m, metavar="H", help=f"metres from black to white {height}")
    sub.add_argument("--max-error", type=error_m, metavar="M", help=f"metres; 0: exact {max_error}")
    sub.add_argument(
        "--encoding",
        choices=ranges.ENCODINGS,
        default=Terrain.encoding,
        help=help_of(Terrain, "encoding"),
    )


def add_scene(sub: argparse.ArgumentParser) -> None:
    """Declares the scene argument."""
    sub.add_argument("scene", type=path, metavar="SCENE.toml", help="the scene file")


def _scheduler(text: str) -> str:
    if not re.fullmatch(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:\d+", text):
        raise argparse.ArgumentTypeError(f"{text!r} is not the address of a scheduler; write tcp://HOST:PORT")
    return text


def add_elsewhere(sub: argparse.ArgumentParser) -> None:
    """Declares the options that reach beyond this machine."""
    sub.add_argument(
        "--store",
        metavar="URL",
        help="share results there: a folder, sftp://host/folder, s3://bucket/folder",
    )
    sub.add_argument(
        "--cluster", type=_scheduler, metavar="tcp://HOST:PORT", help="bake on the workers of a Dask cluster"
    )

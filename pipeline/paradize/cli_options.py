"""The options of the commands that work on scenes, and what the options of every command are read with."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path

TYPE_CHECKING = False  # not of `typing`: a bake with nothing to do loads less
if TYPE_CHECKING:
    from datetime import date

TIERS = ("fast", "balanced", "exact", "auto")
SHELLS = ("bash", "zsh", "fish")


def number(low: float, high: float) -> Callable[[str], float]:
    """An option that is a finite number in [low, high]."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is no number") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is out of range; allowed: {low:g} to {high:g}")
        return value

    return read


def percent(text: str) -> float:
    """An option that is a share in percent: above 0, up to 100."""
    value = number(0.0, 100.0)(text.removesuffix("%"))
    if value == 0.0:
        raise argparse.ArgumentTypeError("0 % is nothing; allowed: above 0, up to 100")
    return value


def day(text: str) -> date:
    """An option that is a day: 2026-12-31."""
    from datetime import date

    try:
        return date.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no day; write it as 2026-12-31") from None


def whole(low: int, high: int) -> Callable[[str], int]:
    """An option that is a whole number in [low, high]."""

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is no whole number") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is out of range; allowed: {low} to {high}")
        return value

    return read


def rising(low: float, high: float) -> Callable[[str], tuple[float, ...]]:
    """An option that is numbers in [low, high], apart by commas, none smaller than the one before it."""
    read_one = number(low, high)

    def read(text: str) -> tuple[float, ...]:
        values = tuple(read_one(part) for part in text.split(","))
        if list(values) != sorted(values):
            raise argparse.ArgumentTypeError(f"{text} falls; write the smaller numbers first")
        return values

    return read


def _scaled(text: str, scales: dict[str, float], unit: str, otherwise: str) -> float:
    """A number with one of the units in `scales`; without one it is in `otherwise`. Raises for others."""
    digits = text.rstrip("".join(scales) + "i")
    name = text[len(digits) :] or otherwise
    try:
        value = float(digits) * scales[name]
    except (ValueError, KeyError):
        raise argparse.ArgumentTypeError(f"{text!r} is no {unit}; units: {', '.join(scales)}") from None
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is no {unit}: it must be at least 0, and finite")
    return value


def age(text: str) -> float:
    """An option that is a time, in seconds: 90s, 10m, 12h, 30d; a number alone is days."""
    return _scaled(text, {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}, "time", "d")


def size(text: str) -> int:
    """An option that is a number of bytes: 500M (a million each), 2G, 1Ki (1024), or a number alone."""
    scales = {"B": 1.0}
    for i, letter in enumerate("KMGT"):
        scales |= {letter: 1000.0 ** (i + 1), f"{letter}i": 1024.0 ** (i + 1)}
    return int(_scaled(text, scales, "size", "B"))


def add_json(sub: argparse.ArgumentParser, text: str = "print one JSON object on standard output") -> None:
    """What every command takes."""
    sub.add_argument("--json", action="store_true", help=text)


def add_common(
    sub: argparse.ArgumentParser, jobs: str = "threads at most", tier: str | None = "balanced"
) -> None:
    """What every baker takes. tier: the one without the option."""
    sub.add_argument("-j", "--jobs", type=whole(1, 4096), metavar="N", help=f"{jobs} (default: cores)")
    what = "speed against accuracy; auto: the cheapest whose measured error is inside the budget"
    sub.add_argument(
        "--tier", choices=TIERS, default=tier, help=f"{what} (default: {tier or 'the scene says'})"
    )
    add_json(sub)


def add_scene(sub: argparse.ArgumentParser) -> None:
    """What every command takes that works on a scene."""
    sub.add_argument("scene", type=Path, metavar="SCENE.toml")


def _scheduler(text: str) -> str:
    if not re.fullmatch(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:\d+", text):
        raise argparse.ArgumentTypeError(f"{text!r} is no address of a scheduler; write tcp://HOST:PORT")
    return text


def add_bake(sub: argparse.ArgumentParser) -> None:
    """What `paradize bake` takes."""
    add_scene(sub)
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", help="default: build/assets/<scene name>")
    sub.add_argument("--force", action="store_true", help="bake everything anew; read nothing from the store")
    sub.add_argument(
        "--verify", type=percent, metavar="P", help="derive P %% of the artifacts again and compare bytes"
    )
    add_elsewhere(sub)
    add_common(sub, "worker processes", None)


def add_elsewhere(sub: argparse.ArgumentParser) -> None:
    """What reaches beyond this machine."""
    sub.add_argument(
        "--store",
        metavar="URL",
        help="share what is baked there: a folder, sftp://host/folder, s3://bucket/folder",
    )
    sub.add_argument(
        "--cluster", type=_scheduler, metavar="tcp://HOST:PORT", help="bake on the workers of a Dask cluster"
    )


def add_explain(sub: argparse.ArgumentParser) -> None:
    """What `paradize explain` takes."""
    add_scene(sub)
    sub.add_argument("artifact", nargs="?", metavar="ARTIFACT", help="this one in detail (default: all)")
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", help="where it was baked")
    add_json(sub)


def add_check(sub: argparse.ArgumentParser) -> None:
    """What `paradize check` takes."""
    sub.add_argument("paths", type=Path, nargs="+", metavar="PATH")
    sub.add_argument("--format", dest="fmt", choices=("text", "json", "junit", "sarif"), default="text")
    sub.add_argument(
        "--against", type=Path, metavar="DIR", help="an earlier bake: fail where an artifact got worse"
    )
    sub.add_argument(
        "--worse-by", type=percent, default=5.0, metavar="P", help="by more than this, in percent (5)"
    )
    sub.add_argument("--today", type=day, help=argparse.SUPPRESS)
    add_json(sub, "the same as --format json")


def add_new(sub: argparse.ArgumentParser) -> None:
    """What `paradize new` takes."""
    sub.add_argument("folder", type=Path, metavar="DIR", help="a new folder for the scene")
    sub.add_argument("--from", dest="model", type=Path, metavar="IN.obj", help="the model (default: a vase)")
    add_json(sub)


def add_clean(sub: argparse.ArgumentParser) -> None:
    """What `paradize clean` takes."""
    sub.add_argument("--older-than", type=age, metavar="D", help="not used that long: 30d, 12h, 10m, 90s")
    sub.add_argument("--to-size", type=size, metavar="B", help="keep at most that: 500M, 2G, 1Gi, bytes")
    add_json(sub)


def add_completion(sub: argparse.ArgumentParser) -> None:
    """What `paradize completion` takes."""
    sub.add_argument("shell", choices=SHELLS, help="bash: eval it, or keep it where bash-completion looks")
    add_json(sub)

"""Shared by `paradize mesh`, `maps` and `terrain`: bakes one input file in a worker process."""

from __future__ import annotations

import argparse
import sys
import time
from functools import partial
from math import isfinite, nan
from pathlib import Path

from paradize.cli.output import say, show, show_json, warn
from paradize.cli.table import errors_text, head_of, table
from paradize.cli.values import number, plain
from paradize.errors import BakeError
from paradize.files import resolved
from paradize.kinds import require_folder, require_glb
from paradize.scene.baker_settings import BakerSettings


def _budget(kind: str, text: str) -> dict[str, float]:
    """An option like a scene's [budget]: METRIC=LIMIT, separated by commas. kind: as in add_budget."""
    from paradize.scene.budget import METRICS

    budget = {}
    for part in text.split(","):
        metric, equals, limit = (word.strip() for word in part.partition("="))
        if metric not in METRICS:
            raise argparse.ArgumentTypeError(
                f"{metric!r} is no metric of a budget; {_metrics_near(kind, metric)}"
            )
        if not equals:
            raise argparse.ArgumentTypeError(f"{metric} has no limit; write {metric}=LIMIT")
        budget[metric] = number(0.0, METRICS[metric].high)(limit)
    return budget


def _metrics_near(kind: str, metric: str) -> str:
    """The metric of a command that has nearly this name, and all that it measures."""
    from difflib import get_close_matches

    from paradize.build.budget_metrics import measured_by, of_single_files
    from paradize.map_table import DERIVED
    from paradize.scene.budget import METRICS

    measured = of_single_files(measured_by(kind, DERIVED, {"quantise": kind != "maps"}))
    near = "".join(f"did you mean {name}? " for name in get_close_matches(metric, measured, 1))
    names = ", ".join(name for name in METRICS if name in measured)
    return f"{near}`paradize {kind}` measures {names}"


def _nodata(text: str) -> float | str:
    if text in ("auto", "none"):
        return text
    try:
        value = float(plain(text))
    except ValueError:
        value = nan
    if not isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number; allowed: a finite number, auto or none")
    return value


def add_nodata(sub: argparse.ArgumentParser) -> None:
    """Declares --nodata, for the commands that read heights."""
    sub.add_argument(
        "--nodata",
        type=_nodata,
        default="auto",
        metavar="V",
        help="the value of pixels without a height; none; auto: as the file says, and values far off (auto)",
    )


def add_budget(sub: argparse.ArgumentParser, kind: str) -> None:
    """Declares --budget. kind: "mesh", "maps" or "terrain"."""
    text = (
        "the largest error accepted (for dB the smallest value); beyond it: a warning, with --tier auto an "
    )
    text += "error; a metric that is not measured here: an error"
    budget = partial(_budget, kind)
    sub.add_argument("--budget", type=budget, default={}, metavar="METRIC=LIMIT,...", help=text)


def bake_file(
    arguments: argparse.Namespace,
    kind: str,
    settings: BakerSettings,
    out: Path | None = None,
    **sources: Path | None,
) -> int:
    """Bakes one file, writes what it makes and prints the errors. Returns the exit code.

    The bake is `bake_single(kind, input, settings, **sources)` of build/single_file.py, called in a worker
    process. What it returns is written as the file `out`, or into the folder `arguments.out`."""
    from paradize.build.single_file import bake_single
    from paradize.cli.progress import progress
    from paradize.jobs.limits import cores
    from paradize.jobs.pool import Job, run_jobs
    from paradize.store.atomic import require_place, write_whole

    start = time.monotonic()
    if out is None:
        require_folder(arguments.out)
    elif _same(out, arguments.input):
        raise BakeError("is the input itself", file=out, mend="name another file with -o")
    else:
        require_glb(out)
    for folder in (
        arguments.out if out is None else resolved(out).parent,
        getattr(arguments, "report", None),
    ):
        if folder is not None:
            require_place(folder)
    if getattr(arguments, "report", None):
        require_folder(arguments.report, "--report")
    given = {"kind": kind, "path": arguments.input, "settings": settings, **sources}
    given |= {"tier": arguments.tier, "budget": arguments.budget}
    job = Job(arguments.input.name, bake_single, given, file=arguments.input)
    threads = min(arguments.jobs, cores()) if arguments.jobs else None
    with progress() as shown:
        shown.step(job.name, 0, 1)
        outcome = run_jobs([job], 1, on_step=shown.reached, threads=threads)[0]
    if outcome.error:
        raise outcome.error
    baked = outcome.value
    for file in (arguments.out / name for name in baked.files if out is None):
        if _same(file, arguments.input):  # it leads to it
            raise BakeError(
                "is the input itself", file=file, mend="remove it, or name another folder with -o"
            )
    for name, data in baked.files.items():
        write_whole(out or arguments.out / name, data)
    if getattr(arguments, "report", None):
        from paradize.report.folder import draw_maps

        tiles = arguments.wrap == "repeat" and arguments.uv is None
        sheets = draw_maps(baked.files, arguments.input.stem, baked.report, arguments.report, tiles)
        baked.report["warnings"] += sheets.warnings
        baked.report["sheets"] = [str(path) for path in sheets.drawn]
    seconds = time.monotonic() - start
    rows = [
        (name, tier, errors_text(errors, arguments.budget), str(size) if size else "-", "")
        for name, tier, errors, size in baked.rows
    ]
    rows[-1] = (*rows[-1][:-1], f"{seconds:.2f}")  # of all
    show(table(rows, head_of(arguments.budget, status=False)), sys.stderr if arguments.json else sys.stdout)
    if guess := baked.report.get("guess"):
        say(f"paradize: {guess}")
    warn(baked.report["warnings"])
    if arguments.json:
        show_json(baked.report | {"seconds": round(seconds, 3)})
    return 0


def _same(a: Path, b: Path) -> bool:
    """Whether two paths are the same file."""
    try:
        return a.samefile(b)
    except OSError:
        return False

"""What `paradize mesh`, `maps` and `terrain` share: one input file into baked files, in a worker process."""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

from paradize.cli import options
from paradize.cli.output import say, show, show_json
from paradize.cli.table import HEAD, errors_text, table
from paradize.cli.values import number
from paradize.errors import BakeError
from paradize.kinds import require_folder, require_glb


def _budget(text: str) -> dict[str, float]:
    """METRIC=LIMIT, apart by commas: what [budget] holds in a scene."""
    from paradize.scene.budget import METRICS

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
    options.add_common(sub)


def bake_file(arguments: argparse.Namespace, kind: str, settings: dict[str, Any], out: Path | None) -> int:
    """Runs one baker in a worker; writes its files (into `arguments.out`, or as `out`); prints the result."""
    from paradize.build.single_file import solo
    from paradize.jobs.pool import Job, run_jobs
    from paradize.store.atomic import write_whole

    start = time.monotonic()
    if out is None:
        require_folder(arguments.out)
    elif _same(out, arguments.input):
        raise BakeError("is the input itself", file=out, mend="name another file with -o")
    else:
        require_glb(out)
    given = {"kind": kind, "path": arguments.input, "tier": arguments.tier, "budget": arguments.budget}
    job = Job(arguments.input.name, solo, given | settings, file=arguments.input)
    cores = os.cpu_count() or 1
    outcome = run_jobs([job], 1, threads=min(arguments.jobs or cores, cores))[0]
    if outcome.error:
        raise outcome.error
    made = outcome.value
    for name, data in made.files.items():
        write_whole(out or arguments.out / name, data)
    if getattr(arguments, "report", None):
        from paradize.report.folder import draw_maps

        tiles = arguments.wrap == "repeat" and arguments.uv is None
        sheets = draw_maps(made.files, arguments.input.stem, made.told, arguments.report, tiles)
        made.told["warnings"] += sheets.warnings
        made.told["sheets"] = [str(path) for path in sheets.drawn]
    seconds = time.monotonic() - start
    rows = [
        (name, tier, errors_text(errors, arguments.budget), str(size) if size else "-", f"{seconds:.2f}")
        for name, tier, errors, size in made.rows
    ]
    head = [word for word in HEAD if word != "status"]
    show(table(rows, head), sys.stderr if arguments.json else sys.stdout)
    if guess := made.told.get("guess"):
        say(f"paradize: {guess}")
    for warning in made.told["warnings"]:
        say(f"paradize: warning: {warning}")
    if arguments.json:
        show_json(made.told | {"seconds": round(seconds, 3)})
    return 0


def _same(a: Path, b: Path) -> bool:
    """Whether two names lead to one file."""
    try:
        return a.samefile(b)
    except OSError:
        return False

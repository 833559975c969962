"""`paradize mesh`, `maps` and `terrain`: one file into baked files."""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

from paradize.bake_solo import solo
from paradize.bake_table import HEAD, errors_text, table
from paradize.cli_output import say, show, show_json
from paradize.engine.publish import write_whole
from paradize.engine.workers import Job, run_jobs
from paradize.errors import BakeError
from paradize.kinds import require_folder, require_glb


def _solo(arguments: argparse.Namespace, kind: str, settings: dict[str, Any], out: Path | None) -> int:
    """Runs one baker in a worker; writes its files (into `arguments.out`, or as `out`); prints the result."""
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


def run_mesh(arguments: argparse.Namespace) -> int:
    """The exit code."""
    settings = {
        key: getattr(arguments, key)
        for key in ("lods", "max_error", "atlas", "ratio", "errors", "tangents", "quantise")
    }
    settings |= {"weld_m": arguments.weld, "crease_deg": arguments.crease}
    return _solo(arguments, "mesh", settings, arguments.out)


def run_maps(arguments: argparse.Namespace) -> int:
    """The exit code."""
    if arguments.report and arguments.fmt != "ktx2":
        raise BakeError("a contact sheet is drawn of KTX2 maps", mend="leave out --format png or --report")
    keys = ("only", "source", "nodata", "strength", "wrap", "green", "fmt", "uv", "gloss_groups", "zstd")
    settings = {key: getattr(arguments, key) for key in keys}
    relief = ("black", "white", "gamma", "contrast", "brightness", "invert", "filter", "destep")
    settings["relief"] = {key: getattr(arguments, key) for key in relief}
    return _solo(arguments, "maps", settings, None)


def run_terrain(arguments: argparse.Namespace) -> int:
    """The exit code."""
    settings = {
        "size_m": tuple(arguments.size),
        "height_m": arguments.height,
        "height_scale": arguments.scale,
        "nodata": arguments.nodata,
        "max_error_m": arguments.max_error,
        "quantise": arguments.quantise,
    }
    return _solo(arguments, "terrain", settings, arguments.out)

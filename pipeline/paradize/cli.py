"""The command line: parse, call, print, exit code; nothing else.

Exit 0: done; 1: a bake, a check or a scene failed, or an input was refused; 2: wrong usage. With --json one
JSON object goes to standard output, also on failure, wrong usage and interruption ({"error": [...]}), and
everything else to standard error.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from paradize.cli_options import add_maps_options, number, rising, whole
from paradize.errors import BakeError, GroupedError, ParadizeError, one_line

TIERS = ("fast", "balanced", "exact")
INTERRUPTED = 130  # as shells tell it: 128 + SIGINT


class _WrongUsage(Exception):  # noqa: N818 (never leaves this module)
    """What argparse finds wrong."""


class _OutputLost(Exception):  # noqa: N818 (never leaves this module)
    """Standard output takes no more: its reader has gone, or its disk is full."""


class _Parser(argparse.ArgumentParser):
    """Takes no abbreviated options, and leaves it to `main` to tell what is wrong."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings, allow_abbrev=False)

    def error(self, message: str) -> NoReturn:
        raise _WrongUsage(f"{self.format_usage()}{self.prog}: error: {one_line(message)}")


def parser() -> argparse.ArgumentParser:
    """The whole command line, as DESIGN's contract has it."""
    top = _Parser(
        prog="paradize",
        description="Bakes OBJ models, colour maps and heightmaps into measured, engine-ready assets.",
    )
    top.add_argument("--version", action="store_true", help="print the version and exit")
    commands = top.add_subparsers(dest="command", metavar="COMMAND")

    def command(name: str, call: Callable[[argparse.Namespace], int], text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(call=call)
        return sub

    def common(sub: argparse.ArgumentParser, jobs: str = "threads at most") -> None:
        sub.add_argument("-j", "--jobs", type=whole(1, 4096), metavar="N", help=f"{jobs} (default: cores)")
        sub.add_argument("--tier", choices=TIERS, default="balanced", help="speed against accuracy")
        sub.add_argument("--json", action="store_true", help="print one JSON object on standard output")

    sub = command("bake", _bake, "Bake a scene: everything that it requires, once.")
    sub.add_argument("scene", type=Path, metavar="SCENE.toml")
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", help="default: build/assets/<scene name>")
    sub.add_argument("--force", action="store_true", help="bake everything anew; read nothing from the store")
    common(sub, "worker processes")

    sub = command("mesh", _mesh, "Bake an OBJ into a GLB with tangent frames and levels of detail.")
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
        help="tangent frames: each face's own, the mean at each vertex, or those of MikkTSpace (mikktspace)",
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
    common(sub)

    sub = command(
        "maps", _maps_command, "Bake a colour or height map into normal, height, gloss and du/dv maps."
    )
    add_maps_options(sub)
    common(sub)

    sub = command("terrain", _terrain, "Bake a heightmap into a GLB under a bound on its vertical error.")
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
        "--height", type=number(-1e6, 1e6), required=True, metavar="H", help="metres from black to white"
    )
    sub.add_argument(
        "--max-error",
        type=number(0.0, 1e6),
        metavar="M",
        help="metres; 0: exact (default: a thousandth of H)",
    )
    common(sub)

    sub = command("explain", _explain, "Say why each artifact of a scene exists, and what limits it.")
    sub.add_argument("scene", type=Path, metavar="SCENE.toml")
    sub.add_argument("artifact", nargs="?", metavar="ARTIFACT", help="this one in detail (default: all)")
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", help="where it was baked")
    sub.add_argument("--json", action="store_true", help="print one JSON object on standard output")

    sub = command("check", _check, "Check baked scenes (folders or scene.json), GLB, KTX2 and PNG files.")
    sub.add_argument("paths", type=Path, nargs="+", metavar="PATH")
    sub.add_argument("--format", dest="fmt", choices=("text", "json", "junit", "sarif"), default="text")
    sub.add_argument("--json", action="store_true", help="the same as --format json")
    return top


def _say(*lines: str) -> None:
    """Lines for standard error; where nobody can read it, nothing is lost."""
    with suppress(OSError):
        for line in lines:
            print(one_line(line), file=sys.stderr)


def _print(text: str, stream: Any = None) -> None:
    """Text for `stream`, standard output by itself. Raises _OutputLost where that takes it no longer."""
    try:
        print(text, file=stream or sys.stdout, flush=True)
    except OSError as error:
        if stream is None or stream is sys.stdout:
            raise _OutputLost(error.strerror if not isinstance(error, BrokenPipeError) else "") from None


def _print_json(tree: Any) -> None:
    _print(json.dumps(tree, indent=1, allow_nan=False))


def _complain(errors: Sequence[ParadizeError]) -> None:
    """One message for all errors of a run, equal ones once."""
    told = list(dict.fromkeys(str(error) for error in errors))
    head = "error" if len(told) == 1 else f"{len(told)} errors"
    _say(f"paradize: {head}:" if len(told) > 1 else f"paradize: {head}: {told[0]}")
    if len(told) > 1:
        _say(*(f"  {text}" for text in told))


class _Progress:
    """What runs and how much is done; on a terminal only."""

    def __init__(self) -> None:
        self.bar: Any = None

    def told(self, what: str, done: int, of: int) -> None:
        if not sys.stderr.isatty():
            return
        if self.bar is None:
            from tqdm import tqdm

            self.bar = tqdm(total=of, unit="task", file=sys.stderr, leave=False)
        self.bar.set_description(what)
        self.bar.update(done - self.bar.n)
        if done == of:
            self.bar.close()


def _bake(arguments: argparse.Namespace) -> int:
    from paradize.bake_record import record_name, unchanged_bake
    from paradize.engine.store import Store, default_root

    start = time.monotonic()
    report = None
    if not arguments.force:
        name = record_name(arguments.scene, arguments.out, arguments.tier)
        report = unchanged_bake(Store(default_root()), name)
    if report is not None:
        report.seconds = time.monotonic() - start
    else:
        from paradize.bake import bake

        report = bake(
            arguments.scene,
            arguments.out,
            jobs=arguments.jobs,
            tier=arguments.tier,
            force=arguments.force,
            told=_Progress().told,
        )
    stream = sys.stderr if arguments.json else sys.stdout
    _bake_table(report, stream)
    sheets = _sheets(report, stream)
    for warning in report.warnings:
        _say(f"paradize: warning: {warning}")
    if arguments.json:
        _print_json(report.as_json() | {"sheets": sheets})
    if report.errors:
        _complain(report.errors)
    return 1 if report.errors else 0


def _sheets(report: Any, stream: Any) -> list[str]:
    """Draws the contact sheets of what was baked into $PARADIZE_REPORT (build/report; empty: none), in a
    folder named as the baked one; the files drawn. With nothing baked one look tells that they are there."""
    root = os.environ.get("PARADIZE_REPORT", "build/report")
    folder = Path(root) / report.out.resolve().name
    if not root or report.errors or not (report.count("baked") or not (folder / "sheets.json").is_file()):
        return []
    from paradize.report.folder import draw_folder

    done = draw_folder(report.out, folder)
    report.warnings += done.warnings
    if done.drawn:
        many = "sheet" if len(done.drawn) == 1 else "sheets"
        _print(one_line(f"{len(done.drawn)} contact {many} drawn in {folder}"), stream)
    return [str(path) for path in done.drawn]


def _bake_table(report: Any, stream: Any) -> None:
    from paradize.bake_table import errors_text, table

    rows = [
        (
            row["name"],
            row["status"],
            row["tier"] or "-",
            errors_text(row["errors"], report.budget),
            str(row["bytes"]),
            f"{row['seconds']:.2f}",
        )
        for row in report.artifacts
    ]
    _print(table(rows), stream)
    counts = (
        f"{report.count('baked')} baked, {report.count('reused')} reused, {report.count('failed')} failed"
    )
    what = "nothing to bake: " if not report.count("baked") and not report.errors else ""
    where = "nothing published; the folder is as it was" if report.errors else f"in {report.out}"
    _print(one_line(f"{what}{counts} in {report.seconds:.2f} s, {where}"), stream)


def _solo(
    arguments: argparse.Namespace, call: Callable[..., Any], settings: dict[str, Any], out: Path | None
) -> int:
    """Runs one baker in a worker; writes its files (into `arguments.out`, or as `out`); prints the result."""
    from paradize.bake_table import HEAD, errors_text, table
    from paradize.engine.publish import write_whole
    from paradize.engine.workers import Job, run_jobs

    start = time.monotonic()
    if out is not None and _same(out, arguments.input):
        raise BakeError("is the input itself", file=out, mend="name another file with -o")
    job = Job(arguments.input.name, call, {"path": arguments.input, "tier": arguments.tier, **settings})
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
        (name, tier, errors_text(errors, {}), str(size) if size else "-", f"{seconds:.2f}")
        for name, tier, errors, size in made.rows
    ]
    head = [word for word in HEAD if word != "status"]
    _print(table(rows, head), sys.stderr if arguments.json else sys.stdout)
    for warning in made.told["warnings"]:
        _say(f"paradize: warning: {warning}")
    if arguments.json:
        _print_json(made.told | {"seconds": round(seconds, 3)})
    return 0


def _same(a: Path, b: Path) -> bool:
    """Whether two names lead to one file."""
    try:
        return a.samefile(b)
    except OSError:
        return False


def _mesh(arguments: argparse.Namespace) -> int:
    from paradize.bake_solo import solo_mesh

    settings = {
        key: getattr(arguments, key)
        for key in ("lods", "max_error", "atlas", "ratio", "errors", "tangents", "quantise")
    }
    settings |= {"weld_m": arguments.weld, "crease_deg": arguments.crease}
    return _solo(arguments, solo_mesh, settings, arguments.out)


def _maps_command(arguments: argparse.Namespace) -> int:
    if arguments.report and arguments.fmt != "ktx2":
        raise BakeError("a contact sheet is drawn of KTX2 maps", mend="leave out --format png or --report")
    from paradize.bake_solo import solo_maps

    keys = ("only", "source", "strength", "wrap", "green", "fmt", "uv", "gloss_groups", "zstd")
    settings = {key: getattr(arguments, key) for key in keys}
    relief = ("black", "white", "gamma", "contrast", "brightness", "invert", "filter", "destep")
    settings["relief"] = {key: getattr(arguments, key) for key in relief}
    return _solo(arguments, solo_maps, settings, None)


def _terrain(arguments: argparse.Namespace) -> int:
    from paradize.bake_solo import solo_terrain

    bound = arguments.max_error
    settings = {
        "size_m": tuple(arguments.size),
        "height_m": arguments.height,
        "max_error_m": abs(arguments.height) / 1000.0 if bound is None else bound,
    }
    return _solo(arguments, solo_terrain, settings, arguments.out)


def _check(arguments: argparse.Namespace) -> int:
    from paradize.check import check_paths, render

    findings = check_paths(arguments.paths)
    _print(render(findings, "json" if arguments.json else arguments.fmt))
    return 1 if any(finding.severity == "error" for finding in findings) else 0


def _explain(arguments: argparse.Namespace) -> int:
    from paradize.explain import explain, render

    explanation = explain(arguments.scene, arguments.artifact, arguments.out)
    if arguments.json:
        _print_json(explanation.as_json())
    else:
        _print(render(explanation, details=arguments.artifact is not None))
    return 0


def _terminated(number: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


def _open_streams() -> None:
    """Gives a process that was started without standard streams the null device for each, before a file of
    ours takes their numbers; names that are no text are printed escaped."""
    for stream in range(3):
        try:
            os.fstat(stream)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number: this one
            os.set_inheritable(stream, True)
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 (open as long as the process runs)
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: PTH123, SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def _run(words: Sequence[str]) -> int:
    """Parses and runs one command; tells its errors; returns the exit code."""
    as_json = "--json" in words
    top = parser()
    try:
        arguments = top.parse_args(words)
        if arguments.version:
            from paradize import __version__

            _print(f"paradize {__version__}")
            return 0
        if arguments.command is None:
            raise _WrongUsage(f"{top.format_help()}\nparadize: error: a command is missing")
        code: int = arguments.call(arguments)
        return code
    except _WrongUsage as wrong:
        if as_json:
            _print_json({"error": [str(wrong).splitlines()[-1]]})
        _say(*str(wrong).splitlines())
        return 2
    except KeyboardInterrupt:
        what = "interrupted; nothing half-written stays"
        if as_json:
            _print_json({"error": [what]})
        _say(f"paradize: {what}")
        return INTERRUPTED
    except _OutputLost:
        raise
    except ParadizeError as error:
        errors: Sequence[ParadizeError] = error.errors if isinstance(error, GroupedError) else [error]
    except Exception as unknown:
        errors = [BakeError(f"unforeseen {type(unknown).__name__}: {unknown}", mend="please report it")]
    _complain(errors)
    if as_json:
        _print_json({"error": [str(error) for error in errors]})
    return 1


def main(words: Sequence[str] | None = None) -> int:
    """Runs one command; returns its exit code."""
    _open_streams()
    signal.signal(signal.SIGTERM, _terminated)
    try:
        return _run(sys.argv[1:] if words is None else words)
    except _OutputLost as lost:
        if str(lost):
            _say(f"paradize: error: standard output cannot be written: {lost}")
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is still held goes nowhere
        return 1


if __name__ == "__main__":
    sys.exit(main())

"""`paradize bake`: bakes a scene, prints its table, and draws its report."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paradize.cli.options import add_common, add_elsewhere, add_scene
from paradize.cli.output import complain, show, show_json, warn
from paradize.cli.values import path, percent
from paradize.errors import ParadizeError, one_line
from paradize.files import resolved

if TYPE_CHECKING:
    from paradize.build.options import BuildOptions


_FIELDS = Path(__file__).parents[1] / "scene/FIELDS.md"
SHOWN = 5  # equal textures that are named
MANY = 200  # artifacts; a longer table leaves out those that did not change


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize bake`."""
    add_scene(sub)
    sub.add_argument("-o", "--out", type=path, metavar="DIR", help="default: build/assets/<scene name>")
    sub.add_argument("--force", action="store_true", help="bake everything anew; read nothing from the store")
    sub.add_argument(
        "--verify", type=percent, metavar="P", help="derive P %% of the artifacts again and compare bytes"
    )
    add_elsewhere(sub)
    add_common(sub, "worker processes (default: $PARADIZE_JOBS, else cores)", None)
    sub.epilog = f"{sub.epilog}. All fields of a scene: {_FIELDS}"


def run(arguments: argparse.Namespace) -> int:
    """Bakes; returns the exit code."""
    from paradize.build.provenance import record_name, unchanged_bake
    from paradize.store.local import Store, default_root

    start = time.monotonic()
    report = None
    if not arguments.force:
        name = record_name(arguments.scene, arguments.out, arguments.tier)
        report = unchanged_bake(Store(default_root()), name, arguments.store)
    unchanged = report is not None
    if report is not None:
        report.seconds = time.monotonic() - start
    else:
        from paradize.build.bake import bake

        with _options(arguments) as options:
            report = bake(arguments.scene, arguments.out, options)
    verified: list[str] = []
    wrong: list[ParadizeError] = []
    if arguments.verify and not report.errors:
        from paradize.build.verify import verify

        with _options(arguments) as options:
            verified, wrong = verify(arguments.scene, report, percent=arguments.verify, options=options)
    stream = sys.stderr if arguments.json else sys.stdout
    show_bake(report, stream)
    sheets = _draw_report(arguments.scene, report, unchanged, stream)
    warn(report.warnings)
    if verified:
        show(f"{len(verified)} artifacts baked again, {len(wrong)} differ: {', '.join(verified)}", stream)
    if arguments.json:
        result = report.as_json(report.texts) | {"sheets": sheets, "verified": verified}
        show_json(result | {"error": [str(error) for error in wrong]} if wrong else result)
    if errors := [*report.errors, *wrong]:
        complain(errors)
    return 1 if errors else 0


@contextmanager
def _options(arguments: argparse.Namespace) -> Iterator[BuildOptions]:
    """The build options that the arguments give, with a progress display."""
    from paradize.build.options import BuildOptions
    from paradize.build.provenance import record_name
    from paradize.cli.progress import Progress
    from paradize.store.local import Store, default_root

    name = record_name(arguments.scene, arguments.out, arguments.tier)
    with closing(Progress(Store(default_root()), name)) as observer:
        yield BuildOptions(
            arguments.jobs or 0,
            arguments.tier,
            arguments.force,
            observer,
            cluster=arguments.cluster,
            store=arguments.store,
        )


def _draw_report(scene: Path, report: Any, unchanged: bool, stream: Any) -> list[str]:
    """Draws the poster, the contact sheets and the page into $PARADIZE_REPORT (default: build/report; empty:
    none), in a folder named like the baked one. Returns the sheets drawn. If nothing changed and the page is
    there, nothing is drawn."""
    root = os.environ.get("PARADIZE_REPORT", "build/report")
    folder = Path(root) / resolved(report.out).name
    if not root or report.errors or (unchanged and (folder / "index.html").is_file()):
        return []
    from paradize.cli.progress import progress
    from paradize.preview.player import find_player
    from paradize.report.folder import draw_folder, draw_page
    from paradize.report.poster import draw_poster
    from paradize.store.atomic import require_place, unwritten

    try:
        folder.mkdir(parents=True, exist_ok=True)
        require_place(folder, "PARADIZE_REPORT")
    except (OSError, ParadizeError) as error:  # told once, not for each sheet
        mend = "name another place with PARADIZE_REPORT"
        told = unwritten(folder, error, mend) if isinstance(error, OSError) else error
        report.warnings.append(f"no report: {told}")
        return []
    start = time.monotonic()
    with progress() as shown:
        sheets = draw_folder(report.out, folder, on_progress=shown.step)
        poster = draw_poster(report.out, folder, find_player(), on_progress=shown.step)
    seconds = time.monotonic() - start  # beside those of the bake, which ended before
    report.warnings += sheets.warnings
    if sheets.drawn:
        many = "sheet" if len(sheets.drawn) == 1 else "sheets"
        left = f", {sheets.left} left to later bakes" if sheets.left else ""
        drawn = f"{len(sheets.drawn)} contact {many} drawn in {seconds:.2f} s in {folder}"
        show(one_line(drawn + left), stream)
    try:
        copies = [Path(root) / "index.html"]
        page = draw_page(report.out, folder, report, _explained(scene, report.out), poster, copies)
    except ParadizeError as error:  # the bake stands without a page about it
        report.warnings.append(f"no report: {error}")
    else:
        show(one_line(f"the report: {page}"), stream)
    return [str(path) for path in sheets.drawn]


def _explained(scene: Path, out: Path) -> dict[str, Any]:
    """For the page: what `explain` says of each artifact, and the bytes saved."""
    from paradize.explain.facts import explain
    from paradize.explain.words import words_of

    explanation = explain(scene, None, out)
    artifacts = [
        {"name": facts["name"], "why": [line.strip() for line in words_of(facts)]}
        for facts in explanation.artifacts
    ]
    return {"saved_bytes": explanation.saved, "artifacts": artifacts}


def show_bake(report: Any, stream: Any) -> None:
    """Prints the table of a bake's report, and its sum."""
    from paradize.cli.table import errors_text, head_of, table

    counts = {status: report.count(status) for status in ("baked", "reused", "failed")}
    all_of = sum(counts.values())
    told = report.told
    if all_of > MANY:
        listed = [artifact for artifact in told if artifact.status != "reused" or artifact.over]
        show(f"{all_of - len(listed)} artifacts did not change", stream)
    else:
        listed = report.artifacts
    rows = [
        (
            artifact.name,
            artifact.status,
            artifact.tier or "-",
            errors_text(artifact.errors, report.budget),
            str(artifact.bytes),
            f"{artifact.seconds:.2f}",
        )
        for artifact in listed
    ]
    if rows:
        show(table(rows, head_of(report.budget)), stream)
    equal = [f"{name} is {artifact.name}" for artifact in told for name in artifact.also]
    if equal:
        more = f" and {len(equal) - SHOWN} more" if len(equal) > SHOWN else ""
        show(f"equal textures are published once: {', '.join(equal[:SHOWN])}{more}", stream)
    fetched = f" ({report.fetched} fetched)" if report.fetched else ""
    pushed = f", {report.pushed} shared" if report.pushed else ""
    summary = f"{counts['baked']} baked, {counts['reused']} reused{fetched}, "
    summary += f"{counts['failed']} failed{pushed}"
    what = "nothing to bake: " if not counts["baked"] and not report.errors else ""
    where = "nothing published; the folder is as it was" if report.errors else f"in {report.out}"
    show(one_line(f"{what}{summary} in {report.seconds:.2f} s, {where}"), stream)

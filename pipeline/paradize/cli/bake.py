"""`paradize bake`: a scene, or the word that nothing changed."""

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
from paradize.cli.output import complain, say, show, show_json
from paradize.cli.values import percent
from paradize.errors import ParadizeError, one_line
from paradize.files import resolved

if TYPE_CHECKING:
    from paradize.build.options import BuildOptions


MANY = 200  # artifacts; of more, the table leaves out those that are as they were


def add(sub: argparse.ArgumentParser) -> None:
    """What `paradize bake` takes."""
    add_scene(sub)
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", help="default: build/assets/<scene name>")
    sub.add_argument("--force", action="store_true", help="bake everything anew; read nothing from the store")
    sub.add_argument(
        "--verify", type=percent, metavar="P", help="derive P %% of the artifacts again and compare bytes"
    )
    add_elsewhere(sub)
    add_common(sub, "worker processes", None)


def run(arguments: argparse.Namespace) -> int:
    """The exit code."""
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

        with _how(arguments) as how:
            report = bake(arguments.scene, arguments.out, how)
    verified: list[str] = []
    wrong: list[ParadizeError] = []
    if arguments.verify and not report.errors:
        from paradize.build.verify import verify

        with _how(arguments) as how:
            verified, wrong = verify(arguments.scene, report, percent=arguments.verify, how=how)
    stream = sys.stderr if arguments.json else sys.stdout
    show_bake(report, stream)
    sheets = _sheets(arguments.scene, report, unchanged, stream)
    for warning in report.warnings:
        say(f"paradize: warning: {warning}")
    if verified:
        show(f"{len(verified)} artifacts derived again, {len(wrong)} faults: {', '.join(verified)}", stream)
    if arguments.json:
        told = report.as_json() | {"sheets": sheets, "verified": verified}
        show_json(told | {"error": [str(error) for error in wrong]} if wrong else told)
    if errors := [*report.errors, *wrong]:
        complain(errors)
    return 1 if errors else 0


@contextmanager
def _how(arguments: argparse.Namespace) -> Iterator[BuildOptions]:
    """What the arguments say of how to bake, under a display of what runs."""
    from paradize.build.options import BuildOptions
    from paradize.build.provenance import record_name
    from paradize.cli.progress import Progress
    from paradize.store.local import Store, default_root

    name = record_name(arguments.scene, arguments.out, arguments.tier)
    with closing(Progress(Store(default_root()), name)) as watcher:
        yield BuildOptions(
            arguments.jobs or 0,
            arguments.tier,
            arguments.force,
            watcher,
            cluster=arguments.cluster,
            store=arguments.store,
        )


def _sheets(scene: Path, report: Any, unchanged: bool, stream: Any) -> list[str]:
    """Draws the contact sheets and the page of what was baked into $PARADIZE_REPORT (build/report; empty:
    none), in a folder named as the baked one; the sheets drawn. With nothing changed one look tells that they
    are there."""
    root = os.environ.get("PARADIZE_REPORT", "build/report")
    folder = Path(root) / resolved(report.out).name
    if not root or report.errors or (unchanged and (folder / "index.html").is_file()):
        return []
    from paradize.report.folder import draw_folder, draw_page

    done = draw_folder(report.out, folder)
    report.warnings += done.warnings
    if done.drawn:
        many = "sheet" if len(done.drawn) == 1 else "sheets"
        left = f", {done.left} left to later bakes" if done.left else ""
        show(one_line(f"{len(done.drawn)} contact {many} drawn in {folder}{left}"), stream)
    try:
        page = draw_page(
            report.out, folder, report, _explained(scene, report.out), [Path(root) / "index.html"]
        )
    except ParadizeError as error:  # the bake stands without a page about it
        report.warnings.append(f"no report: {error}")
    else:
        show(one_line(f"the report: {page}"), stream)
    return [str(path) for path in done.drawn]


def _explained(scene: Path, out: Path) -> dict[str, Any]:
    """What `explain` says of each artifact and of all, for the page."""
    from paradize.explain.facts import explain
    from paradize.explain.words import words_of

    found = explain(scene, None, out)
    artifacts = [
        {"name": told["name"], "why": [line.strip() for line in words_of(told)]} for told in found.artifacts
    ]
    return {"saved_bytes": found.saved, "artifacts": artifacts}


def show_bake(report: Any, stream: Any) -> None:
    """The table and the sum of a bake's report."""
    from paradize.cli.table import errors_text, table

    told = report.artifacts
    if len(told) > MANY:
        told = [one for one in told if one.status != "reused" or one.over]
        show(f"{len(report.artifacts) - len(told)} artifacts as they were", stream)
    rows = [
        (
            one.name,
            one.status,
            one.tier or "-",
            errors_text(one.errors, report.budget),
            str(one.bytes),
            f"{one.seconds:.2f}",
        )
        for one in told
    ]
    if rows:
        show(table(rows), stream)
    fetched = f" ({report.fetched} fetched)" if report.fetched else ""
    pushed = f", {report.pushed} shared" if report.pushed else ""
    counts = f"{report.count('baked')} baked, {report.count('reused')} reused{fetched}, "
    counts += f"{report.count('failed')} failed{pushed}"
    what = "nothing to bake: " if not report.count("baked") and not report.errors else ""
    where = "nothing published; the folder is as it was" if report.errors else f"in {report.out}"
    show(one_line(f"{what}{counts} in {report.seconds:.2f} s, {where}"), stream)

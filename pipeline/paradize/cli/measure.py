"""`paradize measure`: time, error and bytes of every tier of every stage, as tradeoff.json and a page."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from paradize.cli import options
from paradize.cli.output import say, show, show_json, warn
from paradize.cli.values import path, whole
from paradize.documents import json_text
from paradize.errors import one_line
from paradize.jobs.progress import OnProgress
from paradize.tiers import TIER_OPTIONS


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize measure`."""
    sub.add_argument("input", type=path, metavar="SCENE.toml|FILE", help="a scene, a model or a picture")
    sub.add_argument("-o", "--out", type=path, metavar="DIR", required=True, help="the folder to write")
    sub.add_argument(
        "--runs",
        type=whole(1, 1000),
        metavar="N",
        help="runs of each tier (default: 10, or 3 if a run takes long); of 1 or 2, only times that differ "
        "by more than 2 x count as different",
    )
    sub.add_argument("--tier", choices=TIER_OPTIONS, help="the tier in use (default: the scene's)")
    sub.add_argument("--no-player", action="store_true", help="measure no pictures and frames")
    sub.add_argument(
        "--from",
        dest="source",
        choices=("auto", "color", "height"),
        default="auto",
        help="what a picture holds (auto: heights where it has one channel of 16 bits or floats)",
    )
    options.add_relief(
        sub,
        required=False,
        size=" (default: one metre per pixel)",
        height="(default: a tenth of the longer side)",
        max_error="(default: a thousandth of H)",
    )
    options.add_json(sub)


def run(arguments: argparse.Namespace) -> int:
    """Measures, writes tradeoff.json and tradeoff.html; returns the exit code."""
    from paradize.cli.progress import progress
    from paradize.kinds import require_folder
    from paradize.report.tradeoff.page import tradeoff_page
    from paradize.store.atomic import require_place, write_whole

    require_folder(arguments.out)
    require_place(arguments.out)  # before minutes are spent
    with progress() as shown:
        tradeoff = _measure(arguments, shown.step)
    page = arguments.out / "tradeoff.html"
    write_whole(arguments.out / "tradeoff.json", _json(tradeoff))
    write_whole(page, tradeoff_page(tradeoff).encode())
    frames = _write_frames(tradeoff)
    warn(tradeoff["warnings"])
    if arguments.json:
        show_json(tradeoff)
    else:
        _show_text(tradeoff, page)
        if frames:
            show(f"the player's --fps uses: {frames}")
    return 0


def _json(tree: dict[str, Any]) -> bytes:
    return (json_text(tree) + "\n").encode()


def _write_frames(tradeoff: dict[str, Any]) -> Path | None:
    """Writes the groups of the player beside the folder that `paradize bake` fills by default, where the
    player's --fps reads them. None if the player drew nothing."""
    from paradize.store.atomic import write_whole

    frames = [group for group in tradeoff["groups"] if group["kind"] == "frame"]
    if not frames:
        return None
    path = Path("build/assets") / f"{frames[0]['artifact']}.tradeoff.json"
    write_whole(path, _json({"version": tradeoff["version"], "source": tradeoff["source"], "groups": frames}))
    return path


def _measure(arguments: argparse.Namespace, on_progress: OnProgress) -> dict[str, Any]:
    """The object of tradeoff.json, of a file or a scene."""
    from paradize import api
    from paradize.preview.player import PLAYER, find_player

    size = None if arguments.size is None else (arguments.size[0], arguments.size[1])
    options = api.FileOptions(
        arguments.source, size, arguments.height, arguments.max_error, arguments.encoding
    )
    player = None
    if arguments.input.suffix.lower() == ".toml" and not arguments.no_player:
        player = find_player()
        if player is None:
            say(f"paradize: {PLAYER} was not found: the effect of each stage on the picture is not measured")
    return api.measure(
        arguments.input,
        options,
        tier=arguments.tier,
        runs=arguments.runs,
        player=player,
        on_progress=on_progress,
    )


def _show_text(tradeoff: dict[str, Any], page: Path) -> None:
    """Prints the sentences of every group, and where the page is."""
    for group in tradeoff["groups"]:
        show(one_line(f"{group['name']} ({group['metric']}): {group['sentence']}"))
        if group["advice"]:
            show(one_line(f"  {group['advice']['text']}"))
        for point in group["points"]:
            if point.get("instead") and not point["in_use"]:
                show(one_line(f"  {point['tier']} is dominated: {point['instead']}"))
    for part in tradeoff.get("attribution", []):
        changed = f"FLIP {part['flip_mean']:.3g} on average, {part['flip_p99']:.3g} for 99 of 100 pixels"
        show(one_line(f"{part['stage']}, baked exact: the picture changes by {changed}"))
    tiers = sum(len(group["points"]) for group in tradeoff["groups"])
    show(one_line(f"{tiers} tiers of {len(tradeoff['groups'])} stages in {tradeoff['seconds']:g} s: {page}"))

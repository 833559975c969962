"""`paradize measure`: what every tier of every stage costs and errs, as tradeoff.json and a page."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from paradize.cli import options
from paradize.cli.output import say, show, show_json
from paradize.cli.values import whole
from paradize.errors import BakeError, one_line


def add(sub: argparse.ArgumentParser) -> None:
    """What `paradize measure` takes."""
    sub.add_argument("input", type=Path, metavar="SCENE.toml|FILE", help="a scene, an OBJ or a picture")
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", required=True)
    sub.add_argument(
        "--runs",
        type=whole(1, 1000),
        metavar="N",
        help="of each tier (default: 10; fewer, but 3, where a run takes long)",
    )
    sub.add_argument("--tier", choices=options.TIERS, help="the tier in use (default: the scene's)")
    sub.add_argument("--no-player", action="store_true", help="draw nothing: leave out what needs the player")
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
        size=" (default: a metre a pixel)",
        height="(default: a tenth of the longer side)",
        max_error="(default: a thousandth of H)",
    )
    sub.add_argument("--json", action="store_true", help="print one JSON object on standard output")


class _Bar:
    """What runs, how much is done and how long the rest will take; on a terminal only."""

    def __init__(self) -> None:
        self.bar: Any = None

    def told(self, what: str, done: int, of: int) -> None:
        if not sys.stderr.isatty():
            return
        from tqdm import tqdm

        if self.bar is None or self.bar.total != of:
            self.close()
            self.bar = tqdm(total=of, unit="tier", file=sys.stderr, leave=False, dynamic_ncols=True)
        self.bar.set_description(one_line(what))
        self.bar.update(done - self.bar.n)

    def close(self) -> None:
        if self.bar is not None:
            self.bar.close()


def run(arguments: argparse.Namespace) -> int:
    """The exit code."""
    from paradize.kinds import require_folder
    from paradize.report.tradeoff.page import tradeoff_page
    from paradize.store.atomic import write_whole

    require_folder(arguments.out)
    if arguments.out.exists() and not arguments.out.is_dir():  # before minutes are spent
        raise BakeError("is no folder", file=arguments.out, mend="name a folder with -o")
    bar = _Bar()
    try:
        found = _measured(arguments, bar)
    finally:
        bar.close()
    page = arguments.out / "tradeoff.html"
    write_whole(
        arguments.out / "tradeoff.json", (json.dumps(found, indent=1, allow_nan=False) + "\n").encode()
    )
    write_whole(page, tradeoff_page(found).encode())
    beside = _keep_frames(found)
    for warning in found["warnings"]:
        say(f"paradize: warning: {warning}")
    if arguments.json:
        show_json(found)
    else:
        _tell(found, page)
        if beside:
            show(f"what the player's --fps goes by: {beside}")
    return 0


def _keep_frames(found: dict[str, Any]) -> Path | None:
    """Writes the player's trades beside the folder that `paradize bake` fills by default, where --fps reads
    them; None where the player drew nothing."""
    from paradize.store.atomic import write_whole

    frames = [group for group in found["groups"] if group["kind"] == "frame"]
    if not frames:
        return None
    path = Path("build/assets") / f"{frames[0]['artifact']}.tradeoff.json"
    told = {"version": found["version"], "source": found["source"], "groups": frames}
    write_whole(path, (json.dumps(told, indent=1, allow_nan=False) + "\n").encode())
    return path


def _measured(arguments: argparse.Namespace, bar: _Bar) -> dict[str, Any]:
    if arguments.input.suffix.lower() != ".toml":
        from paradize.measure.plan import FileOptions
        from paradize.measure.tiers import measure_file

        size = None if arguments.size is None else (arguments.size[0], arguments.size[1])
        options = FileOptions(arguments.source, size, arguments.height, arguments.max_error)
        tier = arguments.tier or "balanced"
        return measure_file(arguments.input, options, tier=tier, runs=arguments.runs, told=bar.told)
    from paradize.measure.scene import PLAYER, find_player, measure_scene

    player = None if arguments.no_player else find_player()
    if player is None and not arguments.no_player:
        say(f"paradize: {PLAYER} is not there: what each stage does to the picture is left out")
    return measure_scene(
        arguments.input, tier=arguments.tier, runs=arguments.runs, player=player, told=bar.told
    )


def _tell(found: dict[str, Any], page: Path) -> None:
    """Every trade in words, and where the page is."""
    for group in found["groups"]:
        show(one_line(f"{group['name']} ({group['metric']}): {group['sentence']}"))
        if group["advice"]:
            show(one_line(f"  {group['advice']['text']}"))
    for part in found.get("attribution", []):
        changed = f"{part['flip_mean']:.3g} on the mean, {part['flip_p99']:.3g} for 99 of 100 pixels"
        show(one_line(f"{part['stage']}, exact: the picture changes by FLIP {changed}"))
    tiers = sum(len(group["points"]) for group in found["groups"])
    took = f"{tiers} tiers of {len(found['groups'])} trades in {found['seconds']:g} s"
    show(one_line(f"{took}: {page}"))

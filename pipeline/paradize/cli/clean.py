"""`paradize clean`: deletes what is useless, old or too much in the store."""

from __future__ import annotations

import argparse
import time

from paradize.cli.options import add_json
from paradize.cli.output import show, show_json
from paradize.cli.values import age, size
from paradize.errors import one_line


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize clean`."""
    sub.add_argument(
        "--older-than",
        type=age,
        metavar="D",
        help="delete what was not used for this long: 30d, 12h, 10m, 90s",
    )
    sub.add_argument("--to-size", type=size, metavar="B", help="keep at most this much: 500M, 2G, 1Gi, bytes")
    add_json(sub)


def run(arguments: argparse.Namespace) -> int:
    """Deletes from the store what is useless, too old or too much; returns the exit code."""
    from paradize.store.clean import clean
    from paradize.store.local import Store, default_root

    store = Store(default_root())
    cleaned = clean(store, now_s=time.time(), older_than_s=arguments.older_than, max_bytes=arguments.to_size)
    result = {"store": str(store.root), "dropped": cleaned.dropped}
    result |= {"freed_bytes": cleaned.freed_bytes, "kept_bytes": cleaned.kept_bytes}
    if arguments.json:
        show_json(result)
    else:
        kept = f"{cleaned.kept_bytes} bytes stay in {store.root}"
        dropped = "1 entry" if cleaned.dropped == 1 else f"{cleaned.dropped} entries"
        show(one_line(f"{dropped} deleted, {cleaned.freed_bytes} bytes freed, {kept}"))
    return 0

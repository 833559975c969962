"""`paradize clean`: keeps the store small."""

from __future__ import annotations

import argparse
import time

from paradize.cli.options import add_json
from paradize.cli.output import show, show_json
from paradize.cli.values import age, size
from paradize.errors import one_line


def add(sub: argparse.ArgumentParser) -> None:
    """What `paradize clean` takes."""
    sub.add_argument("--older-than", type=age, metavar="D", help="not used that long: 30d, 12h, 10m, 90s")
    sub.add_argument("--to-size", type=size, metavar="B", help="keep at most that: 500M, 2G, 1Gi, bytes")
    add_json(sub)


def run(arguments: argparse.Namespace) -> int:
    """Takes from the store what is of no use, too old or too much."""
    from paradize.store.clean import clean
    from paradize.store.local import Store, default_root

    store = Store(default_root())
    done = clean(store, now_s=time.time(), older_than_s=arguments.older_than, to_bytes=arguments.to_size)
    told = {"store": str(store.root), "dropped": done.dropped}
    told |= {"freed_bytes": done.freed_bytes, "kept_bytes": done.kept_bytes}
    if arguments.json:
        show_json(told)
    else:
        kept = f"{done.kept_bytes} bytes stay in {store.root}"
        show(one_line(f"{done.dropped} entries dropped, {done.freed_bytes} bytes freed, {kept}"))
    return 0

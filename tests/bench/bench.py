"""Speed and error as ratios beside peers, all measured in this run; prints one table.

usage: bench.py [--runs N] [TOPIC ...], topics parted by spaces or commas

A topic is a file of topics/; one that is LONG runs only where it is named. A row: the work, our median time,
the peer and its median time, the ratio (above 1: we are faster) beside the one promised and whether it was
kept, our error and the peer's against an analytic or float64 reference, what both times hold, and the threads
and instruction sets of each side. Errors are not inside the times.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
from pathlib import Path

from chart import draw
from row import Row, machine

sys.path.append(str(Path(__file__).parents[2]))  # rows share tests.places and tests.pipeline's truths

TOPICS = sorted(file.stem for file in Path(__file__).with_name("topics").glob("*.py"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--runs", type=int, default=9, help="timed runs of each work (default 9)")
    parser.add_argument("topics", nargs="*", metavar="TOPIC", help=f"some of: {', '.join(TOPICS)}")
    arguments = parser.parse_args()
    topics = [topic for word in arguments.topics for topic in word.split(",")]
    unknown = sorted(set(topics) - set(TOPICS))
    if unknown:
        parser.error(f"no topic {', '.join(unknown)}; there are {', '.join(TOPICS)}")
    print(f"{machine()}\n")
    done: list[Row] = []
    with tempfile.TemporaryDirectory() as name:
        for topic in topics or TOPICS:
            module = importlib.import_module(f"topics.{topic}")
            if not topics and getattr(module, "LONG", False):
                continue
            for row in module.rows(arguments.runs, Path(name)):
                done.append(row)
                ratio = row.peer_ms / row.ours_ms
                kept = row.limit is None or ratio >= row.limit
                promise = (
                    ""
                    if row.limit is None
                    else f"   (promised: {row.limit:g} x{'' if kept else ', NOT KEPT'})"
                )
                print(f"{row.work}\n    inside: {row.inside}")
                for side, ms, error, by in (
                    ("ours", row.ours_ms, row.ours_error, row.ours_on),
                    ("peer", row.peer_ms, row.peer_error, f"{row.peer}; {row.peer_on}"),
                ):
                    print(f"    {side}  {ms:9.1f} {row.unit}   {error}   ({by})")
                print(f"    ratio {ratio:9.2f} x{promise}\n", flush=True)
    chart = draw(done)
    if chart:
        print(f"drew {chart}; README.md shows a copy of it, tests/bench/chart.svg")


if __name__ == "__main__":
    main()

"""`make extremes`: every cell in two processes, with one thread and with two; prints the table, writes it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from tests.extremes.table import DEEP, EXTREMES, Cell, all_cells
from tests.places import ROOT
from tests.processes import started

TABLE = Path(__file__).with_name("TABLE.md")
QUICK = tuple(name for name in EXTREMES if name not in DEEP)


def measured(extremes: Sequence[str], again: Sequence[str] = ()) -> list[Cell]:
    """All cells of some columns; of the columns `again`, cells whose bytes differ with two threads fail."""
    second_run = _begun(2, again) if again else nullcontext()
    with _begun(1, extremes) as first, second_run as second:
        one, two = _finished(first), _finished(second) if second else []
    other = {(cell.row, cell.extreme): cell.digest for cell in two}
    return [
        cell
        if other.get((cell.row, cell.extreme), cell.digest) == cell.digest
        else cell._replace(verdict="fails", said="other bytes with 2 threads")
        for cell in one
    ]


def _begun(threads: int, extremes: Sequence[str]) -> AbstractContextManager[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "tests.extremes", "--cells", json.dumps(extremes)]
    environment = {**os.environ, "PARADIZE_THREADS": str(threads)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return started(command, cwd=ROOT, env=environment, **pipes)


def _finished(run: subprocess.Popen[str]) -> list[Cell]:
    out, errors = run.communicate()
    if run.returncode:
        raise RuntimeError(f"the cells could not be run:\n{errors}")
    return [Cell(*cell) for cell in json.loads(out)]


def _figure(cell: Cell) -> str:
    """The error with one digit."""
    if cell.error is None:
        return ""
    return "0" if cell.error == 0 else f"{cell.error:.0e}".replace("e-0", "e-").replace("e+0", "e+")


def as_text(cells: list[Cell]) -> str:
    """A line for each cell: stage, extreme, error, verdict."""
    lines = []
    for cell in cells:
        error = f"{_figure(cell)} {cell.unit}" if cell.error is not None else ""
        lines.append(f"{cell.row:34} {cell.extreme:11} {error:24} {cell.verdict}: {_said(cell)}")
    counts = {verdict: sum(cell.verdict == verdict for cell in cells) for verdict in _WORDS}
    message = ", ".join(f"{count} {_WORDS[verdict]}" for verdict, count in counts.items())
    return "\n".join([*lines, f"{len(cells)} cells: {message}"])


_WORDS = {"holds": "hold", "refused": "refused", "absent": "do not apply", "fails": "fail"}


def _said(cell: Cell) -> str:
    return cell.said or f"within {cell.limit:g} {cell.unit}"


def as_markdown(cells: list[Cell]) -> str:
    """The page of the docs: a table of errors, then what was refused and why, then what is absent."""
    rows: dict[str, list[Cell]] = {}
    for cell in cells:
        rows.setdefault(cell.row, []).append(cell)
    lines = [
        "# Extremes: what every stage and metric does with them",
        "",
        "Written by `make extremes`; `tests/extremes/README.md` tells what is measured and how. A number",
        "is the largest error from the truth, within the limit of its row; *no*: refused, with the message",
        "below; a dot: does not apply, for the reason below. Every cell gave the same bytes in two runs,",
        "with one thread and with two.",
        "",
        *(f"- **{name}**: {what}" for name, what in EXTREMES.items()),
        "",
        f"| | limit | {' | '.join(EXTREMES)} |",
        f"|---|---|{'---|' * len(EXTREMES)}",
    ]
    marks = {"refused": "*no*", "absent": "·"}
    for name, row in rows.items():
        result = [marks.get(c.verdict) or (_figure(c) if c.verdict == "holds" else "**fails**") for c in row]
        lines.append(f"| {name} | {row[0].limit:g} {row[0].unit} | {' | '.join(result)} |")
    for head, verdict in (("Refused", "refused"), ("Does not apply", "absent")):
        lines += ["", f"## {head}", ""]
        for name, row in rows.items():
            said: dict[str, list[str]] = {}
            for cell in row:
                if cell.verdict == verdict:
                    said.setdefault(cell.said, []).append(cell.extreme)
            lines += [f"- {name}: {', '.join(extremes)}: {message}" for message, extremes in said.items()]
    return "\n".join(lines) + "\n"


def main() -> int:
    """0 where every cell holds, is refused as it must be, or does not apply."""
    if sys.argv[1:2] == ["--cells"]:
        print(json.dumps(all_cells(json.loads(sys.argv[2]))))
        return 0
    cells = measured(tuple(EXTREMES), tuple(EXTREMES))
    print(as_text(cells))
    TABLE.write_text(as_markdown(cells))
    return int(any(cell.verdict == "fails" for cell in cells))


if __name__ == "__main__":
    sys.exit(main())

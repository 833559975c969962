"""The table at the end of every bake: artifact, tier, error against budget, bytes, seconds."""

from __future__ import annotations

from collections.abc import Sequence

from paradize.errors import one_line

HEAD = ("artifact", "status", "tier", "error against budget", "bytes", "seconds")


def table(rows: Sequence[Sequence[str]], head: Sequence[str] = HEAD) -> str:
    """A table as text. The last two columns, numbers, are right-aligned."""
    lines = [head, *([one_line(cell) for cell in row] for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    printed = []
    for line in lines:
        cells = [
            cell.rjust(width) if k >= len(head) - 2 else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        ]
        printed.append("  ".join(cells).rstrip())
    printed.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(printed)


def errors_text(errors: dict[str, float], budget: dict[str, float]) -> str:
    """`metric value unit / budget` for each metric with a budget; without one, the first metric alone."""
    parts = [
        f"{_error(metric, errors[metric])} / {limit:g}"
        for metric, limit in budget.items()
        if metric in errors
    ]
    first = [_error(metric, value) for metric, value in errors.items()][:1]
    return ", ".join(parts or first) or "-"


def _error(metric: str, value: float) -> str:
    """A metric and its value, with the unit if the metric's name does not end with it."""
    from paradize.scene.budget import METRICS

    named = metric.endswith(("_deg", "_db", "_m", "_mb", "_s"))
    unit = "" if named or metric not in METRICS else f" {METRICS[metric].unit}"
    return f"{metric} {value:.3g}{unit}"

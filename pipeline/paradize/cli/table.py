"""The table that every bake ends in: artifact, tier, error against budget, bytes, seconds."""

from __future__ import annotations

from collections.abc import Sequence

from paradize.errors import one_line

HEAD = ("artifact", "status", "tier", "error against budget", "bytes", "seconds")


def table(rows: Sequence[Sequence[str]], head: Sequence[str] = HEAD) -> str:
    """Columns of text; the last two, numbers, to the right."""
    lines = [head, *([one_line(cell) for cell in row] for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    told = []
    for line in lines:
        cells = [
            cell.rjust(width) if k >= len(head) - 2 else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        ]
        told.append("  ".join(cells).rstrip())
    told.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(told)


def errors_text(errors: dict[str, float], budget: dict[str, float]) -> str:
    """`metric value / budget` for each metric that has a budget; the first metric alone where none has."""
    parts = [
        f"{metric} {errors[metric]:.3g} / {limit:g}" for metric, limit in budget.items() if metric in errors
    ]
    first = [f"{metric} {value:.3g}" for metric, value in errors.items()][:1]
    return ", ".join(parts or first) or "-"

"""The table at the end of every bake: artifact, tier, error against budget, bytes, seconds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from paradize.errors import one_line

# Beside the first error: a level near its source may be shaded unlike it, and a sky is near its six faces.
ALSO = ("lod_normal_p99_deg", "panorama_p99_relative")


def head_of(budget: Mapping[str, float], *, status: bool = True) -> tuple[str, ...]:
    """The heads of the columns."""
    error = "error against budget" if budget else "error"
    return ("artifact", *(["status"] if status else []), "tier", error, "bytes", "seconds")


def table(rows: Sequence[Sequence[str]], head: Sequence[str]) -> str:
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
    """`metric value / budget unit` for each metric with a budget; without one, the first metric and ALSO."""
    parts = [
        _error(metric, f"{errors[metric]:.3g} / {limit:g}")
        for metric, limit in budget.items()
        if metric in errors
    ]
    shown = [metric for at, metric in enumerate(errors) if at == 0 or metric in ALSO]
    return ", ".join(parts or [_error(metric, f"{errors[metric]:.3g}") for metric in shown]) or "-"


def _error(metric: str, value: str) -> str:
    """A metric and its value, with the unit if the metric's name does not end with it."""
    from paradize.scene.budget import unit_of

    unit = "" if metric.endswith(("_deg", "_db", "_m", "_mb", "_s")) else unit_of(metric)
    return f"{metric} {value} {unit}".rstrip()

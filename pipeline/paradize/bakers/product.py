"""The products of the bakers of pictures, and the choice of a texture format by a budget."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from paradize.data import Texture
from paradize.errors import BakeError
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.scene.budget import is_beyond

LevelErrors = list[dict[str, float]]
Made = TypeVar("Made")


@dataclass(frozen=True)
class MapProduct:
    """One baked map. data: the file's bytes. format: KTX2's, or "PNG8" / "PNG16". error: the value of
    `metric`, which stands first in `errors` (metric -> value of level 0, six significant digits). levels:
    what was measured of every level, the finest first. tier: the one that was used. filter: the derivative
    filter behind it; None where there is none. reason: why it has another format than its tier's.
    constant: of a map whose texels are all equal, the values of its channels; then `data` is empty.
    source, guess: what the picture was taken for, and in words where nobody said it; as bake.Picture."""

    data: bytes
    width: int
    height: int
    format: str
    error: float
    metric: str | None
    tier: str
    errors: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    levels: LevelErrors = field(default_factory=list)
    filter: str | None = None
    reason: str | None = None
    source: str = "color"
    guess: str | None = None
    constant: tuple[float, ...] | None = None


def texture_product(
    texture: Texture,
    tier: str,
    zstd_level: int | None,
    errors: dict[str, float],
    levels: LevelErrors,
    warnings: list[str],
    *,
    reason: str | None,
    filter_name: str | None = None,
) -> MapProduct:
    """Returns a map that is a texture. errors: of level 0, by metric, the main one first; empty where it was
    not measured."""
    metric = next(iter(errors), None)
    return MapProduct(
        data=encode_ktx2(texture, zstd_level=zstd_level),
        width=texture.width,
        height=texture.height,
        format=texture.format,
        error=errors[metric] if metric else 0.0,
        metric=metric,
        tier=tier,
        errors=errors,
        warnings=warnings,
        levels=levels,
        filter=filter_name,
        reason=reason,
    )


def constant_product(
    constant: tuple[float, ...], width: int, height: int, tier: str, warnings: list[str]
) -> MapProduct:
    """Returns a map whose texels are all equal. constant: the values of its channels."""
    return MapProduct(
        data=b"",
        width=width,
        height=height,
        format="",
        error=0.0,
        metric=None,
        tier=tier,
        warnings=warnings,
        constant=constant,
    )


def one_of(what: str, wrong: Sequence[str], allowed: Collection[str]) -> None:
    """Raises BakeError if there is a wrong word."""
    if wrong:
        raise BakeError(f"no {what} {', '.join(map(repr, wrong))}", mend=f"one of {', '.join(allowed)}")


def wraps_of(wrap: str | tuple[str, str]) -> tuple[bool, bool]:
    """Whether (x, y) repeat, of "repeat" or "clamp" or one for each. Raises BakeError."""
    pair = (wrap, wrap) if isinstance(wrap, str) else wrap
    one_of("wrap", [word for word in pair if word not in ("repeat", "clamp")], ("repeat", "clamp"))
    return pair[0] == "repeat", pair[1] == "repeat"


def flat_errors(name: str, level: Mapping[str, float]) -> dict[str, float]:
    """Returns level 0's errors by the names that budgets use, the map's main metric first."""
    if "p99_deg" in level:
        found = {f"{name}_{part}_deg": level[f"{part}_deg"] for part in ("p99", "mean", "max")}
    else:
        found = {f"{name}_psnr_db": level["psnr_db"], f"{name}_max": level["max"]}
    if "width_p99_deg" in level:
        found |= {f"{name}_width_{part}_deg": level[f"width_{part}_deg"] for part in ("p99", "mean", "max")}
    if "alpha_psnr_db" in level:
        found["alpha_psnr_db"] = level["alpha_psnr_db"]
    return found


def beyond(errors: Mapping[str, float], budget: Mapping[str, float]) -> list[str]:
    """Returns the metrics that exceed their budget, each with its value. budget: of metrics in METRICS."""
    found = []
    for metric, limit in budget.items():
        value = errors.get(metric)
        if value is not None and is_beyond(metric, value, limit):
            found.append(f"{metric} {value:g}, budget {limit:g}")
    return found


def within_budget(
    formats: Sequence[str],
    make: Callable[[str], Made],
    errors_of: Callable[[Made], Mapping[str, float]],
    budget: Mapping[str, float],
) -> tuple[Made, str | None]:
    """Returns what `make` returns for the first format whose errors are inside the budget, else for the
    last; and why it is not the first format."""
    reason = None
    for fmt in formats:
        made = make(fmt)
        over = beyond(errors_of(made), budget)
        if not over or fmt == formats[-1]:
            break
        reason = f"{fmt} exceeds the budget: {', '.join(over)}"
    return made, reason

"""Compares the measured errors and the bytes of a scene's artifacts with its [budget]."""

from __future__ import annotations

from collections.abc import Iterator
from heapq import nlargest
from pathlib import Path
from typing import Any

from paradize.checks.rules import Finding
from paradize.files import bytes_text
from paradize.formats.device import device_bytes
from paradize.formats.scene.manifest import read_entry
from paradize.scene.budget import METRICS, Excess, excesses, is_beyond
from paradize.scene.schema import Limits
from paradize.tiers import LABELS

# The name in a level of what a budget's metric is the largest of.
_LEVELS = {
    "surface_max": "error_max",
    "surface_rms": "error_rms",
    **{
        f"lod_{key}": key
        for key in ("normal_p99_deg", "normal_mean_deg", "mapped_p99_deg", "mapped_mean_deg")
    },
}


def check_budget(manifest: dict[str, Any], folder: Path, file: str) -> Iterator[Finding]:
    """The findings of a manifest, whose own file is `file`, against its budget."""
    budget = Limits(manifest["budget"]["hard"], manifest["budget"]["soft"])
    for name, artifact in manifest["artifacts"].items():
        for excess in excesses(_known(budget), artifact["errors"]):
            place = f"artifacts.{name}{_place(manifest, name, excess)}"
            mend = _mend(manifest["check"]["tried"].get(name), excess)
            yield _finding(excess, file, name, place, mend)
    for excess in excesses(_known(budget), manifest["flight"]["errors"]):
        yield _finding(excess, file, "flight", "flight", "")
    limited = {"folder_mb", "gpu_mb"} & budget.aim.keys()
    if limited:
        sizes = _sizes(manifest, folder)
        for excess in excesses(
            _known(budget), {name: sum(held.values()) / 1e6 for name, held in sizes.items()}
        ):
            held = sizes[excess.metric]
            largest = nlargest(3, filter(held.get, held), key=held.__getitem__)
            named = ", ".join(f"{name} {bytes_text(held[name])}" for name in largest)
            mend = f"the largest: {named}; remove something from the scene, or allow more"
            yield _finding(excess, file, "scene", f"budget.{excess.metric}", mend)


def _known(budget: Limits) -> Limits:
    """The budget without metrics that this version does not know."""
    hard, soft = (
        {key: value for key, value in part.items() if key in METRICS} for part in (budget.hard, budget.soft)
    )
    return Limits(hard, soft)


def _finding(excess: Excess, file: str, name: str, place: str, mend: str) -> Finding:
    code = "PZ401" if excess.hard else "PZ406"
    return Finding(code, file, f"{name}: {excess}", place, mend=mend, artifact=name, metric=excess.metric)


def _place(manifest: dict[str, Any], name: str, excess: Excess) -> str:
    """The worst level of an artifact, or the worst patch of a terrain; empty if scene.json does not say."""
    artifact = manifest["artifacts"][name]
    terrain = manifest["terrain"]
    if terrain and name in terrain["tiles"]:
        patches, tile = terrain["patches"], terrain["tiles"].index(name)
        here = [k for k, at in enumerate(patches["tile"]) if at == tile and patches["diamond"][k] < 0]
        if not here:
            return ""
        worst = max(here, key=lambda k: float(patches["error_m"][k]))
        return f" patch {worst} at ({', '.join(f'{x:.6g}' for x in patches['center'][worst])})"
    if artifact["kind"] == "texture":
        return " level 0"
    key = _LEVELS.get(excess.metric, excess.metric)
    values = [(level[key], k) for k, level in enumerate(artifact["levels"]) if key in level]
    return f" lod{max(values)[1]}" if values else ""


def _mend(tried: dict[str, Any] | None, excess: Excess) -> str:
    """Names the cheapest tier that would pass, of those that the bake measured."""
    if not tried:
        return ""
    unit = METRICS[excess.metric].unit
    measured = {
        tier: errors[excess.metric] for tier, errors in tried["errors"].items() if excess.metric in errors
    }
    order = [tier for tier in LABELS if tier in measured]
    for tier in order:
        if not is_beyond(excess.metric, measured[tier], excess.limit):
            return f"tier {tier} would pass: {measured[tier]:g} {unit}"
    values = ", ".join(f"{tier} {measured[tier]:g}" for tier in order)
    return f"no tier passes ({values} {unit}): improve the source, or allow more in [budget]"


def _sizes(manifest: dict[str, Any], folder: Path) -> dict[str, dict[str, int]]:
    """The bytes of each artifact by metric: of its file, and on the GPU: every level of a texture, and the
    buffers of a mesh."""
    held = {}
    for name, artifact in manifest["artifacts"].items():
        try:
            held[name] = device_bytes(read_entry(folder, artifact))
        except OSError:
            continue  # another rule reports it
    files = {name: artifact["bytes"] for name, artifact in manifest["artifacts"].items()}
    return {"folder_mb": files, "gpu_mb": held}

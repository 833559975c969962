"""`paradize explain`: of each artifact, which pass of the scene asked for it and why, when the flight first
needs it, who asked for its finest level and what was saved by not baking more, what it does to a picture at
most, which input has changed since,
and for an object's maps how wide their gutters are, how wide they should be, and which number decides.

Reads the scene, and scene.json of the last bake where there is one.
"""

from __future__ import annotations

import difflib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paradize.build.job_inputs import inputs_of, stale
from paradize.build.material_colors import material_colors_of
from paradize.documents import SCENE_FILE
from paradize.errors import FormatError, SceneError
from paradize.explain.bounds import bounds_of
from paradize.explain.economy import economy, saved_bytes, textures_by_owner
from paradize.explain.gutters import decides
from paradize.formats.scene_manifest import read_scene
from paradize.maps import maps_of
from paradize.scene.requirements import BakeJob, Output, require
from paradize.scene.settings import Scene, load_scene


@dataclass(frozen=True)
class Explanation:
    """scene: its name. folder: where the last bake is looked for; baked: whether there is one, and why not.
    artifacts: told as --json prints them. saved: bytes that were saved by not baking more, by what was left
    out (economy.saved_bytes); None where one artifact alone, or no bake, was asked for."""

    scene: str
    folder: Path
    baked: bool
    why_not: str
    artifacts: list[dict[str, Any]]
    saved: dict[str, int] | None = None

    def as_json(self) -> dict[str, Any]:
        """The object that --json prints."""
        return {
            "scene": self.scene,
            "folder": str(self.folder),
            "baked": self.baked,
            "why_not": self.why_not or None,
            "artifacts": self.artifacts,
            "saved_bytes": self.saved,
        }


def explain(scene_path: Path, artifact: str | None = None, out: Path | None = None) -> Explanation:
    """Explains every artifact of a scene, or one. out: the folder of its bake (default: build/assets/<name>).

    Raises SceneError for a scene that cannot be read and for an artifact that it does not ask for.
    """
    scene = load_scene(scene_path)
    folder = out or Path("build/assets") / scene.head.name
    manifest, why_not = _last_bake(folder)
    terrain = manifest["terrain"] if manifest else None
    tiles = {f"mesh_{k}" for k in range(1, len(terrain["tiles"]))} if terrain else set()
    wanted = {
        made.artifact: (order, made)
        for order in require(scene, material_colors_of(scene, scene_path)[0]).orders
        for want in order.wants
        if want.kind
        for made in want.made(tiles)
    }
    if artifact is not None and artifact not in wanted:
        near = difflib.get_close_matches(artifact, wanted, n=1)
        mend = f"did you mean {near[0]}? There are " if near else "there are "
        raise SceneError(
            f"asks for no artifact {artifact!r}", file=scene_path, mend=mend + ", ".join(sorted(wanted))
        )
    names = [artifact] if artifact is not None else list(wanted)
    known = _Known(manifest, folder, inputs_of(folder)) if manifest else None
    told = [_told(scene, *wanted[name], known, folder) for name in names]
    saved = saved_bytes(told) if manifest and artifact is None else None
    return Explanation(scene.head.name, folder, manifest is not None, why_not, told, saved)


def _last_bake(folder: Path) -> tuple[dict[str, Any] | None, str]:
    """The manifest of the last bake, or None and why."""
    path = folder / SCENE_FILE
    try:
        return read_scene(path), ""
    except FileNotFoundError:
        return None, f"there is no bake in {folder}: seconds, errors and gutters are not known before"
    except OSError as error:
        return None, f"{path}: cannot be read: {error.strerror or error}"
    except FormatError as error:
        return None, f"{error}; bake it again"


class _Known:
    """What the last bake tells, by artifact: looked through once, however many are explained."""

    def __init__(self, manifest: dict[str, Any], folder: Path, inputs: Any) -> None:
        self.manifest, self.inputs = manifest, inputs
        self.textures = textures_by_owner(manifest)
        self.bounds = bounds_of(manifest, folder)
        names = ("mesh", *maps_of("object"))
        self.owners = {item[name]: item for item in reversed(manifest["objects"]) for name in names}


def _told(scene: Scene, order: BakeJob, want: Output, known: _Known | None, folder: Path) -> dict[str, Any]:
    entry = known.manifest["artifacts"].get(want.artifact) if known else None
    told: dict[str, Any] = {
        "name": want.artifact,
        "kind": want.kind,
        "passes": list(want.passes),
        "reason": want.reason,
        "sources": {role: str(path) for role, path in order.sources.items()},
        "settings": order.settings,
        "first_needed_s": None,
        "gutter": None,
        "demand": None,
        "tried": None,
        "asked": None,
        "stale": None,
        "bound": None,
    }
    if known is None or entry is None:
        return told
    told |= {key: entry[key] for key in ("first_needed_s", "file", "bytes", "tier", "errors", "levels")}
    told["tried"] = _tried(known.manifest, want.artifact)
    told["asked"] = economy(known.manifest, folder, want.artifact, known.textures)
    told["stale"] = stale(known.inputs, scene, order)
    told["bound"] = known.bounds.get(want.artifact)
    if told["bound"] and order.settings.get("weld_m"):
        told["bound"]["open"].insert(0, "how far welding moved its source")
    terrain = known.manifest["terrain"]
    if terrain and want.artifact in terrain["tiles"]:
        told["demand"] = _demand(terrain, want.artifact)
    owner = known.owners.get(want.artifact)
    if entry["gutter"] is not None and owner is not None:
        told["gutter"] = entry["gutter"] | {
            "max_level": entry["max_level"],
            "levels": len(entry["gutter"]["bleed_p99"]),
            "parallax": _parallax(owner),
        }
        told["decides"] = decides(told["gutter"])
    return told


def _tried(manifest: dict[str, Any], artifact: str) -> dict[str, Any] | None:
    """Which tier was asked for and which taken, what each that was tried measured, and the limits of that."""
    tried = manifest["check"]["tried"].get(artifact)
    if tried is None:
        return None
    metrics = {metric for errors in tried["errors"].values() for metric in errors}
    limits = {
        part: {metric: limit for metric, limit in manifest["budget"][part].items() if metric in metrics}
        for part in ("hard", "soft")
    }
    return {**tried, "limits": limits}


def _demand(terrain: dict[str, Any], artifact: str) -> dict[str, Any]:
    """What the flight asks of the terrain, and how many patches of each level a tile and the terrain have."""
    patches, tile = terrain["patches"], terrain["tiles"].index(artifact)
    levels = list(zip(patches["tile"], patches["level"], strict=True))
    here = Counter(level for number, level in levels if number == tile)
    asked: dict[str, Any] = terrain["demand"]
    return asked | {
        "tiles": len(terrain["tiles"]),
        "patches": len(levels),
        "here": {str(level): count for level, count in sorted(here.items())},
    }


def _parallax(owner: dict[str, Any]) -> dict[str, Any]:
    """By material: what is asked of parallax, and what is given (scale and bias)."""
    found = {}
    for name, material in owner["materials"].items():
        scale, bias, limit = (material[f"parallax_{key}"] for key in ("scale", "bias", "limit"))
        reach = 0.5 * abs(scale) + abs(bias)
        share = 1.0 if limit is None or reach <= limit else limit / reach
        found[name] = {
            "asked": [scale, bias],
            "given": [scale * share, bias * share],
            "reach": reach,
            "limit": limit,
        }
    return found

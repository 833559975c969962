"""Collects the facts of `paradize explain`, from the scene and the scene.json of the last bake if there is
one.

Of each artifact: the passes that read it and why; when the flight first needs it; which view needs its finest
level and what was saved by not baking more; the bound of its error in the picture; the inputs that changed
since; and for an object's maps the width of their gutters and the width that they need."""

from __future__ import annotations

import difflib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paradize.build.job_inputs import constant_of, inputs_of, stale
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.tasks import job_settings
from paradize.documents import SCENE_FILE
from paradize.errors import FormatError, SceneError, renamed
from paradize.explain.bounds import bounds_of
from paradize.explain.economy import economy, saved_bytes, textures_by_owner
from paradize.explain.gutters import decides
from paradize.formats.scene.manifest import maps_of_material, read_scene
from paradize.scene.jobs import BakeJob, Output
from paradize.scene.pass_inputs import unread_pictures
from paradize.scene.requirements import require
from paradize.scene.settings import Scene, load_scene


@dataclass(frozen=True)
class Explanation:
    """scene: its name. folder: of the last bake; baked: whether there is one; why_not: why there is none.
    artifacts: as --json prints them. unread: pictures of materials that no pass reads, so that they are not
    baked: {"file", "reason"}. saved: the bytes saved, by what was left out (economy.saved_bytes); None
    for a single artifact or without a bake."""

    scene: str
    folder: Path
    baked: bool
    why_not: str
    artifacts: list[dict[str, Any]]
    unread: list[dict[str, str]]
    saved: dict[str, int] | None = None

    def as_json(self) -> dict[str, Any]:
        """The object that --json prints."""
        return {
            "scene": self.scene,
            "folder": str(self.folder),
            "baked": self.baked,
            "why_not": self.why_not or None,
            "artifacts": self.artifacts,
            "unread": self.unread,
            "saved_bytes": self.saved,
        }


def explain(scene_path: Path, artifact: str | None = None, out: Path | None = None) -> Explanation:
    """Explains every artifact of a scene, or one. out: the folder of its bake (default: build/assets/<name>).

    Raises SceneError for a scene that cannot be read and for an artifact that it does not require.
    """
    scene = load_scene(scene_path)
    folder = out or Path("build/assets") / scene.head.name
    manifest, why_not = _last_bake(folder)
    terrain = manifest["terrain"] if manifest else None
    tiles = {f"mesh_{k}" for k in range(1, len(terrain["tiles"]))} if terrain else set()
    found = find_map_sets(scene, scene_path)
    maps = found.maps
    required = {
        named.artifact: (job, named)
        for job in require(scene, maps).jobs
        for output in job.outputs
        if output.kind
        for named in output.expand(tiles)
    }
    if artifact is not None and artifact not in required:
        near = difflib.get_close_matches(artifact, required, n=1)
        mend = f"did you mean {near[0]}? There are " if near else "there are "
        raise SceneError(
            f"requires no artifact {artifact!r}", file=scene_path, mend=mend + ", ".join(sorted(required))
        )
    names = [artifact] if artifact is not None else list(required)
    known = _Known(manifest, folder, inputs_of(folder), artifact) if manifest else None
    facts = [_facts(scene, *required[name], known, folder) for name in names]
    for fact in facts:
        fact["sources"] = {role: renamed(path, found.inside) for role, path in fact["sources"].items()}
    saved = saved_bytes(facts) if manifest and artifact is None else None
    pictures = [(str(renamed(str(file), found.inside)), why) for file, why in unread_pictures(scene, maps)]
    unread = [{"file": name, "reason": why} for name, why in pictures]
    return Explanation(
        scene=scene.head.name,
        folder=folder,
        baked=manifest is not None,
        why_not=why_not,
        artifacts=facts,
        unread=unread,
        saved=saved,
    )


def _last_bake(folder: Path) -> tuple[dict[str, Any] | None, str]:
    """The manifest of the last bake, or None and why."""
    path = folder / SCENE_FILE
    try:
        return read_scene(path), ""
    except FileNotFoundError:
        known = "seconds, errors and gutters are not known before"
        return None, f"there is no bake in {folder} (-o names another folder): {known}"
    except OSError as error:
        return None, f"{path}: cannot be read: {error.strerror or error}"
    except FormatError as error:
        return None, f"{error}; bake it again"


class _Known:
    """The facts of the last bake by artifact, collected once for all artifacts, or for one."""

    def __init__(self, manifest: dict[str, Any], folder: Path, inputs: Any, artifact: str | None) -> None:
        self.manifest, self.inputs = manifest, inputs
        self.textures = textures_by_owner(manifest)
        self.bounds = bounds_of(manifest, folder, artifact)
        self.same_as = {also: name for name, entry in manifest["artifacts"].items() for also in entry["also"]}
        self.owners: dict[str, dict[str, Any]] = {}  # materials that read a texture, by the texture
        for item in manifest["objects"]:
            for name, material in item["materials"].items():
                for maps in maps_of_material(material).values():
                    for texture in filter(None, maps.values()):
                        self.owners.setdefault(texture, {}).setdefault(name, material)


def _facts(scene: Scene, job: BakeJob, output: Output, known: _Known | None, folder: Path) -> dict[str, Any]:
    """The facts of one artifact, as --json prints them."""
    entry = known.manifest["artifacts"].get(output.artifact) if known else None
    facts: dict[str, Any] = {
        "name": output.artifact,
        "kind": output.kind,
        "passes": list(output.passes),
        "reason": output.reason,
        "sources": {role: str(path) for role, path in job.sources.items()},
        "settings": job_settings(job, scene, finer_format=True),
        "first_needed_s": None,
        "gutter": None,
        "demand": None,
        "tried": None,
        "required_detail": None,
        "stale": None,
        "bound": None,
        "constant": None,
        "same_as": None,
    }
    if known is None:
        return facts
    if entry is None:
        facts["same_as"] = known.same_as.get(output.artifact)
        facts["constant"] = constant_of(known.inputs, job, output.artifact)
        return facts
    facts |= {key: entry[key] for key in ("first_needed_s", "file", "bytes", "tier", "errors", "levels")}
    facts["tried"] = _tried(known.manifest, output.artifact)
    facts["required_detail"] = economy(known.manifest, folder, output.artifact, known.textures)
    facts["stale"] = stale(known.inputs, scene, job)
    facts["bound"] = known.bounds.get(output.artifact)
    if facts["bound"] and job.settings.get("weld_m"):
        facts["bound"]["open"].insert(0, "how far welding moved its source")
    terrain = known.manifest["terrain"]
    if terrain and output.artifact in terrain["tiles"]:
        facts["demand"] = _demand(terrain, output.artifact)
    owner = known.owners.get(output.artifact)
    if entry["gutter"] is not None and owner is not None:
        facts["gutter"] = entry["gutter"] | {
            "max_level": entry["max_level"],
            "levels": len(entry["gutter"]["bleed_p99"]),
            "parallax": _parallax(owner),
        }
        facts["decides"] = decides(facts["gutter"])
    return facts


def _tried(manifest: dict[str, Any], artifact: str) -> dict[str, Any] | None:
    """The requested tier, the tier taken, the errors of each tier tried, and their limits."""
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
    """The terrain patches that the flight needs, and the number of patches of each level in the tile and in
    the terrain."""
    patches, tile = terrain["patches"], terrain["tiles"].index(artifact)
    levels = list(zip(patches["tile"], patches["level"], strict=True))
    here = Counter(level for number, level in levels if number == tile)
    demand: dict[str, Any] = terrain["demand"]
    return demand | {
        "tiles": len(terrain["tiles"]),
        "patches": len(levels),
        "here": {str(level): count for level, count in sorted(here.items())},
    }


def _parallax(materials: dict[str, Any]) -> dict[str, Any]:
    """By material: parallax (scale and bias) as the scene sets it, and as the gutters allow it."""
    parallax = {}
    for name, material in materials.items():
        scale, bias, limit = (material[f"parallax_{key}"] for key in ("scale", "bias", "limit"))
        reach = 0.5 * abs(scale) + abs(bias)
        share = 1.0 if limit is None or reach <= limit else limit / reach
        parallax[name] = {
            "requested": [scale, bias],
            "given": [scale * share, bias * share],
            "reach": reach,
            "limit": limit,
        }
    return parallax

"""Which view needs the finest level of an artifact and when, and how many bytes were saved by not baking
more. Imports no numpy."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Any

from paradize.artifact import SEEN
from paradize.errors import FormatError
from paradize.files import bytes_text, open_file
from paradize.formats.ktx2.layout import full_level_count, level_bytes
from paradize.formats.ktx2.size import SIZE_BYTES, ktx2_size
from paradize.formats.scene.manifest import maps_of_material
from paradize.map_table import DERIVED, MAPS


def textures_by_owner(manifest: dict[str, Any]) -> dict[str, list[str]]:
    """The textures of each object and surface, in the order of the manifest."""
    textures: dict[str, list[str]] = {}
    for name, entry in manifest["artifacts"].items():
        if entry["kind"] == "texture":
            textures.setdefault(name.rpartition("_")[0], []).append(name)
    return textures


def economy(
    manifest: dict[str, Any], folder: Path, artifact: str, textures: dict[str, list[str]]
) -> dict[str, Any] | None:
    """The detail of an artifact that is not baked; None if no distance limits its detail. textures: from
    textures_by_owner.

    left_out: finer levels; saved_bytes: their bytes. texels: of its level 0 that a pixel covers at least,
    with the second_s and the view; limit: why they are 0. maps: bytes, in their smallest format, of maps that
    its picture could give and no pass reads (only for the first artifact of a picture). seen: of a mesh's
    coarser levels, where they take over and how they look there."""
    detail = manifest["artifacts"][artifact]["required_detail"]
    if detail is None:
        return None
    facts: dict[str, Any] = dict(detail) | {"limit": None, "maps": {}, "seen": []}
    if manifest["artifacts"][artifact]["kind"] == "mesh":
        facts["seen"] = _seen(manifest, artifact)
    if detail["texels"] == 0.0:
        facts["limit"] = _limit(manifest, artifact)
    owner, _, key = artifact.rpartition("_")
    maps = textures.get(owner, [])
    if key != "mesh" and owner and maps and artifact == maps[0]:
        side = _size(folder / manifest["artifacts"][artifact]["file"])
        if side is not None:
            width, height = (size << detail["left_out"] for size in side)
            absent = [name for name in DERIVED if f"{owner}_{name}" not in maps]
            facts["maps"] = {name: chain_bytes(name, width, height) for name in absent}
    return facts


def _seen(manifest: dict[str, Any], artifact: str) -> list[dict[str, float]]:
    """The size in pixels, along the diagonal, at which each level of a mesh after the first takes over, and
    how it then differs from the finest. Empty for other artifacts."""
    found = []
    for item in manifest["objects"]:
        levels = manifest["artifacts"][artifact]["levels"]
        if item["mesh"] != artifact or len(levels) != len(item["lods"]):
            continue
        for lod, level in list(zip(item["lods"], levels, strict=True))[1:]:
            if "seen_p99_deg" in level and lod["error_m"] > 0.0:
                size_px = 2.0 * item["radius_m"] * manifest["lod_error_px"] / lod["error_m"]
                found.append({"size_px": size_px} | {key: level[key] for key in SEEN})
    return found


def _limit(manifest: dict[str, Any], artifact: str) -> str:
    """Why a pixel may cover less than any share of a texel, in words."""
    materials = [
        material
        for item in manifest["objects"]
        for material in item["materials"].values()
        if any(artifact in maps.values() for maps in maps_of_material(material).values())
    ]
    if not materials:
        return "the camera may come as near as it likes"
    if any(
        material["maps"]["height"] is not None and material["parallax_scale"] > 0.0 for material in materials
    ):
        return "parallax may bring two pixels to one texel"
    return "triangles that show a single point of it would change their colour in a coarser one"


def saved_bytes(artifacts: Iterable[dict[str, Any]]) -> dict[str, int]:
    """The bytes that all artifacts together save: `levels` (mips too) and `patches` that no view
    draws, `maps` that no pass reads. artifacts: as in `explain --json`."""
    saved = {"levels": 0, "patches": 0, "maps": 0}
    for facts in artifacts:
        detail, demand = facts["required_detail"], facts["demand"]
        if detail:
            saved["levels"] += detail["saved_bytes"]
            saved["maps"] += sum(detail["maps"].values())
        if demand:  # of the whole terrain, the same for each of its files
            saved["patches"] = demand["left_out_bytes"]
    return saved


SAVED = {
    "levels": "mips and levels of detail that no view draws",
    "patches": "terrain patches that no second needs",
    "maps": "maps that the pictures could give and no pass reads",
}


def saved_words(saved: dict[str, int]) -> str:
    """The bytes saved, as a sentence."""
    parts = [f"{SAVED[name]} ({bytes_text(size)})" for name, size in saved.items() if size]
    return (
        f"not baked, {bytes_text(sum(saved.values()))}: {', '.join(parts)}"
        if parts
        else "nothing was left out"
    )


def chain_bytes(name: str, width: int, height: int) -> int:
    """Bytes of all levels of a map of this size in its smallest format."""
    fmt = MAPS[name].formats[0]
    return sum(level_bytes(fmt, width, height, level) for level in range(full_level_count(width, height)))


def _size(path: Path) -> tuple[int, int] | None:
    """Width and height of a KTX2; None if it cannot be read."""
    try:
        with open_file(path) as file:
            width, height, _ = ktx2_size(file.read(SIZE_BYTES))
    except (OSError, FormatError):
        return None
    return width, height


def _seconds_words(levels_s: list[float | None], what: str) -> list[str]:
    """When each level is first needed; nothing if all are at once."""
    words, first = [], 0
    for second, group in groupby(levels_s):
        last = first + len(list(group)) - 1
        name = f"{what} {first}" if first == last else f"{what}s {first} to {last}"
        words.append(f"{name} never" if second is None else f"{name} from second {second:g} on")
        first = last + 1
    return [f"needed: {', '.join(words)}"] if len(words) > 1 else []


def economy_words(facts: dict[str, Any], kind: str) -> list[str]:
    """The facts of `economy` in words, a line each."""
    words = []
    view = facts["view"]
    if view is None:
        words.append("no view of the flight shows it: only its coarsest level is kept")
    else:
        when = "" if facts["second_s"] is None else f"at second {facts['second_s']:g} "
        what = "level" if kind == "mesh" else "mip"
        line = f"its finest {what} is needed {when}by the {_view(view)}"
        if facts["texels"]:
            line += f", the nearest view: {_texels(facts['texels'])}"
        elif facts["texels"] == 0.0:
            line += f": {facts['limit']}"
        words.append(line)
    words += _seconds_words(facts["levels_s"], "level" if kind == "mesh" else "mip")
    coarser = facts.get("coarser_left_out", 0)
    for count, what, why in (
        (facts["left_out"], "finer", ""),
        (coarser, "coarser", ", which no view of the flight is far enough away to draw"),
    ):
        if count:
            plural = "s are" if count > 1 else " is"
            words.append(f"{count} {what} level{plural} left out{why}")
    if facts["left_out"] or coarser:
        words[-1] += f": {bytes_text(facts['saved_bytes'])} saved"
    if coarser:
        words[-1] += '; lods_by = "screen_size" of the object makes levels that may be drawn nearer'
    for k, level in enumerate(facts["seen"], start=1):
        words.append(
            f"level {k} is drawn where the object is up to {level['size_px']:.3g} pixels large, which turns "
            f"normals by {level['seen_p99_deg']:.2g} degrees, "
            f"changes the silhouette on {level['seen_silhouette']:.2%} "
            f"and the picture by {level['seen_flip']:.2g} of FLIP over its box"
        )
        if level["size_px"] < 0.5 * level["seen_px"]:  # it differs too much at any size
            words[-1] += (
                f" at {level['seen_px']:.3g} pixels already, more than the scene allows: "
                'lods_by = "screen_size" of the object makes levels that are drawn'
            )
    if facts["maps"]:
        names = ", ".join(f"{name} {bytes_text(size)}" for name, size in facts["maps"].items())
        words.append(f"maps of its picture that no pass reads are not baked: {names}")
    return words


def _texels(texels: float) -> str:
    """texels: of the source's finest level, side by side in a pixel."""
    if texels < 1.0:
        return f"a texel of its source is up to {1.0 / texels:.3g} pixels wide"
    return f"a pixel shows at least {texels:.3g} texels of its source side by side"


def _view(view: str) -> str:
    names = {"light": "light's view", "refraction": "view through the water", "mirror": "water's mirror"}
    return names.get(view, view)

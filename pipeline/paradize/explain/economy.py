"""What `paradize explain` tells of a bake's economy: who asked for an artifact's finest level and when, and
how many bytes were saved by not baking more. Knows no numpy."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from paradize.errors import FormatError
from paradize.files import open_file
from paradize.formats.ktx2.layout import full_level_count, level_bytes
from paradize.formats.ktx2.size import SIZE_BYTES, ktx2_size
from paradize.maps import DERIVED, MAPS


def textures_by_owner(manifest: dict[str, Any]) -> dict[str, list[str]]:
    """The textures of each object and surface, in the manifest's order."""
    found: dict[str, list[str]] = {}
    for name, entry in manifest["artifacts"].items():
        if entry["kind"] == "texture":
            found.setdefault(name.rpartition("_")[0], []).append(name)
    return found


def economy(
    manifest: dict[str, Any], folder: Path, artifact: str, textures: dict[str, list[str]]
) -> dict[str, Any] | None:
    """Of an artifact: `left_out` finer levels, `saved_bytes`; `texels` of its level 0 that a pixel covers at
    least, the `second_s` and `view` of that; `limit`: why they are none; `maps`: bytes of those that its
    picture could give and no pass reads, reckoned in their smallest format, told where the picture's first
    artifact is. None where nothing is asked of it by distance. textures: as textures_by_owner tells."""
    asked = manifest["artifacts"][artifact]["asked"]
    if asked is None:
        return None
    told: dict[str, Any] = dict(asked) | {"limit": None, "maps": {}}
    if asked["texels"] == 0.0:
        told["limit"] = _limit(manifest, artifact)
    owner, _, key = artifact.rpartition("_")
    maps = textures.get(owner, [])
    if key != "mesh" and owner and maps and artifact == maps[0]:
        side = _size(folder / manifest["artifacts"][artifact]["file"])
        if side is not None:
            width, height = (size << asked["left_out"] for size in side)
            absent = [name for name in DERIVED if f"{owner}_{name}" not in maps]
            told["maps"] = {name: chain_bytes(name, width, height) for name in absent}
    return told


def _limit(manifest: dict[str, Any], artifact: str) -> str:
    """Why a pixel may cover no texel of a texture, in words."""
    owner = next((item for item in manifest["objects"] if artifact in item.values()), None)
    if owner is None:
        return "the eye may come as near as it likes"
    materials = owner["materials"].values()
    if owner["height"] is not None and any(material["parallax_scale"] > 0.0 for material in materials):
        return "parallax may bring two pixels to one texel"
    return "triangles that show a single point of it would change their colour in a coarser one"


def saved_bytes(artifacts: Iterable[dict[str, Any]]) -> dict[str, int]:
    """What all artifacts together save, in bytes: `levels` and `patches` finer than any view asks for, `maps`
    that no pass reads. artifacts: as `explain` tells them."""
    saved = {"levels": 0, "patches": 0, "maps": 0}
    for told in artifacts:
        asked, demand = told["asked"], told["demand"]
        if asked:
            saved["levels"] += asked["saved_bytes"]
            saved["maps"] += sum(asked["maps"].values())
        if demand:  # of the whole terrain, the same for each of its files
            saved["patches"] = demand["left_out_bytes"]
    return saved


def saved_words(saved: dict[str, int]) -> str:
    """The same in words."""
    total = sum(saved.values())
    parts = [f"{name} {short(size)}" for name, size in saved.items() if size]
    what = f"{short(total)} saved by not baking more: {', '.join(parts)}" if total else "nothing saved"
    return f"all artifacts: {what}"


def chain_bytes(name: str, width: int, height: int) -> int:
    """Bytes of all levels of a map of this size in its smallest format."""
    fmt = MAPS[name].formats[0]
    return sum(level_bytes(fmt, width, height, level) for level in range(full_level_count(width, height)))


def _size(path: Path) -> tuple[int, int] | None:
    """Width and height of a KTX2; None where it cannot be read."""
    try:
        with open_file(path) as file:
            width, height, _ = ktx2_size(file.read(SIZE_BYTES))
    except (OSError, FormatError):
        return None
    return width, height


def economy_words(told: dict[str, Any], kind: str) -> list[str]:
    """The same in words, a line each."""
    words = []
    view = told["view"]
    if view is None:
        words.append("no view of the flight shows it: the coarsest that there is is kept")
    else:
        when = "" if told["second_s"] is None else f"at second {told['second_s']:g} "
        what = "level" if kind == "mesh" else "mip"
        line = f"its finest {what} is asked for {when}by the {_view(view)}"
        if told["texels"]:
            line += (
                f": a pixel covers at least {told['texels']:.3g} texels of the finest that its source gives"
            )
        elif told["texels"] == 0.0:
            line += f": {told['limit']}"
        words.append(line)
    if told["left_out"]:
        plural = "s are" if told["left_out"] > 1 else " is"
        words.append(f"{told['left_out']} finer level{plural} left out: {short(told['saved_bytes'])} saved")
    if told["maps"]:
        names = ", ".join(f"{name} {short(size)}" for name, size in told["maps"].items())
        words.append(f"maps that no pass reads are not made of its picture: {names}")
    return words


def _view(view: str) -> str:
    names = {"light": "light's view", "refraction": "view through the water", "mirror": "water's mirror"}
    return names.get(view, view)


def short(count: int) -> str:
    """Bytes as a person reads them."""
    return f"{count / 1e6:.3g} MB" if count >= 1_000_000 else f"{count / 1e3:.3g} kB"

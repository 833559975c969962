"""Finds where the objects of a scene get their colour: a map that the scene or the materials name, else
the materials' own colours."""

from __future__ import annotations

from pathlib import Path

from paradize.errors import GroupedError, ParadizeError, SceneError
from paradize.files import resolved
from paradize.scene.requirements import MaterialColors
from paradize.scene.settings import Scene


def material_colors_of(
    scene: Scene, scene_path: Path, tried_libraries: list[Path] | None = None
) -> tuple[dict[str, MaterialColors], list[Path], list[Path]]:
    """Returns the colours of each object by name; the files that were read for it; and the files that were
    looked for but do not exist. tried_libraries: takes the MTL files, also of objects that fail. Raises
    SceneError, or GroupedError, for objects whose materials name several colour maps."""
    colors: dict[str, MaterialColors] = {}
    libraries: list[Path] = []
    missing: list[Path] = []
    errors: list[ParadizeError] = []
    for i, item in enumerate(scene.objects):
        if item.color:
            colors[item.name] = MaterialColors(item.color)
            continue
        from paradize.material import base_colors_of
        from paradize.readers.model import read_model

        try:
            read = read_model(item.mesh, resolved(scene_path).parent, tried_libraries)
        except ParadizeError as error:
            errors.append(error)
            continue
        libraries += [item.mesh, *read.libraries]
        missing += read.absent
        used = [read.materials.get(group.material) for group in read.mesh.groups]
        maps = {path for material in used if material and (path := material.picture("color"))}
        if len(maps) < 2:
            own = {} if maps else base_colors_of(read.materials)
            colors[item.name] = MaterialColors(maps.pop() if maps else None, own)
            continue
        what = f"{len(maps)} colour maps are named by the materials of {item.mesh.name}; one is needed"
        mend = "name one in the scene, or join them into one atlas"
        errors.append(SceneError(what, file=scene_path, place=f"object[{i}].color", mend=mend))
    if errors:
        raise GroupedError(errors) if len(errors) > 1 else errors[0]
    return colors, libraries, missing

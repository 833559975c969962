"""What a path given to `paradize check` is: a scene's folder, a scene.json, a GLB, a KTX2 or a PNG."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Sequence
from pathlib import Path

from paradize.check.maps import folder_maps
from paradize.check.meshes import check_mesh
from paradize.check.pictures import SIGNATURE, check_picture
from paradize.check.rules import Finding, gathered, isolated
from paradize.check.scenes import CheckOptions, check_scene
from paradize.check.textures import check_texture
from paradize.documents import SCENE_FILE
from paradize.files import read_file
from paradize.formats.glb.layout import MAGIC
from paradize.formats.ktx2.layout import IDENTIFIER
from paradize.kinds import BAKED, kind_of, mend_of, refusal

_TAKES = "name what was baked: a scene's folder or its scene.json, a GLB, a KTX2 or a PNG"


def check_paths(paths: Sequence[Path], look: CheckOptions | None = None) -> list[Finding]:
    """All findings of all paths, equal ones gathered."""
    how = look or CheckOptions()
    found = [finding for path in paths for finding in isolated(_check(path, how), str(path))]
    if how.against and not any(
        path.name == SCENE_FILE or os.path.lexists(path / SCENE_FILE) for path in paths
    ):
        what = f"nothing is compared with {how.against}: an artifact's errors stand in its {SCENE_FILE}"
        mend = "name the scene's folder, or leave --against out"
        found.append(Finding("PZ101", str(paths[0]), what, mend=mend))
    return gathered(found)


def _check(path: Path, look: CheckOptions) -> Iterator[Finding]:
    try:
        folder = stat.S_ISDIR(path.stat().st_mode)
        inside = sorted(path.iterdir()) if folder else []
    except FileNotFoundError:
        what, mend = refusal(BAKED, path) or ("", "")
        yield Finding("PZ101", str(path), what, mend=mend)
        return
    except OSError as error:
        yield Finding("PZ101", str(path), error.strerror or str(error), mend=_TAKES)
        return
    if folder:
        if path / SCENE_FILE in inside:
            yield from check_scene(path / SCENE_FILE, look)
            return
        files = [file for file in inside if file.suffix in (".glb", ".ktx2", ".png")]
        if not files:
            yield Finding(
                "PZ101", str(path), f"is a folder that holds no {SCENE_FILE}, GLB, KTX2 or PNG", mend=_TAKES
            )
        for file in files:
            yield from isolated(_check(file, look), str(file))
        yield from folder_maps(files)
        return
    if path.name == SCENE_FILE:
        yield from check_scene(path, look)
        return
    try:
        data = read_file(path)
    except OSError as error:
        yield Finding("PZ101", str(path), error.strerror or str(error), mend=_TAKES)
        return
    if path.suffix == ".glb" or data[:4] == MAGIC:
        yield from check_mesh(data, str(path))
    elif path.suffix == ".ktx2" or data[:12] == IDENTIFIER:
        yield from check_texture(data, str(path))
    elif path.suffix == ".png" or data[:8] == SIGNATURE:
        yield from check_picture(data, str(path))
    else:
        kind = kind_of(path)
        what = f"is {kind.name}, no {SCENE_FILE}, GLB, KTX2 or PNG"
        yield Finding("PZ102", str(path), what, mend=mend_of(kind, path) or _TAKES)

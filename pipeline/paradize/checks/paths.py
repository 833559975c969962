"""Checks the paths given to `paradize check`: a scene's folder, a scene.json, a GLB, a KTX2, a PNG, or a
scene's TOML."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Sequence
from pathlib import Path

from paradize.checks.maps import folder_maps
from paradize.checks.meshes import check_mesh
from paradize.checks.pictures import SIGNATURE, check_picture
from paradize.checks.rules import Finding, gathered, isolated
from paradize.checks.scenes import CheckOptions, check_scene
from paradize.checks.settings import check_settings
from paradize.checks.textures import check_texture
from paradize.documents import SCENE_FILE
from paradize.errors import mend_of_reading
from paradize.files import read_file
from paradize.formats.glb.layout import MAGIC
from paradize.formats.ktx2.layout import IDENTIFIER
from paradize.kinds import BAKED, SCENE, kind_of, mend_of, refusal

_ACCEPTED = (
    "name what was baked: a scene's folder or its scene.json, a GLB, a KTX2 or a PNG; or a scene's TOML"
)


def check_paths(paths: Sequence[Path], options: CheckOptions | None = None) -> list[Finding]:
    """All findings of all paths. Equal findings become one with a count."""
    used = options or CheckOptions()
    findings: list[Finding] = []
    for done, path in enumerate(paths):
        used.begin(path.name, done, len(paths))
        findings += isolated(_check(path, used), str(path))
    if used.against and not any(
        path.name == SCENE_FILE or os.path.lexists(path / SCENE_FILE) for path in paths
    ):
        what = f"nothing is compared with {used.against}: errors are compared between two {SCENE_FILE}"
        mend = "name the scene's folder, or leave --against out"
        findings.append(Finding("PZ101", str(paths[0]), what, mend=mend))
    return gathered(findings)


def _check(path: Path, options: CheckOptions) -> Iterator[Finding]:
    try:
        folder = stat.S_ISDIR(path.stat().st_mode)
        inside = sorted(path.iterdir()) if folder else []
        data = b"" if folder or path.name == SCENE_FILE else read_file(path)
    except FileNotFoundError:
        what, mend = refusal(BAKED, path) or ("", "")
        yield Finding("PZ101", str(path), what, mend=mend)
        return
    except OSError as error:
        yield Finding(
            "PZ101", str(path), error.strerror or str(error), mend=mend_of_reading(error) or _ACCEPTED
        )
        return
    if folder:
        yield from _check_folder(path, inside, options)
    elif path.name == SCENE_FILE:
        yield from check_scene(path, options)
    elif path.suffix == ".toml" or kind_of(path) is SCENE:
        yield from check_settings(path, options.scenes)
    else:
        options.checked.add(str(path))
        yield from _check_file(path, data)


def _check_folder(path: Path, inside: list[Path], options: CheckOptions) -> Iterator[Finding]:
    if path / SCENE_FILE in inside:
        yield from check_scene(path / SCENE_FILE, options)
        return
    files = [file for file in inside if file.suffix in (".glb", ".ktx2", ".png")]
    if not files:
        yield Finding(
            "PZ101", str(path), f"is a folder that holds no {SCENE_FILE}, GLB, KTX2 or PNG", mend=_ACCEPTED
        )
    for done, file in enumerate(files):
        options.begin(file.name, done, len(files))
        yield from isolated(_check(file, options), str(file))
    yield from folder_maps(files)


def _check_file(path: Path, data: bytes) -> Iterator[Finding]:
    if path.suffix == ".glb" or data[:4] == MAGIC:
        yield from check_mesh(data, str(path))
    elif path.suffix == ".ktx2" or data[:12] == IDENTIFIER:
        yield from check_texture(data, str(path))
    elif path.suffix == ".png" or data[:8] == SIGNATURE:
        yield from check_picture(data, str(path))
    else:
        kind = kind_of(path)
        what = f"is {kind.name}, no {SCENE_FILE}, GLB, KTX2 or PNG"
        yield Finding("PZ102", str(path), what, mend=mend_of(kind, path) or _ACCEPTED)

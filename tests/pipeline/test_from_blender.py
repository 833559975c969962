"""The page "From Blender": its commands bake what Blender exports, upright, in metres, with its maps."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Callable
from contextlib import chdir
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import paradize as library
from tests.made.blender import BOXES, write_glb, write_obj
from tests.places import ROOT
from tests.sweeps import sweep

PAGE = (ROOT / "pipeline/FROM_BLENDER.md").read_text()
MAPS = {"color", "normal", "gloss", "emission"}
WRITERS = {"glb": write_glb, "obj": write_obj}
Run = Callable[..., Any]


def commands() -> list[list[str]]:
    """The commands of the page, without the program's name."""
    (block,) = re.findall(r"```\n(paradize .*?)```", PAGE, re.DOTALL)
    return [shlex.split(line)[1:] for line in block.splitlines()]


def follow(paradize: Run, folder: Path, suffix: str, model: str = "chair") -> set[str]:
    """Runs the page's commands in a folder that holds the export; returns the baked artifacts' names."""
    for words in commands():
        message = [word.replace("chair.glb", f"{model}.{suffix}") for word in words]
        with chdir(folder):
            done = paradize(*message)
        assert done.returncode == 0, (message, done.stdout, done.stderr)
    names = {path.name for path in (folder / "build/assets/chair").iterdir()}
    return {re.sub(r"-[0-9a-f]{8}\..*", "", name) for name in names}


@pytest.mark.parametrize("suffix", sweep(WRITERS, test=["glb"]))
def test_the_commands_of_the_page_bake_an_export_with_its_maps(
    suffix: str, tmp_path: Path, paradize_here: Run
) -> None:
    WRITERS[suffix](tmp_path / f"chair.{suffix}")
    baked = follow(paradize_here, tmp_path, suffix)
    wanted = MAPS | ({"occlusion"} if suffix == "glb" else set())
    assert {f"chair_{name}" for name in wanted} | {"chair_mesh"} <= baked


@pytest.mark.parametrize("suffix", WRITERS)
def test_an_export_stands_upright_in_metres_and_faces_plus_z(suffix: str, tmp_path: Path) -> None:
    """Blender's X, Y, Z become X, -Z, Y: the chair's back, along Blender's +Y, lies at -Z."""
    mesh = library.mesh(WRITERS[suffix](tmp_path / f"chair.{suffix}")).lods[0].mesh
    low, high = np.min([box[0] for box in BOXES], axis=0), np.max([box[1] for box in BOXES], axis=0)
    np.testing.assert_allclose(mesh.positions.min(axis=0), [low[0], low[2], -high[1]], atol=1e-5)
    np.testing.assert_allclose(mesh.positions.max(axis=0), [high[0], high[2], -low[1]], atol=1e-5)
    above_seat = mesh.positions[mesh.positions[:, 1] > 0.5]
    assert len(above_seat) and (above_seat[:, 2] < -0.1).all()


EXPORTED = (
    "gltf/drake/fully_textured_pyramid/fully_textured_pyramid.gltf",
    "obj-materials/rainbow_box/rainbow_box.obj",
)


@pytest.mark.deep
@pytest.mark.parametrize("name", EXPORTED)
def test_files_that_blender_exported_bake_by_the_page(
    name: str, tmp_path: Path, corpus: Path, paradize_here: Run
) -> None:
    source = corpus / name
    shutil.copytree(source.parent, tmp_path / "in", copy_function=shutil.copyfile)
    baked = follow(paradize_here, tmp_path / "in", source.suffix[1:], source.stem)
    assert any(name.endswith("_mesh") and name != "terrain_mesh" for name in baked)


def test_the_page_names_the_options_as_the_exporters_spell_them() -> None:
    """Keyword arguments of bpy.ops.export_scene.gltf and bpy.ops.wm.obj_export of Blender 4."""
    (script,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert set(re.findall(r"(\w+)=", script)) == {
        "filepath", "export_format", "use_selection", "export_yup", "export_apply", "export_animations",
        "export_selected_objects", "forward_axis", "up_axis", "export_pbr_extensions", "path_mode",
    }  # fmt: skip

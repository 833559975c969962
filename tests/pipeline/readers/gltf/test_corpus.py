"""glTF models of others: what is sound is read whole and baked, what is broken is refused in a line."""

from __future__ import annotations

import json
import logging
import resource
import struct
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from paradize.bakers.mesh.bake import bake_mesh
from paradize.errors import ParadizeError
from paradize.formats.glb.reader import decode_glb
from paradize.readers.gltf.extensions import LEFT_OUT, READ
from paradize.readers.model import Model, read_model

# Broken on purpose, by the page of the corpus, and old versions.
ODD = ("invalid", "Mesh_PrimitiveRestart", "Mesh_NoPosition", "box-1.0", "box-textured-binary-1.0")
MOST_BYTES = 200_000  # of a model of the sample


def models(corpus: Path) -> list[Path]:
    return [path for path in sorted((corpus / "gltf").rglob("*")) if path.suffix in (".glb", ".gltf")]


def tree_of(path: Path) -> Any:
    """The JSON of a model, read without the reader; None where there is none."""
    data = path.read_bytes()
    if data[:4] == b"glTF" and len(data) >= 20:
        data = data[20 : 20 + struct.unpack_from("<I", data, 12)[0]]
    try:
        return json.loads(data)
    except ValueError:
        return None


def has_surface(tree: Any) -> bool:
    """Whether a node shows triangles, of a version and with extensions that may be read."""
    if tree["asset"] in ([], {}) or tree["asset"]["version"] != "2.0" or "buffers" not in tree:
        return False
    if set(tree.get("extensionsRequired", ())) - READ - LEFT_OUT.keys():
        return False
    shown = [node["mesh"] for node in tree.get("nodes", ()) if "mesh" in node]
    primitives = [one for mesh in shown for one in tree["meshes"][mesh]["primitives"]]
    return any(
        one.get("mode", 4) >= 4
        and "POSITION" in one["attributes"]
        and tree["accessors"][one["attributes"]["POSITION"]]["count"] > 2
        for one in primitives
    )


def sound(corpus: Path) -> list[Path]:
    found = [path for path in models(corpus) if not {*ODD} & {*path.parts}]
    return [path for path in found if isinstance(tree := tree_of(path), dict) and has_surface(tree)]


def bake_or_refuse(path: Path) -> bool:
    try:
        made = bake_mesh(path, lods=2, tangent_tiers=False)
    except ParadizeError as error:
        assert str(path) in str(error) and "\n" not in str(error) and len(str(error)) < 1500
        return False
    assert all(level.mesh.normals is not None for level in decode_glb(made.glb))
    return True


def test_a_sample_of_sound_models_is_baked(corpus: Path) -> None:
    chosen = [path for path in sound(corpus) if path.stat().st_size < MOST_BYTES][::20]
    refused = [path for path in chosen if not bake_or_refuse(path)]
    assert len(chosen) > 8 and not refused


@pytest.mark.deep
def test_at_least_95_percent_of_sound_models_are_baked(corpus: Path) -> None:
    chosen = sound(corpus)
    refused = [path for path in chosen if not bake_or_refuse(path)]
    assert len(refused) <= 0.05 * len(chosen), refused


def same_as_trimesh(path: Path, model: Model) -> bool | None:
    """Whether trimesh reads as many triangles, of the same area in the same place; None for what it does not
    read: skins, morph targets, instances, sparse accessors, packed ones."""
    tree = tree_of(path)
    used = {*tree.get("extensionsUsed", ())}
    if "skins" in tree or any(word in json.dumps(tree) for word in ('"targets"', '"sparse"')):
        return None
    if used & {"EXT_mesh_gpu_instancing", "EXT_meshopt_compression", "KHR_mesh_quantization"}:
        return None
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            theirs = trimesh.load(path, process=False, force="scene").dump()
    except (KeyError, IndexError, ValueError):
        return None
    finally:
        logging.disable(logging.NOTSET)
    parts = [part for part in theirs if isinstance(part, trimesh.Trimesh)]
    if not parts:
        return None
    corners = model.source.positions[model.mesh.triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * float(np.linalg.norm(cross, axis=1).sum())
    low = np.min([part.bounds[0] for part in parts], axis=0)
    high = np.max([part.bounds[1] for part in parts], axis=0)
    off = np.abs([corners.min(axis=(0, 1)) - low, corners.max(axis=(0, 1)) - high]).max()
    return (
        sum(len(part.faces) for part in parts) == len(model.mesh.triangles)
        and abs(sum(part.area for part in parts) - area) <= 1e-4 * area
        and off <= 1e-5 * float(np.abs(high - low).max())
    )


@pytest.mark.deep
def test_the_surface_is_where_trimesh_puts_it(corpus: Path) -> None:
    compared = 0
    for path in sound(corpus):
        if path.stat().st_size < MOST_BYTES:
            same = same_as_trimesh(path, read_model(path))
            assert same is not False, path
            compared += bool(same)
    assert compared > 100


@pytest.mark.deep
def test_no_broken_model_crashes_hangs_or_fills_the_screen(corpus: Path) -> None:
    """One process with limits reads all of them, so that what the reader loads is loaded once."""
    code = (
        "import sys\nfrom pathlib import Path\nfrom paradize.errors import ParadizeError\n"
        "from paradize.readers.model import read_model\n"
        "for line in sys.stdin.read().splitlines():\n"
        "    try:\n        read_model(Path(line)); text = 'read'\n"
        "    except ParadizeError as error:\n        text = str(error)\n"
        "    assert text == 'read' or line.rpartition('/')[0] in text, line\n"
        "    assert '\\n' not in text and len(text) < 1500 and text.isprintable(), line\n"
        "    print(text)\n"
    )

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
        resource.setrlimit(resource.RLIMIT_CPU, (120, 120))

    files = [path for path in models(corpus) if "invalid" in path.parts]
    files += sorted(path for path in (corpus / "malformed").rglob("*") if path.is_file())
    done = subprocess.run(
        [sys.executable, "-c", code],
        input="\n".join(map(str, files)),
        capture_output=True,
        text=True,
        preexec_fn=limited,
        timeout=900,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert len(done.stdout.splitlines()) == len(files)

"""The same bytes and errors on a processor without wide vectors.

GLIBC_TUNABLES narrows libc and libm, NPY_DISABLE_CPU_FEATURES numpy. Our kernels ask the processor itself,
through libgcc's table of features, which neither reaches. So they are copied, and every `cpuid` in the copies
becomes `xor eax, eax`: the processor then knows no leaf beyond 0, hence no feature, and every dispatch takes
its baseline.
"""

from __future__ import annotations

import io
import json
import os
import platform
import re
import shutil
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pytest

from paradize.kernels.normals import widths
from tests.pipeline.heights import normals, waves
from tests.pipeline.own_package import kernels
from tests.pipeline.scenes import ball, make_cove, write_image
from tests.pipeline.shapes import CORNER_OBJ
from tests.places import ROOT
from tests.sweeps import sweep

LESSER = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA",
}
CPUID = b"\x0f\xa2"
# Python runs it as it starts, in every worker too.
FINDER = """
import importlib.util, sys
from pathlib import Path

class Narrow:
    def find_spec(self, name, path=None, target=None):
        file = Path(__file__).parent / name.rpartition(".")[2]
        if name.startswith("paradize.kernels.") and file.exists():
            return importlib.util.spec_from_file_location(name, file / "kernel.so")

sys.meta_path.insert(0, Narrow())
"""
# Layouts are made in the script's own process: each would start another. Kernels do for 5,000 points what
# they do for 50,000.
BAKERS = """
import hashlib, json, sys
from pathlib import Path
from paradize.bakers.mesh import atlas, lods
atlas.call_isolated = lambda name, call, arguments, **limits: call(**arguments)
lods._SAMPLES = 5_000
from paradize.bakers.authored.bake import bake_authored
from paradize.bakers.color import bake_color
from paradize.bakers.maps.bake import bake_maps
from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.terrain.mesh import bake_terrain
from paradize.scene.baker_settings import TerrainSettings
from paradize.stages.unwrappers import unwrapper_version
from paradize.tiers import UNWRAPPERS

folder, made_files, tiers = Path(sys.argv[1]), {}, sys.argv[2:]
for tier in tiers:
    mesh = bake_mesh(folder / "post.obj", tier=tier, lods=3)
    assert len(mesh.report["lods"]) == 3  # by each tier's simplifier, with seams
    mesh.report.pop("seconds", None)
    made_files[f"mesh {tier}"] = mesh.glb, mesh.report
    size = {"size_m": (20.0, 30.0), "height_m": 4.0, "max_error_m": 0.02}
    made = bake_terrain(folder / "height.png", TerrainSettings(**size), tier=tier)
    made_files[f"terrain {tier}"] = made.glb, [made.max_error_m, made.rms_error_m]
    relief = bake_maps(folder / "relief.png", source="height", wrap="repeat", tier=tier, destep=True)
    made = bake_maps(folder / "wood.png", strength=5.0, tier=tier, uv=folder / "post.obj")
    made |= {f"height {name}": map for name, map in relief.items()}
    made["color"] = bake_color(folder / "wood.png", tier=tier)
    files = {"normal": "normal", "roughness": "wood", "occlusion": "relief", "metalness": "wood"}
    drawn = {role: folder / f"{name}.png" for role, name in files.items()}
    drawn = bake_authored(drawn, tier=tier, uv=folder / "post.obj", normal_scale=1.7)
    made |= {f"drawn {name}": map for name, map in drawn.items()}
    cast = bake_authored({}, tier=tier, uv=folder / "corner.obj", occlusion_cast=True, occlusion_px=64)
    made["cast"] = cast["occlusion"]
    for name, map in made.items():
        rest = [map.errors if name == "cast" else {}, map.levels, map.warnings]
        made_files[f"{name} {tier}"] = map.data, [map.filter if name == "normal" else "", *rest]
unwrappers = [name for name in UNWRAPPERS if name == "paradize" or unwrapper_version(name)]
for name in unwrappers:
    bare = bake_mesh(folder / "bare.obj", atlas=True, lods=2, unwrapper=name)
    bare.report.pop("seconds", None)
    made_files[f"atlas {name}"] = bare.glb, bare.report
assert len(made_files) == len(tiers) * (2 + 4 + 4 + 1 + 3 + 1) + len(unwrappers)
print(json.dumps({k: [hashlib.sha256(data).hexdigest(), rest] for k, (data, rest) in made_files.items()}))
"""
SCENE = """
import hashlib, json, sys
from pathlib import Path
from paradize.build.bake import bake
from paradize.build.options import BuildOptions

out = Path(sys.argv[2])
report = bake(Path(sys.argv[1]) / "cove.toml", out, BuildOptions(jobs=1, force=True))
assert not report.errors, report.errors
files = {file.name: file.read_bytes() for file in sorted(out.iterdir())}
print(json.dumps({name: hashlib.sha256(data).hexdigest() for name, data in files.items()}))
"""
# The widths of vectors on a line, then what no bake above asks of the kernels.
KERNELS = """
import hashlib
import numpy as np
from paradize.kernels import filter as kernel
from paradize.kernels.normals import widths
from paradize.stages.filters import TAPS
from paradize.scene.baker_settings import TerrainSettings
from tests.pipeline.metrics.test_map_metrics import measured

print(widths())
rng = np.random.default_rng(0)
heights = (rng.integers(0, 256, (150, 131)) / 255).astype(np.float32)
taps = [(t.derivative, t.smooth) for t in TAPS.values()]
print(kernel.predict_errors(heights, taps, source_bits=8, wrap=(True, True)))
print(hashlib.sha256(kernel.destep(heights, step=1 / 255, wrap=(True, False)).tobytes()).hexdigest())
print(measured(2))
"""


def narrowed(folder: Path) -> Path:
    """A folder for PYTHONPATH with copies of the kernels that find no feature of the processor."""
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(FINDER)
    files = kernels()
    dispatching = 0
    for file in files:
        data = bytearray(file.read_bytes())
        found = []
        first, last = data.find(CPUID), data.rfind(CPUID)
        if first >= 0:  # a cpuid, or a part of something else
            # From some instructions before it on: to list all takes ten times as long.
            span = f"--start-address={max(0, first - 1024)} --stop-address={last + 32}"
            listing = f'objdump -d --no-show-raw-insn {span} "$0" | {{ grep -w cpuid || true; }}'
            call = ["bash", "-o", "pipefail", "-c", listing, file]
            found = subprocess.run(call, capture_output=True, text=True, check=True).stdout.splitlines()
        for line in found:
            at = int(line.partition(":")[0], 16)
            assert data[at : at + 2] == CPUID  # code lies in the file where it lies in memory
            data[at : at + 2] = b"\x31\xc0"
            dispatching += 1
        own = folder / file.name.partition(".")[0]
        own.mkdir()
        (own / "kernel.so").write_bytes(data)
    assert len(files) >= 12 and dispatching
    return folder


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_cove(tmp_path_factory.mktemp("sources") / "cove").parent
    rng = np.random.default_rng(4)
    write_image(folder / "wood.png", rng.integers(0, 256, (140, 268, 3), np.uint8))
    rough = waves(96, 133, 5) * 9000 + rng.normal(0, 300, (96, 133)) + 32768
    write_image(folder / "height.png", rough.clip(0, 65535).astype(np.uint16)[:, :, None])
    write_image(
        folder / "relief.png", (waves(150, 260, 3) * 30 + 128).clip(0, 255).astype(np.uint8)[:, :, None]
    )
    vectors = normals(waves(96, 133, 7), scale=(0.4, 0.4)) * 127.5 + 127.5
    write_image(folder / "normal.png", np.rint(vectors).astype(np.uint8))
    text = ball(16)
    (folder / "post.obj").write_text(text)
    bare = [line for line in text.splitlines() if not line.startswith("vt ")]
    (folder / "corner.obj").write_text(CORNER_OBJ)
    (folder / "bare.obj").write_text("\n".join(re.sub(r"/\d+", "", line) for line in bare) + "\n")
    return folder


@pytest.fixture(scope="module")
def lesser(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of such a processor."""
    if platform.machine() != "x86_64" or widths() == ["widest", "baseline"]:
        pytest.skip("this processor has nothing to switch off")
    if shutil.which("objdump") is None:
        pytest.skip("no objdump: install binutils")
    features = np._core._multiarray_umath.__cpu_features__
    known = [name for name in LESSER["NPY_DISABLE_CPU_FEATURES"].split() if features.get(name)]
    path = f"{narrowed(tmp_path_factory.mktemp('narrow') / 'kernels')}:{ROOT}"
    return LESSER | {"NPY_DISABLE_CPU_FEATURES": " ".join(known), "PYTHONPATH": path}


def said(script: str, environment: dict[str, str], *arguments: object) -> str:
    """A script's output; warnings are errors."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=ROOT,
        env={**os.environ, **environment},
    )
    assert done.returncode == 0 and not done.stderr, done.stderr
    assert len(done.stdout) > 64
    return done.stdout


Lines = list[str]


def said_on_both(script: str, lesser: dict[str, str], *arguments: object) -> tuple[Lines, Lines]:
    """The lines that a script prints on the lesser processor, and on this one."""
    narrow, wide = (said(script, environment, *arguments) for environment in (lesser, {}))
    return narrow.splitlines(), wide.splitlines()


@pytest.fixture(scope="module")
def fast(sources: Path, lesser: dict[str, str]) -> tuple[Lines, Lines]:
    """KERNELS, and on the last line BAKERS of the tier `fast`: one process for all, since each loads both. On
    this processor in this process, which has loaded them."""
    narrow = said(KERNELS + BAKERS, lesser, sources, "fast")
    wide = io.StringIO()
    with redirect_stdout(wide), pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["-c", str(sources), "fast"])
        for name in ("atlas.call_isolated", "lods._SAMPLES"):  # which the script sets, and which go back
            patch.setattr(f"paradize.bakers.mesh.{name}", None)
        exec(KERNELS + BAKERS, {"__name__": "__main__"})
    return narrow.splitlines(), wide.getvalue().splitlines()


def test_the_lesser_processor_has_no_wide_vectors(fast: tuple[Lines, Lines]) -> None:
    assert fast[0][0] == "['widest', 'baseline']" != fast[1][0]


@pytest.mark.parametrize("tiers", sweep([["fast"], ["balanced", "exact"]], test=[["fast"]]))
def test_every_baker_gives_the_same_bytes_and_errors(
    sources: Path, lesser: dict[str, str], fast: tuple[Lines, Lines], tiers: list[str]
) -> None:
    found = fast if tiers == ["fast"] else said_on_both(BAKERS, lesser, sources, *tiers)
    narrow, wide = (json.loads(lines[-1]) for lines in found)
    assert narrow == wide


@pytest.mark.deep
def test_a_scene_is_the_same_bytes(sources: Path, lesser: dict[str, str], tmp_path: Path) -> None:
    wide, narrow = (
        said(SCENE, environment | {"PARADIZE_STORE": str(tmp_path / "store")}, sources, tmp_path / name)
        for name, environment in (("wide", {}), ("narrow", lesser))
    )
    assert json.loads(narrow) == json.loads(wide)


def test_kernels_give_the_same_bits_and_metrics(fast: tuple[Lines, Lines]) -> None:
    narrow, wide = (lines[1:-1] for lines in fast)
    assert len(wide) >= 3 and narrow == wide

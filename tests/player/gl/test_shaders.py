"""Every shader compiles for the desktop and for the web, and its includes exist."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

import pytest

SHADERS = Path(__file__).resolve().parents[3] / "shaders"
BODIES = sorted(path.name for pattern in ("*.vert", "*.frag") for path in SHADERS.glob(pattern))
PREAMBLES = {
    "330": "#version 330 core\n",
    "300 es": "#version 300 es\n"
    + "".join(
        f"precision highp {what};\n"
        for what in ("float", "int", "sampler2D", "samplerCube", "sampler2DArray", "sampler2DArrayShadow")
    ),
}
VARIANTS = [
    f"ALPHA_MODE {mode}\n#define VERTEX_COLORS {colors}\n#define SWAY {sway}"
    for mode in range(3)
    for colors in (0, 1)
    for sway in (0, 1)
]
VARIANTS += [
    f"ALPHA_MODE 1\n#define ALPHA_TAPS {taps}\n#define COLOR_MAP {has}" for taps in (1, 4) for has in (0, 1)
]
# Parts of the object's shader that are left out where a material has none of them.
LEAST = (
    "COLOR_MAP 0",
    "NORMAL_MAP 0",
    "GLOSS_MAP 0",
    "OCCLUSION_MAP 0",
    "EMISSION_MAP 0",
    "DRY 1",
    "MATTE 1",
)
VARIANTS += ["\n#define ".join(LEAST), "SECOND_UV 1", "VERTEX_COLORS 2"]
VARIANTS.append("ALPHA_MODE 1\n#define VERTEX_COLORS 1\n#define SWAY 1\n#define BEAT 1")
VARIANTS += [f"VERTEX_LIT 1\n#define ALPHA_MODE {mode}\n#define POINT_LIGHTS 1" for mode in (0, 1)]
VARIANTS += ["POINT_LIGHTS 1", "POINT_LIGHTS 1\n#define SWAY 1\n#define BEAT 1"]
# Of the terrain's shader: patches that fade, those wholly above or below the water, and scenes with few maps.
VARIANTS += ["FADE 1", "DRY 1", "SUNKEN 1\n#define MATTE 1", "SUNKEN 1\n#define SAND 0"]
VARIANTS += ["SAND_NORMAL 0", "EFFECT_MAP 0", "SAND_NORMAL 0\n#define EFFECT_MAP 0"]
VARIANTS += ["IN_WATER 1", "TRANSLUCENT 0"]
STEPS = [f"PARALLAX_STEPS {i}" for i in (0, 1, 24, 128)]  # the values that player/scene/quality.cpp sets
SHADOWS = [f"SHADOW_FILTER {i}\n#define SHADOW_CASCADES {n}" for i in range(4) for n in (1, 3)]
INCLUDE = re.compile(r'^#include "(lib/[a-z0-9_]+\.glsl)"$')


def expand(name: str, seen: set[str]) -> list[str]:
    """Lines of a shader with its includes resolved, each once."""
    lines: list[str] = []
    for line in (SHADERS / name).read_text().splitlines():
        match = INCLUDE.match(line)
        if match is None:
            assert not line.startswith("#include"), f"{name}: {line}"
            lines.append(line)
        elif match[1] not in seen:
            seen.add(match[1])
            lines += expand(match[1], seen)
    return lines


def errors(sources: dict[str, str], folder: Path) -> str:
    """The errors of glslangValidator, each shader's after its name, or an empty text. sources: by what
    distinguishes them, ending with the stage. One process looks at all, since its start takes longer than a
    shader."""
    files = []
    for name, source in sources.items():
        files.append(folder / re.sub("[^A-Za-z0-9_.]+", " ", name))
        files[-1].write_text(source)
    assert len(set(files)) == len(sources)
    result = subprocess.run(["glslangValidator", *files], capture_output=True, text=True, timeout=300)
    if result.returncode == 0:
        return ""
    # Shaders without a fault are named too.
    return "".join(re.findall(r"[^/\n]+\n(?:ERROR.*\n)+", result.stdout)) or f"failed: {result.stdout}"


def switched(name: str, version: str, switches: Iterable[str]) -> dict[str, str]:
    """A shader's sources, each with one of these lines behind `#define`."""
    body = "\n".join(expand(name, set())) + "\n"
    return {f"{switch}.{name}": f"{PREAMBLES[version]}#define {switch}\n{body}" for switch in switches}


@pytest.fixture(autouse=True)
def _validator() -> None:
    if shutil.which("glslangValidator") is None:
        pytest.skip("no glslangValidator: `make setup-test` brings it")


@pytest.mark.parametrize("version", PREAMBLES)
def test_every_shader_compiles_for_desktop_and_web(version: str, tmp_path: Path) -> None:
    sources = {name: PREAMBLES[version] + "\n".join(expand(name, set())) + "\n" for name in BODIES}
    assert errors(sources, tmp_path) == ""


@pytest.mark.parametrize("version", PREAMBLES)
@pytest.mark.parametrize("name", ["object.frag", "terrain.frag", "water.frag"])
def test_every_quality_compiles_for_desktop_and_web(name: str, version: str, tmp_path: Path) -> None:
    assert "SHADOW_FILTER" in "".join(expand(name, set()))
    assert errors(switched(name, version, ["SWASH 1", "SKY_LIGHT 0", *SHADOWS, *STEPS]), tmp_path) == ""


@pytest.mark.parametrize("version", PREAMBLES)
def test_the_sea_with_ripples_and_lifted_by_waves_compiles_for_desktop_and_web(
    version: str, tmp_path: Path
) -> None:
    sources = switched("water.frag", version, ["RIPPLES 1"]) | switched(
        "water.vert", version, ["NEAR_WAVES 1"]
    )
    (rippled, lifted) = sources.values()
    assert "u_rings" in rippled and "u_wave_shares" in lifted
    assert errors(sources, tmp_path) == ""


@pytest.mark.parametrize("version", PREAMBLES)
@pytest.mark.parametrize("name", ["object.vert", "object.frag", "depth.vert", "depth.frag"])
def test_every_kind_of_material_compiles_for_desktop_and_web(name: str, version: str, tmp_path: Path) -> None:
    kinds = [f"INSTANCED 1\n#define {variant}" for variant in VARIANTS]
    assert errors(switched(name, version, kinds), tmp_path) == ""


def test_a_broken_shader_among_others_is_reported(tmp_path: Path) -> None:
    whole = PREAMBLES["330"] + "void main() { gl_Position = vec4(1.0); }\n"
    broken = whole.replace("vec4", "vec3")
    sources = {"whole.vert": whole, "broken.vert": broken, "last.vert": whole}
    told = errors(sources, tmp_path).splitlines()
    assert told[0] == "broken.vert" and told[1].startswith("ERROR: ") and "last.vert" not in told
    del sources["broken.vert"]
    assert errors(sources, tmp_path) == ""


@pytest.mark.parametrize(
    "name", [*BODIES, *(f"lib/{path.name}" for path in sorted(SHADERS.glob("lib/*.glsl")))]
)
def test_no_shader_uses_features_that_one_language_lacks(name: str) -> None:
    text = re.sub(r"//.*", "", (SHADERS / name).read_text())
    for word in ("#version", "precision ", "textureGather", "layout(binding", "double ", "textureQueryLod"):
        assert word not in text, f"{name} uses {word}"


@pytest.mark.parametrize("name", BODIES)
def test_no_stage_reads_more_textures_than_every_device_has(name: str) -> None:
    """Both languages promise 16 to each stage. All branches count, so no set of macros needs more."""
    lines = "\n".join(expand(name, set()))
    textures = set(re.findall(r"^\s*uniform\s+\w*sampler\w+\s+(\w+);", lines, re.MULTILINE))
    assert len(textures) <= 16, sorted(textures)


def test_every_library_is_used_and_named_in_the_readme() -> None:
    used: set[str] = set()
    for name in BODIES:
        expand(name, used)
    there = {f"lib/{path.name}" for path in SHADERS.glob("lib/*.glsl")}
    assert used == there
    readme = (SHADERS / "README.md").read_text()
    for path in there:
        assert f"`{Path(path).stem}`" in readme, f"shaders/README.md does not name {path}"

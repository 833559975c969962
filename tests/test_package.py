"""`pip install .` and `make wheel`: what the package needs, what its source package and its wheel hold."""

from __future__ import annotations

import ast
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import zipfile
from collections.abc import Iterator, Sequence
from importlib.metadata import packages_distributions, version
from pathlib import Path

import pytest

from tests.made import make_sources
from tests.places import ROOT

PACKAGE = ROOT / "pipeline/paradize"
STUBS = set(PACKAGE.glob("kernels/*/_*.pyi"))  # for the check of the package's own types


def named(requirement: str) -> str:
    """The name of a requirement such as `NumPy>=2.0`, as registries compare it."""
    name = re.match(r"[\w.-]+", requirement)
    assert name is not None
    return re.sub(r"[-_.]+", "-", name[0]).lower()


def statements(block: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """All statements of a block, those inside others too. No expression holds one."""
    for statement in block:
        yield statement
        for field in ("body", "orelse", "finalbody", "handlers", "cases"):
            yield from statements(getattr(statement, field, ()))


def imported() -> set[str]:
    """The first names of all modules of others that the package imports, wherever it does."""
    found = {"paradize", *sys.stdlib_module_names}
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text()
        if found.issuperset(re.findall(r"^\s*(?:import|from) +(\w+)", text, re.M)):
            continue  # to parse all takes a second
        for node in statements(ast.parse(text).body):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                found.add(node.module.partition(".")[0])
    return found - {"paradize", *sys.stdlib_module_names}


def test_each_package_that_the_code_imports_is_named_as_a_dependency() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    expected = {named(each) for each in project["dependencies"]}
    optional = {named(each) for extra in project["optional-dependencies"].values() for each in extra}
    names = packages_distributions() | {"dask": ["distributed"]}  # which needs it
    others = imported()
    names |= {name: [name] for name in others - names.keys()}
    assert {
        name for name in others if not {named(each) for each in names[name]} & (expected | optional)
    } == set()
    used = {named(each) for name in others for each in names[name]}
    assert expected - used == set(), "named, and nothing imports it"


BUILD = """
import sys
from scikit_build_core.build import build_sdist, build_wheel
build_sdist(sys.argv[1])
build_wheel(sys.argv[2], {"wheel.cmake": "false"})
"""


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The source package, and a wheel without the compiled kernels: what Python files and data go in is
    decided without compiling. Our build/ holds tens of thousands of files, which are all looked at: this
    checkout's holds one."""
    folder = tmp_path_factory.mktemp("packages")
    checkout = folder / "checkout"
    (checkout / "build").mkdir(parents=True)
    (checkout / "build/CMakeCache.txt").touch()
    (checkout / ".gitignore").symlink_to(ROOT / ".gitignore")
    for path in ROOT.iterdir():
        if path.name != "build" and not path.name.startswith("."):
            if path.is_dir():
                (checkout / path.name).symlink_to(path)
            else:
                shutil.copy(path, checkout)  # a link would be packed as one
    call = [sys.executable, "-c", BUILD, folder / "sdist", folder / "wheel"]
    subprocess.run(call, cwd=checkout, check=True, capture_output=True)
    (source,), (wheel,) = (folder / "sdist").iterdir(), (folder / "wheel").iterdir()
    return source, wheel


@pytest.fixture(scope="module")
def source_package(packages: tuple[Path, Path]) -> Path:
    return packages[0]


def test_the_source_package_holds_the_pipeline_alone(source_package: Path) -> None:
    assert source_package.stat().st_size < 1_200_000  # the island has 18 MB
    with tarfile.open(source_package) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {name for name in names if not name.startswith("pipeline/")} == {
        "pyproject.toml", "CMakeLists.txt", "LICENSE", "README.md", "PKG-INFO",
    }  # fmt: skip
    sources = {path for path in PACKAGE.rglob("*.[chp]*") if path.suffix != ".pyc"} - STUBS
    assert sources and {str(path.relative_to(ROOT)) for path in sources} - names == set()


@pytest.mark.deep
def test_the_source_package_installs_into_an_empty_environment_and_makes_maps(
    source_package: Path, tmp_path: Path
) -> None:
    """With the newest build tools, and without OpenMesh, whose sources `make setup` fetches."""
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    pip = [tmp_path / "venv/bin/pip", "--disable-pip-version-check", "install"]
    environment = os.environ | {"SKBUILD_CMAKE_DEFINE": "CMAKE_DISABLE_FIND_PACKAGE_OpenMesh=ON"}
    result = subprocess.run(
        [*pip, "-v", source_package], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr
    assert "OpenMesh is not found: built without it" in result.stdout + result.stderr
    photo = make_sources(tmp_path / "made") / "textures/photo.png"
    command = [tmp_path / "venv/bin/paradize", "maps", photo, "-o", tmp_path / "maps"]
    made = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert made.returncode == 0, made.stdout + made.stderr
    assert len(list((tmp_path / "maps").glob("*.ktx2"))) == 4


@pytest.fixture(scope="module")
def pure_wheel(packages: tuple[Path, Path]) -> Path:
    return packages[1]


def test_the_wheel_holds_types_and_fields_and_no_sources_of_kernels(pure_wheel: Path) -> None:
    with zipfile.ZipFile(pure_wheel) as archive:
        names = {name for name in archive.namelist() if not name.partition("/")[0].endswith(".dist-info")}
    assert all(name.startswith("paradize/") for name in names), "tests or scripts"
    files = {path for path in PACKAGE.rglob("*.py*") if path.suffix != ".pyc"} - STUBS
    expected = {str(path.relative_to(PACKAGE.parent)) for path in files}
    expected -= {"paradize/kernels/digest.py"}  # runs while a kernel is built
    expected |= {"paradize/py.typed", "paradize/scene/FIELDS.md"}
    expected |= {str(path.relative_to(PACKAGE.parent)) for path in PACKAGE.rglob("*.toml")}  # new's templates
    assert expected - names == set()
    assert {Path(name).suffix for name in names} == {".py", ".pyi", ".typed", ".md", ".toml"}


def test_the_wheel_makes_the_schema_that_it_does_not_hold(pure_wheel: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(pure_wheel) as archive:
        archive.extractall(tmp_path / "installed")
    # Without site, whose hook would find the package of this checkout.
    code = "import sys; sys.path[:0] = sys.argv[1:]; from paradize.scene import reference; "
    code += "print(reference.__file__); print(reference.schema_text(), end='')"
    command = [sys.executable, "-S", "-c", code, tmp_path / "installed", sysconfig.get_path("purelib")]
    made = subprocess.run(command, check=True, capture_output=True, text=True, cwd=tmp_path)
    place, _, text = made.stdout.partition("\n")
    assert Path(place).is_relative_to(tmp_path)
    assert text == (PACKAGE / "scene/scene.schema.json").read_text()


BAKES = """
import sys, paradize
assert "site-packages" in paradize.__file__
for method in ("paradize", "meshoptimizer", "openmesh"):
    made = paradize.mesh(sys.argv[1], paradize.MeshSettings(lods=2, simplifier=method))
    assert len(made.lods) == 2 and made.lods[1].mesh.triangles.shape[0] < made.lods[0].mesh.triangles.shape[0]
"""


@pytest.mark.deep
def test_the_wheel_bakes_in_an_empty_environment_without_a_compiler(tmp_path: Path) -> None:
    """Two wheels: meshoptimizer is published as source only, so its wheel is built beside."""
    result = subprocess.run(["make", "wheel"], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    (wheel,) = (ROOT / "build/wheel").glob("paradize-*.whl")
    python = "cp{0}{1}-cp{0}{1}".format(*sys.version_info)
    assert wheel.name == f"paradize-{version('paradize')}-{python}-linux_{platform.machine()}.whl"
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    pip = [tmp_path / "venv/bin/pip", "--disable-pip-version-check", "install", "--only-binary", ":all:"]
    result = subprocess.run(
        [*pip, "--find-links", wheel.parent, wheel], cwd=tmp_path, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr
    made = make_sources(tmp_path / "made")
    model = made / "obj-kits/made/barrel.obj"
    program = str(tmp_path / "venv/bin/paradize")
    for command in (
        [program, "maps", made / "textures/photo.png", "-o", "maps"],
        [tmp_path / "venv/bin/python", "-c", BAKES, model],
        [program, "new", "mine", "--from", model],
        [program, "bake", "mine/scene.toml", "-o", "baked"],
        [program, "check", "baked"],
    ):
        result = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
        assert result.returncode == 0, result.stdout + result.stderr
    assert len(list((tmp_path / "maps").glob("*.ktx2"))) == 4

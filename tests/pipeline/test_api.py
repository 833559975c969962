"""`import paradize`: the page of the library runs as it stands, its results are those of the command line."""

from __future__ import annotations

import builtins
import inspect
import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

import paradize
from paradize import api
from paradize.errors import ArgumentError, GroupedError, SceneError, SourceError
from paradize.formats.png import encode_png
from paradize.metrics.mapped_normal import SAMPLES
from paradize.scene.setting_rules import RULES, require_right
from tests.made.models import kit
from tests.made.pictures import field, photograph
from tests.pipeline.scenes import make_cove, tone
from tests.pipeline.shapes import CORNER_OBJ
from tests.places import ROOT

PAGE = ROOT / "pipeline/LIBRARY.md"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sources that the page names."""
    folder = tmp_path_factory.mktemp("library")
    (folder / "rock.obj").write_text(next(iter(kit().values())))
    (folder / "nook.obj").write_text(CORNER_OBJ)
    (folder / "sand.png").write_bytes(encode_png(photograph(64, 64, 3)))
    heights = field(65, 65, 2)
    span = (heights - heights.min()) / (heights.max() - heights.min())
    (folder / "dunes.png").write_bytes(encode_png((span * 65535).astype(np.uint16)[..., None]))
    make_cove(folder / "scene").rename(folder / "scene/scene.toml")
    return folder


def test_the_page_of_the_library_calls_what_there_is_with_arguments_that_there_are() -> None:
    """Nothing is baked: each call is held against its function, each result has only what that gives."""
    (script,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    called = []

    class Library:
        def __getattr__(self, name: str) -> Any:
            real = getattr(paradize, name)
            return real if isinstance(real, type) else lambda *given, **more: call(real, *given, **more)

    def call(real: Callable[..., Any], *given: Any, **more: Any) -> Any:
        inspect.signature(real).bind(*given, **more)
        called.append(real.__name__)
        told = str(inspect.signature(real).return_annotation).partition("[")[0]
        kind = getattr(builtins, told, None) or getattr(sys.modules[real.__module__], told, None) or dict
        own = [field.name for field in fields(kind)] if is_dataclass(kind) else []
        return MagicMock(spec=[*dir(kind), *own])

    exec(script.replace("import paradize\n", ""), {"paradize": Library(), "print": lambda *_: None})
    assert called == ["mesh", "maps", "occlusion", "terrain", "bake", "check", "measure"]


@pytest.mark.deep  # it calls everything
def test_the_page_of_the_library_runs_as_it_stands(
    folder: Path, tmp_path: Path, cove_store: Callable[[Path], Path]
) -> None:
    (script,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (folder / "scene/sea.ogg").write_bytes(tone(220.0))  # of the scene it alone is not in the store
    store = str(cove_store(tmp_path / "store"))
    environment = {"PATH": "/usr/bin:/bin", "PARADIZE_STORE": store, "HOME": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in (folder / "out/maps").iterdir()) == [
        "sand_dudv.ktx2", "sand_gloss.ktx2", "sand_height.ktx2", "sand_normal.ktx2",
    ]  # fmt: skip


def test_every_name_of_the_library_is_documented_and_on_the_page() -> None:
    assert sorted(paradize.__all__) == sorted(api.__all__)
    page = PAGE.read_text()
    for name in paradize.__all__:
        assert getattr(paradize, name).__doc__, name
        assert re.search(rf"\b{name}\b", page), name


def test_functions_stay_functions_whatever_was_imported_before() -> None:
    """A room of the package with the name of a function would take its place."""
    rooms = {path.stem for path in (ROOT / "pipeline/paradize").iterdir()}
    assert not rooms & set(paradize.__all__)


def test_loading_the_package_loads_nothing_of_it() -> None:
    script = (
        "import sys, paradize; print(sorted(name for name in sys.modules if name.startswith('paradize.')))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_library_and_command_line_write_the_same_bytes(
    folder: Path, tmp_path: Path, paradize: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("paradize.bakers.mesh.lods._SAMPLES", SAMPLES)  # tests take fewer (few_samples)
    written = api.mesh(folder / "rock.obj", api.MeshSettings(lods=2)).write(tmp_path / "a" / "library.glb")
    done = paradize("mesh", folder / "rock.obj", "--lods", 2, "-o", tmp_path / "cli.glb")
    assert done.returncode == 0, done.stderr
    assert written.read_bytes() == (tmp_path / "cli.glb").read_bytes()


def test_texels_are_those_of_the_map_and_its_mips(folder: Path) -> None:
    made = api.maps(folder / "sand.png", api.MapSettings(only=("normal", "height")))
    assert made.texels("normal").shape == (64, 64, 2)
    assert made.texels("height", 2).shape == (16, 16, 1)
    assert np.abs(made.texels("normal")).max() <= 1.0
    with pytest.raises(ArgumentError, match="name: is str 'gloss'; allowed: one of normal, height"):
        made.texels("gloss")


def test_errors_are_exceptions_with_file_and_mend(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=r"sand\.png"):
        api.mesh(folder / "sand.png")
    with pytest.raises(GroupedError, match="dudv_p99_deg"):
        api.maps(folder / "sand.png", tier="auto", budget={"dudv_p99_deg": 1e-9})
    (tmp_path / "scene.toml").write_text("[scene]\n")
    with pytest.raises(GroupedError, match=r"scene\.toml"):
        api.bake(tmp_path / "scene.toml", tmp_path / "out")


def test_a_folder_is_measured_as_a_scene_and_the_one_in_it_is_named(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").touch()
    with pytest.raises(SceneError, match=r"is a folder, not a scene TOML; did you mean .*scene\.toml"):
        paradize.measure(tmp_path)


def test_a_name_that_is_too_long_to_be_looked_for_is_told(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="File name too long"):
        paradize.measure(tmp_path / f"{'a' * 300}.obj")


def test_arguments_that_cannot_be_meant_are_errors_that_name_the_right_ones(folder: Path) -> None:
    settings: Any
    for settings in ({"lods": 3}, {}, api.MapSettings()):
        with pytest.raises(TypeError, match=f"expected paradize.MeshSettings, got {type(settings).__name__}"):
            api.mesh(folder / "rock.obj", settings)
    with pytest.raises(ArgumentError, match=r"mesh: tier: is str 'bogus'.*fast, balanced, exact, auto"):
        api.mesh(folder / "rock.obj", tier="bogus")
    made = api.maps(folder / "sand.png", api.MapSettings(only=("normal",)))
    for level in (99, -1):
        with pytest.raises(ArgumentError, match=rf"level: is int {level}; allowed: a whole number, 0 to 6"):
            made.texels("normal", level)


def test_a_result_prints_as_a_report_without_the_bytes_of_its_files(folder: Path) -> None:
    made = api.mesh(folder / "rock.obj")
    assert "glTF" not in repr(made) and "triangles" in repr(made)


def test_dir_lists_what_the_library_gives() -> None:
    """Completion in a shell reads it."""
    assert set(paradize.__all__) <= set(dir(paradize))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: paradize.maps(np.zeros((4, 6, 3))),  # type: ignore[arg-type]
            "paradize.maps: source: expected a path .*, got ndarray of shape (4, 6, 3); save it as a file",
        ),
        (lambda: paradize.mesh(None), "paradize.mesh: source: expected a path .*, got NoneType None"),  # type: ignore[arg-type]
        (lambda: paradize.bake(3), "paradize.bake: scene: expected a path .*, got int 3"),  # type: ignore[arg-type]
        (lambda: paradize.bake("a.toml", options=5), "expected paradize.BuildOptions, got int 5"),  # type: ignore[arg-type]
        (lambda: paradize.check(), "paradize.check: has no path, so nothing is checked; give one or more"),
        (lambda: paradize.check("a", 7), "paradize.check: path 2: expected a path .*, got int 7"),  # type: ignore[arg-type]
        (lambda: paradize.measure([]), "paradize.measure: source: expected a path .*, got list []"),  # type: ignore[arg-type]
        (
            lambda: paradize.terrain("dunes.png"),
            "paradize.terrain: settings: expected paradize.TerrainSettings(size_m=(x, z), height_m=h)",
        ),
        (
            lambda: paradize.mesh("rock.obj", {"lods": 3}),  # type: ignore[arg-type]
            "paradize.mesh: settings: expected paradize.MeshSettings, got dict {'lods': 3}; write "
            "paradize.MeshSettings(**settings)",
        ),
        (
            lambda: paradize.terrain("dunes.png", paradize.MeshSettings()),  # type: ignore[arg-type]
            "paradize.terrain: settings: expected paradize.TerrainSettings, got MeshSettings",
        ),
        (
            lambda: paradize.mesh("rock.obj", budget=4),  # type: ignore[arg-type]
            "paradize.mesh: budget: expected a dict: metric -> worst value, got int 4",
        ),
    ],
)
def test_a_wrong_argument_is_named_with_what_is_expected_and_what_came(
    call: Callable[[], object], words: str
) -> None:
    with pytest.raises(ArgumentError, match=re.escape(words).replace(re.escape(".*"), ".*")):
        call()


WRONG: dict[type[Any], dict[str, tuple[Any, ...]]] = {
    paradize.MeshSettings: {
        "lods": ("x", 0, 9, 2.5, True, None),
        "max_error": (-1, 2, float("nan")),
        "lod_ratio": (1.0, None),
        "lod_errors": (3, "x", (0.2, 0.1)),
        "screen_size": ({}, {"size_px": 1}, {"size_px": 64, "foo": 1}),
        "simplifier": ("best",),
        "atlas": (1, "no"),
        "weld_m": (-1, None),
        "crease_deg": (181,),
        "tangents": ([], None),
        "quantise": ({"foo": 1}, {"quantise_max": -1}, {"quantise_max": "x"}, True, [1]),
        "base_colors": ({"wood": (1, 2)}, 3),
        "attributes": ("POSITION", ("FOO",)),
    },
    paradize.MapSettings: {
        "only": ((), "normal", ("foo",)),
        "wrap": ([], "mirror", ("repeat",)),
        "zstd": (0, 23, True),
        "strength": (float("inf"), 1e7, "1"),
        "source": ("depth",),
        "slope_scale": (float("nan"), (1,)),
        "size_m": ((1,), (0, 1), "x"),
        "green": ("left",),
        "nodata": ("x", None),
        "gamma": (0,),
        "destep": (1,),
        "filter": ("best",),
        "fmt": ("dds",),
        "budget": ({"normal_p99_deg": 1.0}, 3),
    },
    paradize.OcclusionSettings: {"occlusion_px": (8, 64.5), "occlusion_reach": (0, 2), "see_through": ("a",)},
    paradize.TerrainSettings: {
        "size_m": ("x", (1,), (0, 1)),
        "height_m": ("x",),
        "max_error_m": (-1, float("nan")),
        "quantise": (None,),
        "sand_repeat": (float("inf"),),
    },
}


@pytest.mark.parametrize("settings", WRONG)
def test_every_field_of_settings_refuses_what_it_does_not_take(settings: type[Any]) -> None:
    function = {"Mesh": "mesh", "Map": "maps", "Occlusion": "occlusion", "Terrain": "terrain"}[
        settings.__name__.removesuffix("Settings")
    ]
    needed = {"size_m": (2.0, 2.0)} if settings is paradize.TerrainSettings else {}
    for name, values in WRONG[settings].items():
        for value in values:
            with pytest.raises(ArgumentError) as caught:
                getattr(paradize, function)("no file", settings(**{**needed, name: value}))
            assert f"paradize.{function}: settings.{name}: " in str(caught.value), value
            assert "; allowed: " in str(caught.value) or "write " in str(caught.value), value


def test_a_budget_in_the_settings_is_told_to_be_an_argument(folder: Path) -> None:
    limits = {"height_psnr_db": 30.0}
    with pytest.raises(
        ArgumentError, match=r"write paradize\.maps\(\.\.\., budget=\{'height_psnr_db': 30.0\}\)"
    ):
        paradize.maps(folder / "sand.png", paradize.MapSettings(budget=limits))
    made = paradize.maps(folder / "sand.png", paradize.MapSettings(only=("height",)), budget=limits)
    assert made.errors["height"]["height_psnr_db"] > 30.0


def test_each_field_of_settings_has_a_rule_that_its_default_keeps() -> None:
    for name, rules in RULES.items():
        settings = getattr(paradize, name)
        made = settings(**({"size_m": (1.0, 1.0)} if "size_m" in rules and name == "TerrainSettings" else {}))
        assert {one.name for one in fields(settings)} == rules.keys()
        require_right(made, "paradize")


def test_several_wrong_fields_are_told_at_once_and_an_unknown_one_with_the_nearest(folder: Path) -> None:
    with pytest.raises(GroupedError, match=r"settings\.lods: is int 0.*\n.*settings\.atlas: is str 'x'"):
        paradize.mesh(folder / "rock.obj", paradize.MeshSettings(lods=0, atlas="x"))  # type: ignore[arg-type]
    unknown: Any = {"lod": 3}
    with pytest.raises(ArgumentError, match=r"MeshSettings: has no 'lod'; did you mean lods\?"):
        paradize.MeshSettings(**unknown)
    kept = pickle.loads(pickle.dumps(paradize.TerrainSettings(size_m=(1.0, 2.0))))
    assert kept.size_m == (1.0, 2.0)
    paradize.MeshSettings(lods=np.int64(3), crease_deg=np.float32(30))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "call",
    [
        lambda: paradize.bake("a.toml", options=paradize.BuildOptions(jobs=-1)),
        lambda: paradize.bake("a.toml", options=paradize.BuildOptions(tiers={"a": "x"})),
        lambda: paradize.check("a", options=paradize.CheckOptions(worse_by=-1)),
        lambda: paradize.measure("a.png", paradize.FileOptions(size_m=(1,))),  # type: ignore[arg-type]
        lambda: paradize.measure("a.png", runs=0),
        lambda: paradize.measure("a.png", tier="best"),
        lambda: paradize.mesh(""),
        lambda: paradize.mesh("a\0b"),
        lambda: paradize.mesh("a.obj", budget={"surface_max": float("nan")}),
        lambda: paradize.mesh("a.obj", budget={"surfce_max": 0.1}),
        lambda: paradize.maps("a.png", budget={3: 4}),  # type: ignore[dict-item]
    ],
)
def test_wrong_options_and_budgets_are_refused_before_any_file_is_read(call: Callable[[], object]) -> None:
    with pytest.raises(ArgumentError, match=r"paradize\.\w+: "):
        call()

"""Paradize from Python: what the command line does, with typed settings and results.

    import paradize

    rock = paradize.mesh("rock.obj", paradize.MeshSettings(lods=3))
    rock.lods[1].mesh.positions  # (n, 3) float32, metres
    rock.write("rock.glb")

All names here are attributes of `paradize`. Functions work in the caller's process (`bake` and `measure`
start workers of their own) and raise ParadizeError: SourceError for an input, SceneError for a scene,
BakeError for what cannot be baked, ArgumentError for an argument that is not allowed, GroupedError for
several; the text names file or argument, value, limit and mend.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from datetime import date
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.build.single_file import BakedFiles, bake_single
from paradize.errors import ArgumentError, GroupedError
from paradize.jobs.progress import OnProgress
from paradize.scene.baker_settings import MapSettings, MeshSettings, OcclusionSettings, TerrainSettings
from paradize.scene.setting_rules import (
    ANY_SIZE_M,
    FLAG,
    LIMITS,
    TEXT,
    Rule,
    choice,
    instance,
    mapping,
    number,
    require_right,
    shown,
    whole,
)
from paradize.store.atomic import write_whole
from paradize.tiers import TIER_OPTIONS

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from paradize.checks import CheckOptions, Finding
    from paradize.data import Lod, Mesh
    from paradize.tradeoff.plan import FileOptions

__all__ = [
    "BakeReport",
    "BakedMaps",
    "BakedMesh",
    "BakedTerrain",
    "BuildOptions",
    "CheckOptions",
    "FileOptions",
    "Finding",
    "MapSettings",
    "MeshSettings",
    "OcclusionSettings",
    "TerrainSettings",
    "bake",
    "check",
    "maps",
    "measure",
    "mesh",
    "occlusion",
    "terrain",
]

AnyPath = str | os.PathLike[str]

# Their rooms load much that no mesh, map or terrain needs: half the time of a small one.
_LOADED_WHEN_USED = {
    "CheckOptions": "paradize.checks",
    "Finding": "paradize.checks",
    "FileOptions": "paradize.tradeoff.plan",
}


def __getattr__(name: str) -> object:
    if name not in _LOADED_WHEN_USED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LOADED_WHEN_USED[name]), name)


_TIER = choice(*TIER_OPTIONS)
_BUILD = {
    "jobs": whole(0),
    "tier": _TIER.or_none(),
    "force": FLAG,
    "tiers": mapping(None, _TIER, "a dict: job or artifact -> tier"),
    "cluster": TEXT.or_none(),
    "store": TEXT.or_none(),
    "uncompressed": FLAG,
    "whole": FLAG,
}
_CHECK = {
    "against": instance((str, os.PathLike), "a path").or_none(),
    "worse_by": number(0.0),
    "today": instance(date, "a datetime.date"),
}
_FILE = {
    "source": choice("auto", "color", "height"),
    "size_m": ANY_SIZE_M,
    "height_m": number(unit="metres").or_none(),
    "max_error_m": number(0.0, unit="metres").or_none(),
}


def _path(value: AnyPath, what: str) -> Path:
    """Raises ArgumentError for a value that is not a path. what: the function and its argument."""
    if isinstance(value, (str, os.PathLike)) and os.fspath(value) and "\0" not in str(value):
        return Path(value)
    raise _wrong(
        what, value, "a path (str or os.PathLike)", "save it as a file" if hasattr(value, "shape") else ""
    )


def _required(value: object, rule: Rule, what: str) -> None:
    """Raises ArgumentError for a value that breaks a rule."""
    if wrong := rule.fault(value):
        raise ArgumentError(f"{wrong}; allowed: {rule.allowed}", place=f"paradize.{what}")


def _budget(value: Mapping[str, float] | None, function: str) -> dict[str, float]:
    if value is not None and not isinstance(value, Mapping):
        raise _wrong(f"{function}: budget", value, "a dict: metric -> worst value")
    _required(value or {}, LIMITS, f"{function}: budget")
    return {key: float(limit) for key, limit in (value or {}).items()}


def _tier(value: object, function: str) -> None:
    _required(value, choice(*TIER_OPTIONS), f"{function}: tier")


def _options(value: Any, expected: type, function: str, rules: Mapping[str, Rule]) -> None:
    """Raises ArgumentError for a value that is neither None nor an `expected` whose fields keep the rules."""
    if value is None:
        return
    if not isinstance(value, expected):
        raise _wrong(f"{function}: options", value, f"paradize.{expected.__name__}")
    for name, rule in rules.items():
        _required(getattr(value, name), rule, f"{function}: options.{name}")


def _settings(value: Any, expected: type[Any], function: str) -> Any:
    """The settings, those of None by default. Raises ArgumentError for other values than an `expected`, and
    for fields that are not allowed."""
    if value is None:
        return expected()
    if type(value) is expected:
        require_right(value, f"paradize.{function}")
        if limits := getattr(value, "budget", None):
            mend = f"write paradize.{function}(..., budget={limits})"
            raise ArgumentError("is not looked at", place=f"paradize.{function}: settings.budget", mend=mend)
        return value
    name = f"paradize.{expected.__name__}"
    raise _wrong(
        f"{function}: settings",
        value,
        name,
        f"write {name}(**settings)" if isinstance(value, Mapping) else "",
    )


def _wrong(what: str, value: object, expected: str, mend: str = "") -> ArgumentError:
    return ArgumentError(
        f"expected {expected}, got {shown(value)}", place=f"paradize.{what}", mend=mend or None
    )


class BakedMesh(BakedFiles):
    """A GLB with levels of detail. report: as `mesh --json` prints it. errors: by product, then by metric."""

    @property
    def glb(self) -> bytes:
        """The file."""
        return next(iter(self.files.values()))

    @property
    def lods(self) -> list[Lod]:
        """The levels as the file holds them, the finest first: arrays (data.Mesh) and errors."""
        from paradize.formats.glb.reader import decode_glb

        return decode_glb(self.glb)

    def write(self, path: AnyPath) -> Path:
        """Writes the file, whole or not at all; folders are made. Returns its path."""
        target = _path(path, "BakedMesh.write: path")
        write_whole(target, self.glb)
        return target


class BakedTerrain(BakedMesh):
    """A GLB with one mesh. report: as `terrain --json` prints it."""

    @property
    def mesh(self) -> Mesh:
        """The mesh: Y up, metres, the heightmap's middle at x = z = 0."""
        return self.lods[0].mesh


class BakedMaps(BakedFiles):
    """Textures, by file name. report: as `maps --json` prints it: `report["maps"]` has a row for each map."""

    def texels(self, name: str, level: int = 0) -> npt.NDArray[np.float32]:
        """The texels (h, w, c) float32 of one mip of a map, as hardware decodes them: normals and du/dv are
        x and y, -1..1; height and gloss 0..1. name: of the map. Raises ArgumentError for a map that was
        not baked, a level that it does not have, and a PNG, which any picture library reads."""
        from paradize.formats.ktx2.reader import decode_ktx2
        from paradize.metrics.texels import decode_texels

        _required(name, choice(*self.report["maps"]), "BakedMaps.texels: name")
        file = self.report["maps"][name]["file"]
        if not file.endswith(".ktx2"):
            what = f"{file} is not a KTX2 file"
            raise ArgumentError(what, place="paradize.BakedMaps.texels: name", mend="read it as a picture")
        texture = decode_ktx2(self.files[file], file)
        _required(level, whole(0, len(texture.levels) - 1), "BakedMaps.texels: level")
        return decode_texels(texture, level)

    def write(self, folder: AnyPath) -> list[Path]:
        """Writes each file into a folder, which is made. Returns their paths."""
        target = _path(folder, "BakedMaps.write: folder")
        for name, data in self.files.items():
            write_whole(target / name, data)
        return [target / name for name in self.files]


_Files = TypeVar("_Files", bound=BakedFiles)


def _baked(
    result: type[_Files],
    kind: str,
    source: AnyPath,
    settings: tuple[Any, type[Any]],
    tier: str,
    budget: Mapping[str, float] | None,
    **sources: Path | None,
) -> _Files:
    """Checks what a function was given, and bakes. settings: as given, and their class."""
    _tier(tier, kind)
    used = _settings(*settings, kind)
    path, limits = _path(source, f"{kind}: source"), _budget(budget, kind)
    made = bake_single(kind, path, used, tier=tier, budget=limits, **sources)
    return result(made.files, made.report, made.rows, made.errors)


def mesh(
    source: AnyPath,
    settings: MeshSettings | None = None,
    *,
    tier: str = "balanced",
    budget: Mapping[str, float] | None = None,
) -> BakedMesh:
    """Reads a model, and gives it normals, tangent frames and levels of detail.

    tier: "fast", "balanced", "exact", or "auto": the cheapest whose measured errors are inside the budget.
    budget: metric -> worst value (scene/FIELDS.md lists the metrics); errors beyond it are warnings in the
    report, of "auto" a BakeError.
    """
    return _baked(BakedMesh, "mesh", source, (settings, MeshSettings), tier, budget)


def maps(
    source: AnyPath,
    settings: MapSettings | None = None,
    *,
    tier: str = "balanced",
    budget: Mapping[str, float] | None = None,
    uv: AnyPath | None = None,
) -> BakedMaps:
    """Makes normal, height, gloss and du/dv maps of a colour picture or a heightmap. tier, budget: as of
    `mesh`. uv: the model whose UV layout they follow."""
    layout = None if uv is None else _path(uv, "maps: uv")
    return _baked(BakedMaps, "maps", source, (settings, MapSettings), tier, budget, uv=layout)


def occlusion(
    source: AnyPath,
    settings: OcclusionSettings | None = None,
    *,
    tier: str = "balanced",
    budget: Mapping[str, float] | None = None,
) -> BakedMaps:
    """Casts a map of ambient occlusion from a model, in its UV layout. tier: as of `mesh`: 64, 256 or 1024
    rays of each texel."""
    return _baked(BakedMaps, "occlusion", source, (settings, OcclusionSettings), tier, budget)


def terrain(
    source: AnyPath,
    settings: TerrainSettings | None = None,
    *,
    tier: str = "balanced",
    budget: Mapping[str, float] | None = None,
) -> BakedTerrain:
    """Makes a mesh of a heightmap. settings: at least its size, which a picture does not say;
    ArgumentError without. tier, budget: as of `mesh`."""
    if settings is None:
        expected = "paradize.TerrainSettings(size_m=(x, z), height_m=h), metres: no picture says its size"
        raise _wrong("terrain: settings", settings, expected)
    return _baked(BakedTerrain, "terrain", source, (settings, TerrainSettings), tier, budget)


def bake(scene: AnyPath, out: AnyPath | None = None, options: BuildOptions | None = None) -> BakeReport:
    """Bakes a scene file into a folder (None: build/assets/<scene name>); what did not change is taken from
    the store. Raises the error of an artifact that fails, of several a GroupedError; the folder then keeps
    what it held."""
    from paradize.build.bake import bake as bake_scene

    _options(options, BuildOptions, "bake", _BUILD)
    folder = None if out is None else _path(out, "bake: out")
    report = bake_scene(_path(scene, "bake: scene"), folder, options)
    if report.errors:
        raise report.errors[0] if len(report.errors) == 1 else GroupedError(report.errors)
    return report


def check(*paths: AnyPath, options: CheckOptions | None = None) -> list[Finding]:
    """Judges baked folders, files and scenes, one or more, by all rules (checks/RULES.md). A finding with
    `fails` is an error."""
    from paradize.checks import CheckOptions, check_paths

    if not paths:
        raise ArgumentError(
            "has no path, so nothing is checked", place="paradize.check", mend="give one or more"
        )
    _options(options, CheckOptions, "check", _CHECK)
    return check_paths(
        [_path(path, f"check: path {number}") for number, path in enumerate(paths, 1)], options
    )


def measure(
    source: AnyPath,
    options: FileOptions | None = None,
    *,
    tier: str | None = None,
    runs: int | None = None,
    player: Path | None = None,
    on_progress: OnProgress | None = None,
) -> dict[str, Any]:
    """Time, error and bytes of every tier of every stage, as the object of tradeoff.json. source: a scene, a
    model or a picture; options: what a picture does not say of itself. tier: the one in use (None: the
    scene's, or balanced). runs: of each tier; None: up to 10. player: of a scene, the program that draws the
    pictures; None: nothing is drawn."""
    from paradize.tradeoff.plan import FileOptions

    _options(options, FileOptions, "measure", _FILE)
    _required(tier, choice(*TIER_OPTIONS).or_none(), "measure: tier")
    _required(runs, whole(1).or_none(), "measure: runs")
    _required(on_progress, instance(Callable, "a function").or_none(), "measure: on_progress")  # type: ignore[arg-type]
    path = _path(source, "measure: source")
    program = None if player is None else _path(player, "measure: player")
    if path.suffix.lower() != ".toml" and not os.path.isdir(path):  # noqa: PTH112 (raises nothing)
        from paradize.tradeoff.tiers import measure_file

        used = options or FileOptions()
        return measure_file(path, used, tier=tier or "balanced", runs=runs, on_progress=on_progress)
    from paradize.tradeoff.scene import measure_scene

    return measure_scene(path, tier=tier, runs=runs, player=program, on_progress=on_progress)

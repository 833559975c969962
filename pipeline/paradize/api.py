"""Paradize from Python: what the command line does, with typed settings and results.

    import paradize

    rock = paradize.mesh("rock.obj", paradize.MeshSettings(lods=3))
    rock.lods[1].mesh.positions  # (n, 3) float32, metres
    rock.write("rock.glb")

All names here are attributes of `paradize`. Functions work in the caller's process (`bake` and `measure`
start workers of their own) and raise ParadizeError: SourceError for an input, SceneError for a scene,
BakeError for what cannot be baked, GroupedError for several; the text names file, place, value, limit and
mend.
"""

from __future__ import annotations

import os
import reprlib
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.build.single_file import BakedFiles, bake_single
from paradize.errors import GroupedError
from paradize.jobs.progress import OnProgress
from paradize.scene.baker_settings import MapSettings, MeshSettings, OcclusionSettings, TerrainSettings
from paradize.store.atomic import write_whole

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


def _path(value: AnyPath, what: str) -> Path:
    """Raises TypeError for a value that is no path. what: the function and its argument, for the message."""
    if isinstance(value, (str, os.PathLike)):
        return Path(value)
    mend = ": save it as a file" if hasattr(value, "shape") else ""
    raise _wrong(what, value, f"a path (str or os.PathLike){mend}")


def _budget(value: Mapping[str, float] | None, function: str) -> dict[str, float]:
    if value is None or isinstance(value, Mapping):
        return dict(value or {})
    raise _wrong(f"{function}: budget", value, "a dict: metric -> worst value")


def _options(value: object, expected: type, function: str) -> None:
    """Raises TypeError for a value that is neither None nor an `expected`."""
    if value is not None and not isinstance(value, expected):
        raise _wrong(f"{function}: options", value, f"paradize.{expected.__name__}")


def _settings(value: Any, expected: type[Any], function: str) -> Any:
    """The settings, those of None by default. Raises TypeError for other values than an `expected`."""
    if value is None:
        return expected()
    if isinstance(value, expected):
        return value
    name = f"paradize.{expected.__name__}"
    mend = f"; write {name}(**settings)" if isinstance(value, Mapping) else ""
    raise _wrong(f"{function}: settings", value, name, mend)


def _wrong(what: str, value: object, expected: str, mend: str = "") -> TypeError:
    came = f"{type(value).__name__} {reprlib.repr(value)}"
    if shape := getattr(value, "shape", None):
        came = f"{type(value).__name__} of shape {tuple(shape)}"
    return TypeError(f"paradize.{what}: expected {expected}, got {came}{mend}")


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
        write_whole(Path(path), self.glb)
        return Path(path)


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
        x and y, -1..1; height and gloss 0..1. name: of the map. Raises KeyError for a map that was not
        baked, ValueError for a level that it does not have and for a PNG, which any picture library reads."""
        from paradize.formats.ktx2.reader import decode_ktx2
        from paradize.metrics.texels import decode_texels

        file = self.report["maps"][name]["file"]
        if not file.endswith(".ktx2"):
            raise ValueError(f"{file} is no KTX2 file")
        return decode_texels(decode_ktx2(self.files[file], file), level)

    def write(self, folder: AnyPath) -> list[Path]:
        """Writes each file into a folder, which is made. Returns their paths."""
        for name, data in self.files.items():
            write_whole(Path(folder) / name, data)
        return [Path(folder) / name for name in self.files]


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
    used = _settings(settings, MeshSettings, "mesh")
    made = bake_single("mesh", _path(source, "mesh: source"), used, tier=tier, budget=_budget(budget, "mesh"))
    return BakedMesh(made.files, made.report, made.rows, made.errors)


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
    used = _settings(settings, MapSettings, "maps")
    layout = None if uv is None else _path(uv, "maps: uv")
    made = bake_single(
        "maps", _path(source, "maps: source"), used, tier=tier, budget=_budget(budget, "maps"), uv=layout
    )
    return BakedMaps(made.files, made.report, made.rows, made.errors)


def occlusion(
    source: AnyPath,
    settings: OcclusionSettings | None = None,
    *,
    tier: str = "balanced",
    budget: Mapping[str, float] | None = None,
) -> BakedMaps:
    """Casts a map of ambient occlusion from a model, in its UV layout. tier: as of `mesh`: 64, 256 or 1024
    rays of each texel."""
    used = _settings(settings, OcclusionSettings, "occlusion")
    made = bake_single(
        "occlusion", _path(source, "occlusion: source"), used, tier=tier, budget=_budget(budget, "occlusion")
    )
    return BakedMaps(made.files, made.report, made.rows, made.errors)


def terrain(
    source: AnyPath,
    settings: TerrainSettings | None = None,
    *,
    tier: str = "balanced",
    budget: Mapping[str, float] | None = None,
) -> BakedTerrain:
    """Makes a mesh of a heightmap. settings: at least its size, which a picture does not say; TypeError
    without. tier, budget: as of `mesh`."""
    if settings is None:
        expected = "paradize.TerrainSettings(size_m=(x, z), height_m=h), metres: no picture says its size"
        raise _wrong("terrain: settings", settings, expected)
    used = _settings(settings, TerrainSettings, "terrain")
    made = bake_single(
        "terrain", _path(source, "terrain: source"), used, tier=tier, budget=_budget(budget, "terrain")
    )
    return BakedTerrain(made.files, made.report, made.rows, made.errors)


def bake(scene: AnyPath, out: AnyPath | None = None, options: BuildOptions | None = None) -> BakeReport:
    """Bakes a scene file into a folder (None: build/assets/<scene name>); what did not change is taken from
    the store. Raises GroupedError where artifacts fail; the folder then keeps what it held."""
    from paradize.build.bake import bake as bake_scene

    _options(options, BuildOptions, "bake")
    folder = None if out is None else _path(out, "bake: out")
    report = bake_scene(_path(scene, "bake: scene"), folder, options)
    if report.errors:
        raise report.errors[0] if len(report.errors) == 1 else GroupedError(report.errors)
    return report


def check(*paths: AnyPath, options: CheckOptions | None = None) -> list[Finding]:
    """Judges baked folders, files and scenes by all rules (checks/RULES.md). A finding with `fails` is an
    error."""
    from paradize.checks import CheckOptions, check_paths

    _options(options, CheckOptions, "check")
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

    _options(options, FileOptions, "measure")
    path = _path(source, "measure: source")
    if path.suffix.lower() != ".toml":
        from paradize.tradeoff.tiers import measure_file

        used = options or FileOptions()
        return measure_file(path, used, tier=tier or "balanced", runs=runs, on_progress=on_progress)
    from paradize.tradeoff.scene import measure_scene

    return measure_scene(path, tier=tier, runs=runs, player=player, on_progress=on_progress)

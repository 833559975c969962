"""A picture -> the maps of a material, each with its mips and the measured error of every level.

`paradize maps` and the bake of a scene both come here. The conventions are those of formats/FORMAT.md:
normals are green up, du/dv is signed and without mean, gloss holds specular intensity and smoothness.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.bakers.color import spread
from paradize.bakers.maps.png import png_maps
from paradize.bakers.maps.rows import Layout, MapRows, no_worse_than_fast
from paradize.bakers.maps.textures import ktx2_maps
from paradize.bakers.product import MapProduct, wraps_of
from paradize.data import HeightMap, Image, Mesh
from paradize.errors import BakeError
from paradize.jobs.progress import report_step
from paradize.kernels.maps import Levels
from paradize.metrics.source import true_heights
from paradize.readers.heightmap import GIVE_HEIGHTS, guess_source, with_heights
from paradize.readers.image import read_image, require_finite
from paradize.readers.model import read_model
from paradize.readers.names import said_of
from paradize.scene.baker_settings import MapSettings
from paradize.scene.settings import Relief
from paradize.stages import gutter
from paradize.stages.compress import block_warnings
from paradize.stages.destep import destep_pixels
from paradize.stages.filters import choose_filter
from paradize.stages.gloss import GlossSettings
from paradize.stages.height import height_from_color, height_from_height
from paradize.stages.sweep import bands_of, run

F32 = npt.NDArray[np.float32]
_GIVE = "give the colour map, or the heights with --from height"


def bake_maps(
    path: Path,
    settings: MapSettings | None = None,
    *,
    uv: Path | None = None,
    root: Path | None = None,
    tier: str = "balanced",
    measure: bool = True,
    **changes: Any,
) -> dict[str, MapProduct]:
    """The maps of the picture at `path`, by name.

    settings: None: as they are by themselves; changes: fields of them that are others. uv: a model whose UV
    layout the picture follows: slopes stay inside islands, gutters are filled. root: as of read_model.
    measure: False leaves out errors (and with them the budget).
    Raises SourceError for what cannot be read, BakeError for settings that cannot be met.
    """
    used = replace(settings or MapSettings(), **changes)
    rows, picture = map_rows(path, used, uv=uv, root=root, tier=tier, measure=measure)
    if used.fmt == "png":
        maps = png_maps(rows, tier=tier, warnings=picture.warnings, measure=measure)
    else:
        sides = [] if used.uncompressed else block_warnings(path, *rows.height_map.heights.shape)
        warnings = [*picture.warnings, *sides]
        maps = ktx2_maps(rows, used, tier=tier, warnings=warnings, measure=measure)
    return {
        name: replace(baked_map, source=picture.source, guess=picture.guess)
        for name, baked_map in maps.items()
    }


@dataclass(frozen=True)
class Picture:
    """How a picture is read: as "color" or "height"; the guess in words, None where the user chose."""

    source: str
    guess: str | None
    warnings: list[str]


def map_rows(
    path: Path,
    settings: MapSettings,
    *,
    uv: Path | None,
    root: Path | None = None,
    tier: str,
    measure: bool = True,
) -> tuple[MapRows, Picture]:
    """The rows of every map, level 0, that bake_maps makes textures of; arguments as there."""
    wraps = wraps_of(settings.wrap)
    if settings.gloss_groups and uv is None:
        raise BakeError("groups that shine need a UV layout", mend="name the model whose UVs the map follows")
    levels, filter_name = _levels_of(settings), settings.filter
    report_step("reading")
    image, read = _read(path, settings)
    source, warnings = read.source, read.warnings
    rows, columns = image.values.shape[:2]
    layout = None
    if uv is not None:
        groups, materials = settings.gloss_groups, settings.layout_materials
        layout = read_layout(uv, rows, columns, wraps, groups, materials, root)
    if source == "color":
        image = replace(image, values=spread(image.values, wraps))
    heights = _heights(image, source, levels)
    islands = None if layout is None else layout.islands
    known = measure or filter_name == "auto"  # what `auto` chooses is measured too
    truth = true_heights(image, source, levels) if known else None
    codes, held = _code_heights(image, partial(_heights, source=source, levels=levels)), False
    reference_levels = (
        _code_heights(image, partial(true_heights, source=source, levels=levels)) if known else None
    )
    shaped = source == "color" and levels is not None
    true_light = true_heights(image, source, Levels()) if measure and shaped else None
    if settings.filter == "auto":  # by the steps as they were: what is left of them looks like waves
        held = tier == "exact" and codes is not None
        filter_name = choose_filter(heights, image.source_bits, wraps, tier, islands, codes)
    if settings.destep:
        image, notes = _without_steps(image, path, wraps)
        if source == "height":
            warnings = [text for text in warnings if text not in _warnings(path, image)]
        warnings = [*warnings, *notes]
        heights = _heights(image, source, levels)
    if truth is not None and np.array_equal(truth, heights):
        truth = heights  # one plane less while maps are made
    unit = (0.0, 1.0)
    if source == "height":
        unit, ranged = unit_of_heights(heights, path)
        warnings = [*warnings, *ranged]
    slopes = _slopes(settings, rows, columns, unit[1])
    down = settings.green == "down"
    height_map = HeightMap(
        heights=heights,
        slope_scale=slopes,
        wrap=wraps,
        filter_name=filter_name,
        green_down=down,
        islands=islands,
        height_levels=codes,
        clamp_slopes=held,
        reference_heights=truth,
        reference_levels=reference_levels,
    )
    picture = image if shaped else None
    del image  # the codes of a height map are not needed any more
    if settings.filter == "auto":
        height_map = no_worse_than_fast(height_map)
    made = MapRows(
        height_map=height_map,
        names=tuple(settings.only),
        unit=unit,
        picture=picture,
        gloss=GlossSettings(),
        layout=layout,
        truth=true_light,
    )
    return made, replace(read, warnings=warnings)


def _read(path: Path, settings: MapSettings) -> tuple[Image, Picture]:
    """The picture's texels, and how they are read. Raises SourceError and BakeError."""
    image = read_image(path, finite=False)
    source, guess = settings.source, None
    if source == "auto":
        source, why = guess_source(image)
        taken = "heights" if source == "height" else "colour"
        guess = f"{path}: taken for {taken}: {why} (--from says otherwise)"
    if source == "height":
        image, warnings = with_heights(replace(image, color_space="data"), path, settings.nodata)
        named = _named_otherwise(path, source) if guess else []
        return image, Picture(source, guess, [*_warnings(path, image), *warnings, *named])
    if settings.nodata not in ("auto", "none"):
        mend = "leave --nodata out, or add --from height where a grey picture holds heights"
        raise BakeError("is taken for colour, which has no number for no height", file=path, mend=mend)
    require_finite(image.values, path)
    warnings = [*image.warnings(path), *_beyond(path, image)]
    warnings += _normals(path, image) or (_named_otherwise(path, source) if guess else [])
    return image, Picture(source, guess, warnings)


def _levels_of(relief: Relief) -> Levels | None:
    """The levels of a relief; None where they change nothing. Raises BakeError for levels that make no
    sense."""
    try:
        levels = Levels(**{item.name: getattr(relief, item.name) for item in fields(Levels)})
    except ValueError as error:
        raise BakeError(str(error), mend="black and white differ, and gamma is 0.001 or more") from None
    return None if levels == Levels() else levels


def _slopes(settings: MapSettings, rows: int, columns: int, span: float) -> tuple[float, float]:
    """The slope along (x, y) of one unit of height between neighbours. span: how many units the height map's
    1 stands for."""
    scale, size_m = settings.slope_scale, settings.size_m
    if scale is not None:
        return scale if isinstance(scale, tuple) else (scale, scale)
    rise = settings.strength / 100.0 / span
    across = rise * columns
    return across, across if size_m is None else rise * rows * (size_m[0] / size_m[1])


def _warnings(path: Path, image: Image) -> list[str]:
    if image.source_bits == 8:
        return [f"{path}: heights of 8 bits stand in 255 steps; save it with 16 bits or as float"]
    return []


def _beyond(path: Path, image: Image) -> list[str]:
    """Says which float values a colour cannot hold."""
    if image.top is not None:
        return []
    least, most = float(image.values.min()), float(image.values.max())
    if least >= 0.0 and most <= 1.0:
        return []
    what = f"runs from {least:g} to {most:g}; as colour, what is below 0 counts as 0, and above 1 as 1"
    return [f"{path}: {what}; heights keep it all (`paradize maps --from height`)"]


def _normals(path: Path, image: Image) -> list[str]:
    """A warning where what is taken for colour is surely a normal map: bluish, and of unit length."""
    if image.values.shape[2] < 3:
        return []
    step = max(1, max(image.values.shape[:2]) // 256)  # a sample of the texels says enough
    colors = np.asarray(image.values[::step, ::step, :3], np.float32) / (image.top or 1.0)
    colors = colors.clip(0.0, 1.0)  # floats may lie so far out that a square overflows
    red, green, blue = colors.mean(axis=(0, 1), dtype=np.float64)
    lengths = np.linalg.norm(2.0 * colors - 1.0, axis=2)
    if (
        blue <= 0.8
        or abs(red - 0.5) > 0.05
        or abs(green - 0.5) > 0.05
        or abs(float(lengths.mean()) - 1.0) > 0.1
    ):
        return []
    return [f"{path}: looks like a normal map, of which these maps would be wrong; {_GIVE}"]


def _named_otherwise(path: Path, source: str) -> list[str]:
    """A warning where the name of what is taken for colour or heights says something else; where it says
    nothing, its folder's, which must be that one word."""
    whose, (word, held), folder = "its name", said_of(path.stem), path.parent.name
    if not held and said_of(folder)[0] == folder.lower():
        whose, (word, held) = "its folder's name", said_of(folder)
    if held in ("", source):
        return []
    mend = f"add --from {held}" if held in ("color", "height") else _GIVE
    taken = "heights" if source == "height" else "colour"
    return [f"{path}: {whose} says {word!r}, and it is taken for {taken}; if the name is right, {mend}"]


def _without_steps(image: Image, path: Path, wraps: tuple[bool, bool]) -> tuple[Image, list[str]]:
    """The picture as floats whose steps of 8 bits are smoothed; with a warning where it has none."""
    if image.values.dtype != np.uint8:
        return image, [f"{path}: has no steps of 8 bits to smooth"]
    pixels = image.pixels
    colors = 1 if pixels.shape[2] < 3 else 3
    destep_pixels(pixels[:, :, :colors], wrap=wraps)
    return replace(image, values=pixels), []


def read_layout(
    uv: Path,
    rows: int,
    columns: int,
    wraps: tuple[bool, bool],
    groups: Sequence[str] = (),
    materials: Sequence[str] = (),
    root: Path | None = None,
) -> Layout:
    """Where the UV islands of a model lie on a map of so many texels. groups: those that shine; none: all.
    materials: those whose triangles lie on the map; none: all. root: as of read_model. Raises SourceError and
    BakeError."""
    mesh = read_model(uv, root).mesh
    own = mesh.of_materials(materials) if materials else mesh
    islands = gutter.island_map(own, height=rows, width=columns, file=uv)
    mask = None
    if groups:
        elsewhere = _names(mesh) - _names(own)
        named = [name for name in groups if name not in elsewhere]
        mask = gutter.group_mask(own, named, height=rows, width=columns, file=uv)
    source = gutter.layout_source(islands, own, wraps)
    return Layout(gutter.with_source(islands, source), source is not None, mask)


def _names(mesh: Mesh) -> set[str]:
    """The names of a mesh's groups and materials."""
    return {name for group in mesh.groups for name in (group.name, group.material)}


def _heights(image: Image, source: str, levels: Levels | None) -> F32:
    """Heights (h, w) of the picture, band by band."""
    make = height_from_height if source == "height" else height_from_color
    rows, columns = image.values.shape[:2]
    heights = np.empty((rows, columns), np.float32)

    def work(band: tuple[int, int]) -> None:
        part: Any = image.values[band[0] : band[1]]
        heights[band[0] : band[1]] = make(replace(image, values=part), levels)

    run(work, bands_of(rows, columns))
    return heights


def _code_heights(image: Image, heights: Callable[[Image], F32]) -> F32 | None:
    """The heights that `heights` gives each grey code of the picture, (n,) rising; None for a picture of
    floats."""
    if image.values.dtype == np.float32:
        return None
    kind = image.values.dtype
    codes = np.arange(256 if kind == np.uint8 else 65536).astype(kind)
    grey: Any = np.repeat(codes[None, :, None], image.values.shape[2], axis=2)
    return np.unique(heights(replace(image, values=grey)))


def unit_of_heights(heights: F32, path: Path) -> tuple[tuple[float, float], list[str]]:
    """The heights that a height map holds as 0, and how far above it 1 is: (0, 1) where the heights fit, else
    from the lowest to the highest, with a warning. Where all are equal there is one too."""
    low, high = float(heights.min()), float(heights.max())
    fits = low >= 0.0 and high <= 1.0
    if high == low:
        flat = f"{path}: every height is {low:g}, so its maps are flat; {GIVE_HEIGHTS}"
        return (0.0 if fits else low, 1.0), [flat]
    if fits:
        return (0.0, 1.0), []
    return (low, high - low), [
        f"{path}: heights run from {low:g} to {high:g}; the height map holds them as 0..1, and --strength "
        "says how high the highest stands above the lowest"
    ]

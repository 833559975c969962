"""The tiers of the stages that a picture goes through: block compression of colour and maps in every format,
slope filters of normal maps, the sky."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from paradize.bakers.color import color_formats, color_texture, color_values
from paradize.bakers.cubemap import read_faces
from paradize.bakers.maps.bake import map_rows, relief_levels
from paradize.bakers.maps.rows import MapRows, filter_errors, no_worse_than_fast
from paradize.bakers.maps.textures import dudv_texture, map_errors, map_textures
from paradize.bakers.product import flat_errors, wraps_of
from paradize.bakers.registry import layout_of
from paradize.data import HeightMap, Texture
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.maps import MAPS
from paradize.measure.timing import Trial, TrialGroup, TrialResult, timed
from paradize.metrics.levels import color_levels
from paradize.metrics.source import sky_error
from paradize.readers.image import read_image
from paradize.scene.requirements import BakeJob
from paradize.stages import cubemap
from paradize.stages.compress import TIERS, formats_of
from paradize.stages.filters import choose_filter
from paradize.stages.normal import normal_rows
from paradize.stages.sweep import bands_of, run

Settings = dict[str, Any]


def color_groups(order: BakeJob) -> list[TrialGroup]:
    """What there is to be measured of an order of the maker "color". Reads the sources."""
    values, encoded, _ = _picture(order.sources, order.settings)
    own = {tier: color_formats(values, encoded=encoded, tier=tier)[0] for tier in TIERS}
    given = {"sources": order.sources, "settings": order.settings}
    tries = _format_tries(own, color_tier, given)
    note = "The time holds the mips, in linear light."
    artifact = order.wants[0].artifact
    return [TrialGroup(order.name, "block compression", artifact, MAPS["color"].metrics, tries, TIERS, note)]


def map_groups(order: BakeJob) -> list[TrialGroup]:
    """What there is to be measured of an order of the maker "maps". Reads the sources."""
    height, width = read_image(order.sources["image"], finite=False).values.shape[:2]
    base = order.name.removesuffix(" maps")
    found = []
    for want in order.wants:
        given = {"sources": order.sources, "settings": order.settings, "name": want.product}
        title = f"{base} {want.product}"
        if want.product == "normal":
            found.append(_filter_group(order, base, want.artifact))
        own = {tier: formats_of(want.product, height, width, tier=tier) for tier in TIERS}
        tries = _format_tries(own, map_tier, given)
        if len(MAPS[want.product].formats) == 1:
            tries = (
                Trial(
                    tries[0].tier, map_tier, given | {"fmt": tries[0].series, "tier": "balanced"}, None, {}
                ),
            )
        metrics = MAPS[want.product].metrics
        note = "The time holds the map's rows and its mips."
        found.append(TrialGroup(title, "block compression", want.artifact, metrics, tries, TIERS, note))
    return found


def sky_groups(order: BakeJob) -> list[TrialGroup]:
    """What there is to be measured of an order of the maker "cubemap"."""
    given = {"paths": [order.sources[f"face{i}"] for i in range(6)]}
    tries = (Trial("half floats", sky_tier, given, None, {}),)
    artifact = order.wants[0].artifact
    return [TrialGroup("sky", "cube map", artifact, ("sky_max_relative",), tries)]


def _format_tries(own: dict[str, tuple[str, ...]], call: Any, given: dict[str, Any]) -> tuple[Trial, ...]:
    """Every format with every tier of its encoder, the smallest first; the tier's own format bears its name
    alone. own: the formats of each tier, its own first."""
    tries = []
    for fmt in own[TIERS[0]]:
        short = fmt.partition("_")[0]
        if not fmt.startswith("BC"):
            tries.append(Trial(short, call, given | {"fmt": fmt, "tier": "balanced"}, fmt, {"format": fmt}))
            continue
        for tier in TIERS:
            label = tier if own[tier][0] == fmt else f"{tier} {short}"
            row = {"format": fmt, "tier": tier}
            tries.append(Trial(label, call, given | {"fmt": fmt, "tier": tier}, fmt, row))
    return tuple(tries)


def _picture(sources: dict[str, Path], settings: Settings) -> tuple[Any, bool, list[str]]:
    wraps = wraps_of(settings["wrap"])
    return color_values(sources["image"], sources.get("alpha"), wraps, layout_of(sources))


def color_tier(
    sources: dict[str, Path], settings: Settings, fmt: str, tier: str, runs: int | None
) -> TrialResult:
    """A colour texture with its mips; PSNR of level 0, decoded apart from the encoder."""
    values, encoded, _ = _picture(sources, settings)
    cutoff = settings["alpha_cutoff"] if values.shape[2] == 4 else None
    seconds, texture = timed(
        lambda: color_texture(values, fmt, encoded=encoded, alpha_cutoff=cutoff, tier=tier), runs
    )
    levels = color_levels(texture, values, encoded=encoded, alpha_cutoff=cutoff)
    return TrialResult(seconds, [flat_errors("color", levels[0])], _size(texture), fmt)


def _size(texture: Texture) -> int:
    return len(encode_ktx2(texture))


def _rows(sources: dict[str, Path], settings: Settings, names: tuple[str, ...], tier: str) -> MapRows:
    """The rows of some maps, as make_maps has them."""
    layout = layout_of(sources)
    relief = settings["relief"]
    rows, _ = map_rows(
        sources["image"],
        only=names,
        source=settings["source"],
        nodata="auto",
        strength=settings["strength"],
        wrap=settings["wrap"],
        green="up",
        tier=tier,
        filter_name=relief["filter"],
        destep=relief["destep"],
        uv=layout,
        gloss_groups=(settings.get("gloss_groups") or None) if layout else None,
        slope_scale=None,
        size_m=settings.get("size_m"),
        levels=relief_levels(relief),
        gloss=None,
        measure=True,
    )
    return rows


def map_tier(
    sources: dict[str, Path], settings: Settings, name: str, fmt: str, tier: str, runs: int | None
) -> TrialResult:
    """One map with its mips in a format; errors of level 0 against float64. The slopes are those of the
    filter that tier "balanced" takes, so that encoders alone differ."""
    rows = _rows(sources, settings, (name,), "balanced")

    def make() -> Texture:
        textures, mean = map_textures(rows, {name: fmt}, tier)
        return dudv_texture(rows, mean) if name == "dudv" else textures[name]

    seconds, texture = timed(make, runs)
    return TrialResult(seconds, [flat_errors(name, map_errors(name, rows, texture)[0])], _size(texture), fmt)


def _filter_group(order: BakeJob, base: str, artifact: str) -> TrialGroup:
    """The slope filters of a normal map: those that tiers take, or the one that the scene names."""
    given = {"sources": order.sources, "settings": order.settings}
    named = order.settings["relief"]["filter"]
    note = (
        "The error is the angle from the normals of eighth-order slopes, as far as it exceeds the cone that "
    )
    note += "the half steps of the source's codes leave open: what is surely wrong."
    tries: tuple[Trial, ...] = (Trial(named, filter_tier, given | {"tier": "balanced"}, "one", {}),)
    if named == "auto":
        tries = tuple(Trial(t, filter_tier, given | {"tier": t}, "one", {"tier": t}) for t in TIERS)
    metrics = ("normal_filter_p99_deg", "normal_filter_deg", "normal_filter_max_deg")
    return TrialGroup(f"{base} slopes", "slope filter", artifact, metrics, tries, TIERS, note)


def filter_tier(sources: dict[str, Path], settings: Settings, tier: str, runs: int | None) -> TrialResult:
    """The choice of a filter and the normals of level 0 that it gives."""
    first = _rows(sources, settings, ("normal",), tier).ground
    bits = read_image(sources["image"], finite=False).source_bits
    named = settings["relief"]["filter"]
    height, width = first.heights.shape

    def make() -> HeightMap:
        ground = first
        if named == "auto":
            name = choose_filter(first.heights, bits, first.wrap, tier, first.islands, first.codes)
            held = tier == "exact" and first.codes is not None
            ground = no_worse_than_fast(replace(first, filter_name=name, held=held))
        run(lambda band: _drop(normal_rows(ground, *band)), bands_of(height, width))
        return ground

    seconds, ground = timed(make, runs)
    return TrialResult(seconds, [filter_errors(ground)], None, ground.filter_name)


def _drop(rows: object) -> None:
    """Normals that only had to be made."""


def sky_tier(paths: list[Path], runs: int | None) -> TrialResult:
    """The sky's mips and half floats; the largest error of level 0."""
    stack, pictures, _ = read_faces(paths)
    seconds, texture = timed(lambda: cubemap.encode_cube(cubemap.cube_mips(stack)), runs)
    return TrialResult(
        seconds, [{"sky_max_relative": sky_error(texture, pictures)}], _size(texture), texture.format
    )

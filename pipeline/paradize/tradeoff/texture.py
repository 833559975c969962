"""The stages of a picture: block compression of colour and maps in every format, slope filters of normal
maps, the sky."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from paradize.bakers.authored.bake import bake_authored
from paradize.bakers.color import color_formats, color_texture, color_values
from paradize.bakers.cubemap import read_faces
from paradize.bakers.maps.bake import map_rows
from paradize.bakers.maps.rows import MapRows, filter_errors, no_worse_than_fast
from paradize.bakers.maps.textures import dudv_texture, map_errors, map_textures
from paradize.bakers.product import MapProduct, flat_errors, wraps_of
from paradize.bakers.registry import layout_of, map_settings
from paradize.data import HeightMap, Texture
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.map_table import MAPS
from paradize.metrics.levels import color_levels
from paradize.readers.image import read_image
from paradize.scene.baker_settings import AuthoredSettings
from paradize.scene.jobs import BakeJob
from paradize.stages import cubemap
from paradize.stages.compress import formats_of
from paradize.stages.filters import choose_filter
from paradize.stages.normal import normal_rows
from paradize.stages.sweep import bands_of, run
from paradize.tiers import TIERS
from paradize.tradeoff.timing import Trial, TrialGroup, TrialResult, timed

Settings = dict[str, Any]


def color_groups(job: BakeJob) -> list[TrialGroup]:
    """The groups of a job of the baker "color". Reads the sources."""
    values, encoded, _ = _picture(job.sources, job.settings)
    name = job.settings["product"]
    if name == "emission" and (values == values[0, 0]).all():
        return []  # a constant, no texture
    own = {tier: color_formats(values, encoded=encoded, tier=tier)[0] for tier in TIERS}
    arguments = {"sources": job.sources, "settings": job.settings}
    trials = _format_trials(own, color_tier, arguments)
    note = "The time includes the mips, in linear light."
    artifact = job.outputs[0].artifact
    return [
        TrialGroup(
            name=job.name,
            stage="block compression",
            artifact=artifact,
            metrics=MAPS[name].metrics,
            trials=trials,
            declared=TIERS,
            note=note,
        )
    ]


def authored_groups(job: BakeJob) -> list[TrialGroup]:
    """The groups of a job of the baker "authored"; none of a map that is a constant. Reads the sources."""
    made = _drawn(job.sources, job.settings, tier=TIERS[0], measure=False)
    groups = []
    for output in job.outputs:
        name, texture = output.product, made[output.product]
        if texture.constant is not None:
            continue
        narrow = texture.format in MAPS[name].narrow_formats
        own = {
            tier: formats_of(name, texture.height, texture.width, tier=tier, narrow=narrow) for tier in TIERS
        }
        arguments = {"sources": job.sources, "settings": job.settings, "name": name}
        trials = _format_trials(own, authored_tier, arguments)
        note = "The time includes reading the pictures, and the mips."
        title = f"{job.name.removesuffix(' maps')} {name}"
        stage, metrics = "block compression", MAPS[name].metrics
        if name == "occlusion" and job.settings["occlusion_cast"]:
            stage, metrics = "cast occlusion", ("occlusion_cast_p99", "occlusion_cast_mean", *metrics)
            note = "The time includes reading the model, the rays and the mips."
        groups.append(
            TrialGroup(
                name=title,
                stage=stage,
                artifact=output.artifact,
                metrics=metrics,
                trials=trials,
                declared=TIERS,
                note=note,
            )
        )
    return groups


def map_groups(job: BakeJob) -> list[TrialGroup]:
    """The groups of a job of the baker "maps". Reads the sources."""
    height, width = read_image(job.sources["image"], finite=False).values.shape[:2]
    base = job.name.removesuffix(" maps")
    groups = []
    for output in job.outputs:
        arguments = {"sources": job.sources, "settings": job.settings, "name": output.product}
        title = f"{base} {output.product}"
        if output.product == "normal":
            groups.append(_filter_group(job, base, output.artifact))
        own = {tier: formats_of(output.product, height, width, tier=tier) for tier in TIERS}
        trials = _format_trials(own, map_tier, arguments)
        if len(MAPS[output.product].formats) == 1:
            trials = (
                Trial(
                    trials[0].tier,
                    map_tier,
                    arguments | {"fmt": trials[0].series, "tier": "balanced"},
                    None,
                    {},
                ),
            )
        metrics = MAPS[output.product].metrics
        note = "The time includes the map's rows and its mips."
        groups.append(
            TrialGroup(
                name=title,
                stage="block compression",
                artifact=output.artifact,
                metrics=metrics,
                trials=trials,
                declared=TIERS,
                note=note,
            )
        )
    return groups


def sky_groups(job: BakeJob) -> list[TrialGroup]:
    """The group of a job of the baker "cubemap"."""
    arguments = {"paths": list(job.sources.values())}
    trials = (Trial("half floats", sky_tier, arguments, None, {}),)
    artifact = job.outputs[0].artifact
    return [TrialGroup("sky", "cube map", artifact, ("sky_max_relative",), trials)]


def _format_trials(
    own: dict[str, tuple[str, ...]], call: Any, arguments: dict[str, Any]
) -> tuple[Trial, ...]:
    """Every format with every tier of its encoder, the smallest first. The format that a tier takes by itself
    is named after the tier alone. own: the formats of each tier, the one that it takes first."""
    trials = []
    for fmt in own[TIERS[0]]:
        short = fmt.partition("_")[0]
        if not fmt.startswith("BC"):
            trials.append(
                Trial(short, call, arguments | {"fmt": fmt, "tier": "balanced"}, fmt, {"format": fmt})
            )
            continue
        for tier in TIERS:
            label = tier if own[tier][0] == fmt else f"{tier} {short}"
            row = {"format": fmt, "tier": tier}
            trials.append(Trial(label, call, arguments | {"fmt": fmt, "tier": tier}, fmt, row))
    return tuple(trials)


def _picture(sources: dict[str, Path], settings: Settings) -> tuple[Any, bool, list[str]]:
    wraps = wraps_of(settings["wrap"])
    opaque = settings.get("opaque", False) or settings.get("product") == "emission"
    alpha = None if opaque else sources.get("alpha")
    materials = settings.get("layout_materials", ())
    return color_values(
        sources["image"],
        alpha,
        wraps,
        layout_of(sources),
        materials,
        opaque=opaque,
        alpha_channel=settings.get("alpha_channel", "luminance"),
        alpha_inverted=settings.get("alpha_inverted", False),
        white=settings.get("white", False),
        srgb=settings.get("srgb", False),
    )


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
    name = settings["product"]
    return TrialResult(seconds, [flat_errors(name, levels[0])], _size(texture), fmt)


def _drawn(sources: dict[str, Path], settings: Settings, **more: Any) -> dict[str, MapProduct]:
    """Authored maps, as the baker makes them, whatever the budget and zstd."""
    drawn = {role: path for role, path in sources.items() if role.partition(",")[0] != "layout"}
    used = AuthoredSettings(**settings | {"budget": {}, "zstd": None})
    return bake_authored(drawn, used, uv=layout_of(sources), **more)


def authored_tier(
    sources: dict[str, Path], settings: Settings, name: str, fmt: str, tier: str, runs: int | None
) -> TrialResult:
    """An authored map with its mips in a format; errors of level 0 against its picture."""
    own = {"tier": tier, "fmt": fmt, "only": [name]}
    seconds, made = timed(lambda: _drawn(sources, settings, measure=False, **own)[name], runs)
    errors = _drawn(sources, settings, **own)[name].errors
    return TrialResult(seconds, [errors], len(made.data), fmt)


def _size(texture: Texture) -> int:
    return len(encode_ktx2(texture))


def _rows(sources: dict[str, Path], settings: Settings, names: tuple[str, ...], tier: str) -> MapRows:
    """The rows of some maps, as the baker makes them."""
    used, layout = map_settings(sources, settings)
    rows, _ = map_rows(sources["image"], replace(used, only=names), uv=layout, tier=tier)
    return rows


def map_tier(
    sources: dict[str, Path], settings: Settings, name: str, fmt: str, tier: str, runs: int | None
) -> TrialResult:
    """One map with its mips in a format; errors of level 0 against float64. Slopes come from the filter of
    tier "balanced", so that only the encoders differ."""
    rows = _rows(sources, settings, (name,), "balanced")

    def make() -> Texture:
        textures, mean = map_textures(rows, {name: fmt}, tier)
        return dudv_texture(rows, mean) if name == "dudv" else textures[name]

    seconds, texture = timed(make, runs)
    return TrialResult(seconds, [flat_errors(name, map_errors(name, rows, texture)[0])], _size(texture), fmt)


def _filter_group(job: BakeJob, base: str, artifact: str) -> TrialGroup:
    """The slope filters of a normal map: the one of each tier, or the one that the scene names."""
    arguments = {"sources": job.sources, "settings": job.settings}
    named = job.settings["filter"]
    note = "The error is the angle to the normals of eighth-order slopes, less the angle that the source's "
    note += "rounding to 8 or 16 bits leaves undecided."
    trials: tuple[Trial, ...] = (Trial(named, filter_tier, arguments | {"tier": "balanced"}, "paradize", {}),)
    if named == "auto":
        trials = tuple(Trial(t, filter_tier, arguments | {"tier": t}, "paradize", {"tier": t}) for t in TIERS)
    metrics = ("normal_filter_p99_deg", "normal_filter_deg", "normal_filter_max_deg")
    return TrialGroup(
        name=f"{base} slopes",
        stage="slope filter",
        artifact=artifact,
        metrics=metrics,
        trials=trials,
        declared=TIERS,
        note=note,
    )


def filter_tier(sources: dict[str, Path], settings: Settings, tier: str, runs: int | None) -> TrialResult:
    """Chooses a filter and makes the normals of level 0."""
    first = _rows(sources, settings, ("normal",), tier).height_map
    bits = read_image(sources["image"], finite=False).source_bits
    named = settings["filter"]
    height, width = first.heights.shape

    def make() -> HeightMap:
        heights = first
        if named == "auto":
            name = choose_filter(first.heights, bits, first.wrap, tier, first.islands, first.height_levels)
            held = tier == "exact" and first.height_levels is not None
            heights = no_worse_than_fast(replace(first, filter_name=name, clamp_slopes=held))
        run(lambda band: _drop(normal_rows(heights, *band)), bands_of(height, width))
        return heights

    seconds, heights = timed(make, runs)
    return TrialResult(seconds, [filter_errors(heights)], None, heights.filter_name)


def _drop(rows: object) -> None:
    """Drops normals that were made only to be timed."""


def sky_tier(paths: list[Path], runs: int | None) -> TrialResult:
    """Makes the sky's mips and half floats; the largest error of level 0."""
    faces = read_faces(paths)
    seconds, texture = timed(lambda: cubemap.encode_cube(cubemap.cube_mips(faces.light)), runs)
    return TrialResult(seconds, [faces.errors(texture)], _size(texture), texture.format)

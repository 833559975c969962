"""Authored pictures of a material's maps -> its textures, with the measured error of every level.

The conventions are those of formats/FORMAT.md: normals are green up, gloss holds specular intensity and
smoothness, occlusion 1 where nothing is hidden. Pictures are data, whatever their profile of colours says.
A map whose texels are all equal is not a texture: the product says its constant, which the material's factor
takes. A tilted normal map is a texture all the same, since no factor tilts, and so is occlusion that hides
light, as one texel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from paradize.bakers.authored.cast import CastMap, cast_occlusion
from paradize.bakers.authored.normals import normal_coding
from paradize.bakers.authored.pictures import RolePicture, read_pictures
from paradize.bakers.authored.rows import F64, Channel, Layouts, MadeGloss, MadeNormals, NormalRows, ValueRows
from paradize.bakers.authored.textures import GlossMap, NormalMap, ValueMap
from paradize.bakers.maps.bake import map_rows, read_layout, unit_of_heights
from paradize.bakers.maps.rows import MapRows
from paradize.bakers.product import (
    MapProduct,
    constant_product,
    flat_errors,
    one_of,
    texture_product,
    within_budget,
    wraps_of,
)
from paradize.data import Texture
from paradize.errors import BakeError
from paradize.jobs.progress import report_step
from paradize.map_table import AUTHORED
from paradize.material import MAX_NORMAL_SCALE
from paradize.metrics.authored import true_occlusion, true_smoothness
from paradize.scene.baker_settings import AuthoredSettings, MapSettings
from paradize.stages.compress import formats_of
from paradize.tiers import TIERS

# The sources of each map.
ROLES = {
    "normal": ("normal",),
    "height": ("height",),
    "gloss": ("roughness", "smoothness", "specular", "brightness"),
    "occlusion": ("occlusion", "metalness"),
}
_FACTORS = ("roughness", "metalness", "specular", "occlusion_strength")


def bake_authored(
    sources: Mapping[str, Path],
    settings: AuthoredSettings | None = None,
    *,
    uv: Path | None = None,
    root: Path | None = None,
    tier: str = "balanced",
    measure: bool = True,
    fmt: str | None = None,
    **changes: Any,
) -> dict[str, MapProduct]:
    """The maps of the pictures by role, by name: those of `settings.only` that have a picture. With
    `occlusion_cast` there is no picture of occlusion: it is cast from the model `uv`.

    settings: None: as they are by themselves; changes: fields of them that are others. uv: a model whose UV
    layout the pictures follow; its gutters are filled. root: as of read_model. Where there is a normal
    map, or a picture "bumps" that one is made of, the mips of gloss are rougher by what its own mips lose.
    "brightness" is a picture that gloss is made of. measure: False leaves out errors (and with them the
    budget). fmt: the format of all of them, whatever the tier and the budget say.
    Raises SourceError for what cannot be read, BakeError for settings that cannot be met.
    """
    used = replace(settings or AuthoredSettings(), **changes)
    names = _names(sources, used, tier)
    report_step("reading")
    roles = [role for name in names for role in ROLES[name] if role != "brightness"]
    roles += ["normal"] if "gloss" in names and "normal" not in roles else []
    pictures = read_pictures(sources, roles, used.channels)
    cast = None
    if used.occlusion_cast and "occlusion" in names:
        cast = _cast(uv, root, used, tier, measure)
        pictures["occlusion"] = cast.picture
    wrap = wraps_of(used.wrap)
    materials = used.layout_materials
    layouts: Layouts = cache(
        lambda size: (
            None if uv is None else read_layout(uv, size[0], size[1], wrap, materials=materials, root=root)
        )
    )
    bumps = None
    if "gloss" in names and "normal" not in pictures and "bumps" in sources:
        made_with = MapSettings(**used.bumps or {})
        bumps = map_rows(sources["bumps"], made_with, uv=uv, root=root, tier=tier, measure=measure)[0]
    brightness, said = None, list[str]()
    if "gloss" in names and "brightness" in sources:
        made_with = MapSettings(**used.brightness or {})
        rows, picture = map_rows(
            sources["brightness"], made_with, uv=uv, root=root, tier=tier, measure=measure
        )
        brightness, said = MadeGloss(rows, layouts), picture.warnings
    maps = _Maps(
        pictures=pictures,
        settings=used,
        layouts=layouts,
        wrap=wrap,
        measure=measure,
        bumps=bumps,
        brightness=brightness,
    )
    made = {name: _product(name, maps, used, tier, fmt) for name in names}
    if brightness is not None:
        made["gloss"] = replace(made["gloss"], warnings=[*made["gloss"].warnings, *said])
    return made if cast is None else made | {"occlusion": _with_cast(made["occlusion"], cast)}


def _cast(
    uv: Path | None, root: Path | None, settings: AuthoredSettings, tier: str, measure: bool
) -> CastMap:
    if uv is None:
        mend = "name a model with a UV layout of its own, or give a picture of the occlusion"
        raise BakeError("occlusion is cast from a mesh, and its UVs say where to", mend=mend)
    return cast_occlusion(uv, settings, tuple(settings.layout_materials), tier, root=root, measure=measure)


def _with_cast(product: MapProduct, cast: CastMap) -> MapProduct:
    errors = product.errors if product.constant else product.errors | cast.errors
    return replace(product, errors=errors, warnings=[*product.warnings, *cast.warnings])


def _names(sources: Mapping[str, Path], settings: AuthoredSettings, tier: str) -> list[str]:
    """The maps to make. Raises BakeError for settings that cannot be met."""
    known = [*(role for roles in ROLES.values() for role in roles), "bumps"]
    one_of("map", [name for name in settings.only if name not in AUTHORED], AUTHORED)
    one_of("role", [role for role in sources if role not in known], known)
    one_of("tier", [] if tier in TIERS else [tier], TIERS)
    if not -MAX_NORMAL_SCALE <= settings.normal_scale <= MAX_NORMAL_SCALE:
        raise BakeError(
            f"the scale of normals is {settings.normal_scale}; up to {MAX_NORMAL_SCALE:g} is taken"
        )
    for name in _FACTORS:
        if not 0.0 <= getattr(settings, name) <= 1.0:
            raise BakeError(f"{name} is {getattr(settings, name)}; 0 to 1 is the range")
    if "roughness" in sources and "smoothness" in sources:
        mend = "leave one of them out"
        raise BakeError("a roughness and a smoothness map of one material", mend=mend)
    if "brightness" in sources and any(role in sources for role in ROLES["gloss"][:3]):
        raise BakeError("gloss that is made of a picture, and an authored one", mend="leave one of them out")
    if settings.occlusion_cast:
        if "occlusion" in sources:
            mend = "leave one of them out"
            raise BakeError("a picture of occlusion, and occlusion cast from the mesh", mend=mend)
        sources = {**sources, "occlusion": Path()}
    return [name for name in AUTHORED if name in settings.only and any(r in sources for r in ROLES[name])]


class _Maps:
    """The maps that are asked for, one at a time. warnings: of all so far that were made."""

    def __init__(
        self,
        pictures: dict[str, RolePicture],
        settings: AuthoredSettings,
        layouts: Layouts,
        wrap: tuple[bool, bool],
        measure: bool,
        bumps: MapRows | None,
        brightness: MadeGloss | None,
    ) -> None:
        self._pictures, self._settings, self._layouts = pictures, settings, layouts
        self._bumps, self._brightness = bumps, brightness
        self._wrap, self._measure = wrap, measure
        self._coding = cache(self._find_coding)

    def make(self, name: str) -> tuple[NormalMap | ValueMap | GlossMap, list[str]]:
        """A map and its warnings."""
        if name == "normal":
            _, warnings = self._coding()
            return NormalMap(self._normals(None), measure=self._measure), warnings
        rows: ValueRows | MadeGloss
        if name == "gloss" and self._brightness is not None:
            rows, warnings = self._brightness, []
        else:
            channels, warnings = self._channels(name)
            rows = ValueRows(channels, self._layouts, self._wrap)
            warnings += _enlarged(channels, rows.size)
        truth = rows.truth(self._layouts) if self._measure else None
        if isinstance(rows, ValueRows) and name != "gloss":
            return ValueMap(rows, truth), warnings
        normals: NormalRows | MadeNormals | None = None
        if "normal" in self._pictures:
            normals = self._normals(rows.size)
        elif self._bumps is not None:
            normals = MadeNormals(self._bumps, self._layouts, self._wrap, rows.size)
        return GlossMap(rows, normals, truth), warnings

    def reader_warnings(self, name: str) -> dict[str, None]:
        """Warnings of the readers of the pictures of a map, each once."""
        found = (picture for role in ROLES[name] if (picture := self._pictures.get(role)))
        return dict.fromkeys(text for picture in found for text in picture.warnings)

    def one_texel(self, values: tuple[float, ...]) -> ValueMap:
        """A map of one texel of these values."""
        channels = [
            Channel(RolePicture(Path(), np.full((1, 1), value, np.float32)), 0.0, 1.0, lambda v: v)
            for value in values
        ]
        rows = ValueRows(channels, lambda _: None, self._wrap)
        return ValueMap(rows, rows.truth(lambda _: None) if self._measure else None)

    def _find_coding(self) -> tuple[Any, list[str]]:
        picture = self._pictures["normal"]
        return normal_coding(
            picture,
            self._layouts(picture.size),
            green_down=self._settings.green_down,
            scale=self._settings.normal_scale,
        )

    def _normals(self, size: tuple[int, int] | None) -> NormalRows:
        return NormalRows(self._pictures["normal"], self._coding()[0], self._layouts, self._wrap, size)

    def _channels(self, name: str) -> tuple[list[Channel], list[str]]:
        used = self._settings
        if name == "height":
            return self._height()
        if name == "gloss":
            rough = "roughness" if "roughness" in self._pictures else "smoothness"
            factor = used.roughness
            channels = [
                self._channel("specular", 0.0, used.specular, lambda v: v * used.specular, used.specular),
                self._channel(
                    rough, 1.0, -factor, lambda v: true_smoothness(v, factor), 1.0 - factor,
                    turned=rough == "smoothness",
                ),
            ]  # fmt: skip
        else:
            strength = used.occlusion_strength
            channels = [
                self._channel(
                    "occlusion", 1.0 - strength, strength, lambda v: true_occlusion(v, strength), 1.0
                ),
            ]
            if "metalness" in self._pictures:
                metal = used.metalness
                channels.append(self._channel("metalness", 0.0, metal, lambda v: v * metal, metal))
        return channels, _beyond(channels)

    def _channel(
        self,
        role: str,
        offset: float,
        gain: float,
        truth: Callable[[F64], F64],
        alone: float,
        *,
        turned: bool = False,
    ) -> Channel:
        """offset + gain * v of the role's picture; `alone` where it has none. turned: the picture holds
        1 - v."""
        if role not in self._pictures:
            return Channel(None, alone, 0.0, truth)
        if turned != (role in self._settings.inverted):
            turned_truth = truth
            offset, gain, truth = offset + gain, -gain, lambda v: turned_truth(1.0 - v)
        return Channel(self._pictures[role], offset, gain, truth)

    def _height(self) -> tuple[list[Channel], list[str]]:
        picture = self._pictures["height"]
        low, span = 0.0, 1.0
        warnings: list[str] = []
        if picture.values.dtype == np.float32:
            (low, span), warnings = unit_of_heights(picture.values, picture.path)
        elif picture.values.dtype == np.uint8:
            warnings = [
                f"{picture.path}: heights of 8 bits stand in 255 steps; save it with 16 bits or as float"
            ]
        gain, offset = 1.0 / span, -low / span
        if "height" in self._settings.inverted:
            return [Channel(picture, 1.0 - offset, -gain, lambda v: 1.0 - (v - low) / span)], warnings
        return [Channel(picture, offset, gain, lambda v: (v - low) / span)], warnings


def _beyond(channels: list[Channel]) -> list[str]:
    """Says which float values a map cannot hold."""
    found = []
    for picture in (channel.picture for channel in channels if channel.picture is not None):
        if picture.values.dtype != np.float32:
            continue
        least, most = float(picture.values.min()), float(picture.values.max())
        if least < 0.0 or most > 1.0:
            what = f"runs from {least:g} to {most:g}; what is below 0 counts as 0, and above 1 as 1"
            found.append(f"{picture.path}: {what}")
    return found


def _enlarged(channels: list[Channel], size: tuple[int, int]) -> list[str]:
    """The pictures that are smaller than their map."""
    return [
        f"{channel.picture.path}: {channel.picture.size[1]} x {channel.picture.size[0]} texels are enlarged "
        f"to {size[1]} x {size[0]}, the size of the picture beside it in the same map"
        for channel in channels
        if channel.picture is not None and not channel.picture.cast and channel.picture.size != size
    ]


def _product(name: str, maps: _Maps, used: AuthoredSettings, tier: str, fmt: str | None) -> MapProduct:
    made, warnings = maps.make(name)
    warnings = [*maps.reader_warnings(name), *warnings]
    constant = made.rows.constant()
    if constant is not None and name == "occlusion" and constant[0] < 1.0:
        made = maps.one_texel(constant)
    elif constant is not None:
        rows, columns = made.rows.size
        return constant_product(constant, columns, rows, tier, warnings)
    rows, columns = made.rows.size
    narrow = isinstance(made, ValueMap) and len(made.rows.channels) == 1
    formats = formats_of(name, rows, columns, tier=tier, narrow=name == "occlusion" and narrow)

    @cache
    def make(fmt: str) -> tuple[Texture, Any]:
        report_step(f"mips of {name}")
        texture = made.texture(fmt, tier)
        report_step(f"measuring {name}")
        return texture, made.errors(texture)

    def errors_of(encoded: tuple[Texture, Any]) -> dict[str, float]:
        return flat_errors(name, encoded[1][0]) if encoded[1] else {}

    kept = formats[-1 if used.uncompressed else 0 :] if fmt is None else (fmt,)
    (texture, levels), reason = within_budget(kept, make, errors_of, used.budget)
    errors = errors_of((texture, levels))
    return texture_product(texture, tier, used.zstd, errors, levels, warnings, reason=reason)

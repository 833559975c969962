"""Bakes a colour picture into an sRGB texture with mips in linear light, each level with its measured
error."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.bakers.product import (
    LevelErrors,
    MapProduct,
    constant_product,
    flat_errors,
    one_of,
    texture_product,
    within_budget,
    wraps_of,
)
from paradize.data import Image, Texture
from paradize.errors import BakeError
from paradize.kernels.bc7 import THREADS
from paradize.kernels.maps import linear_light
from paradize.metrics.levels import color_levels
from paradize.readers.image import read_image
from paradize.readers.model import read_model
from paradize.scene.baker_settings import ColorSettings
from paradize.scene.budget import METRICS
from paradize.stages import gutter
from paradize.stages.compress import (
    LevelWriter,
    block_warnings,
    encode_rows,
    formats_of,
    with_unseen_in_range,
)
from paradize.stages.mips import color_rows
from paradize.stages.resample import resized
from paradize.stages.sweep import level_count
from paradize.tiers import TIERS

Values = npt.NDArray[Any]
_COARSE_DB = 20.0  # a picture below is another one to the eye; photographs reach 30 and more
# How much an error of alpha may count beside one of a colour's channel in BC7.
ALPHA_WEIGHTS = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 24.0, 32.0)


def bake_color(
    path: Path,
    settings: ColorSettings | None = None,
    *,
    alpha: Path | None = None,
    uv: Path | None = None,
    root: Path | None = None,
    tier: str = "balanced",
    measure: bool = True,
    **changes: Any,
) -> MapProduct:
    """The picture at `path` as an sRGB texture with mips in linear light. Of emission alpha does not count,
    and where all texels are equal the product is their linear RGB, `constant`, and no texture.

    settings: None: as they are by themselves; changes: fields of them that are others. alpha: another picture
    whose luminance (or alpha) replaces the alpha; opaque pictures have none in the texture. uv: an OBJ whose
    UV layout the picture follows; its gutters are filled. root: as of read_model. tier: "exact" is BC7; of a
    picture with alpha, BC3 where BC7 has a lower PSNR of colour or of alpha than BC3 of tier "balanced".
    measure: False leaves out errors (and with them the budget).
    Raises SourceError and BakeError.
    """
    used = replace(settings or ColorSettings(), **changes)
    one_of("tier", [] if tier in TIERS else [tier], TIERS)
    if not 0.0 <= used.alpha_cutoff <= 1.0:
        raise BakeError(f"the alpha cutoff is {used.alpha_cutoff}; 0 to 1 is the range")
    wraps = wraps_of(used.wrap)
    name = used.product
    opaque = used.opaque or name == "emission"
    values, encoded, warnings = color_values(
        path,
        None if opaque else alpha,
        wraps,
        uv,
        used.layout_materials,
        opaque=opaque,
        alpha_channel=used.alpha_channel,
        alpha_inverted=used.alpha_inverted,
        white=used.white,
        srgb=used.srgb,
        root=root,
    )
    rows, columns = values.shape[:2]
    if name == "emission" and (values == values[0, 0]).all():
        light = linear_light(values[:1, :1], encoded=encoded)[0, 0]
        constant = tuple(min(max(float(value), 0.0), 1.0) for value in light)  # as a texture holds it
        return constant_product(constant, columns, rows, tier, warnings)
    if not used.uncompressed:
        warnings = [*warnings, *block_warnings(path, rows, columns)]
    cutoff = used.alpha_cutoff if values.shape[2] == 4 and used.alpha_cutoff > 0.0 else None

    formats, other, alpha_weight = color_formats(
        values, encoded=encoded, tier=TIERS[0] if used.uncompressed else tier
    )

    @cache
    def make(fmt: str) -> tuple[Texture, LevelErrors]:
        texture = color_texture(
            values, fmt, encoded=encoded, alpha_cutoff=cutoff, tier=tier, alpha_weight=alpha_weight
        )
        if not measure:
            return texture, []
        return texture, color_levels(texture, values, encoded=encoded, alpha_cutoff=cutoff)

    def errors_of(made: tuple[Texture, LevelErrors]) -> dict[str, float]:
        return flat_errors(name, made[1][0]) if made[1] else {}

    kept = formats[-1 if used.uncompressed else 0 :]
    (texture, levels), reason = within_budget(kept, make, errors_of, used.budget)
    reason = reason or other
    errors = errors_of((texture, levels)) if measure else {}
    psnr_db = errors.get(f"{name}_psnr_db", _COARSE_DB)
    if psnr_db < _COARSE_DB:
        what = (
            f"{texture.format} keeps its colours at {psnr_db:.3g} dB alone: they change from texel to texel"
        )
        warnings = [*warnings, f"{path}: {what}; a budget of {name}_psnr_db = 30 takes a more exact format"]
    return texture_product(texture, tier, used.zstd, errors, levels, warnings, reason=reason)


def color_values(
    path: Path,
    alpha: Path | None,
    wraps: tuple[bool, bool],
    uv: Path | None,
    materials: Collection[str] = (),
    *,
    opaque: bool = False,
    alpha_channel: str = "luminance",
    alpha_inverted: bool = False,
    white: bool = False,
    srgb: bool = False,
    root: Path | None = None,
) -> tuple[Values, bool, list[str]]:
    """The texels (h, w, 3 or 4) of level 0 as bake_color takes them from its sources, whether they are sRGB,
    and warnings. materials: those of the UV layout that count; none: all. opaque: what the picture says of
    alpha does not count. alpha_channel, alpha_inverted, white, srgb: as of ColorSettings."""
    image = read_image(path)
    if srgb and image.top is not None:  # floats are light
        image = replace(image, color_space="srgb", color_notes=())
    if white:
        full: Any = np.full((*image.values.shape[:2], 3), 255, np.uint8)
        image = Image(full, "srgb", 8, notes=image.notes)
    if opaque and image.values.shape[2] in (2, 4):
        seen: Any = np.ascontiguousarray(image.values[:, :, :-1])
        image = replace(image, values=seen)
    warnings = image.warnings(path)
    if image.values.dtype == np.float32 and float(image.values.max()) > 1.0:
        warnings.append(f"{path}: brighter than 1 in places; a colour texture holds 0..1")
    own = None
    if alpha is not None:
        drawn = read_image(alpha, color_space="data")
        warnings += [note for note in drawn.warnings(alpha) if note not in warnings]
        own = _alpha_of(drawn.values, alpha_channel, inverted=alpha_inverted)
        rows, columns = (max(sides) for sides in zip(image.values.shape[:2], own.shape[:2], strict=True))
        for name, values in (("the colour map", image.values), ("alpha", own)):
            if values.shape[:2] != (rows, columns):
                size = f"{values.shape[1]} x {values.shape[0]}"
                what = f"{size} texels of {name} are enlarged to {columns} x {rows}, the larger of the two"
                warnings.append(f"{path if values is image.values else alpha}: {what}")
        enlarged: Any = _enlarged(image.values, rows, columns, wraps)
        image, own = replace(image, values=enlarged), _enlarged(own, rows, columns, wraps)
    values = spread(_with_alpha(image, own), wraps)
    if uv is not None:
        values = _filled(values, uv, root, wraps, materials)
    return values, image.color_space == "srgb", warnings


def _enlarged(values: Values, rows: int, columns: int, wraps: tuple[bool, bool]) -> Values:
    """Texels as a sampler shows them at another size; codes stay codes."""
    if values.shape[:2] == (rows, columns):
        return values
    drawn = resized(Image(values, "data", 32).pixels, rows, columns, wraps)
    return drawn if values.dtype == np.float32 else np.rint(drawn * _top(values)).astype(values.dtype)


def color_formats(
    values: Values, *, encoded: bool, tier: str
) -> tuple[tuple[str, ...], str | None, float | None]:
    """The formats that a colour picture (h, w, 3 or 4) may take, the tier's own first, as the bake takes and
    `measure` shows them; why that is not the one that the tier declares; and the weight of alpha in BC7 where
    it was looked for."""
    rows, columns, channels = values.shape
    alpha = channels == 4
    formats = formats_of("color", rows, columns, tier=tier, alpha=alpha)
    if not alpha or formats[0] != "BC7_SRGB":
        return formats, None, None
    finest = _Finest(values, encoded)
    weight = finest.alpha_weight(tier)
    below, found = finest.errors("BC3_SRGB", "balanced"), finest.errors("BC7_SRGB", tier, weight)
    worse = [f"{key} {found[key]:g} for {below[key]:g}" for key in below if found[key] < below[key]]
    reason = f"BC7 leaves more than BC3 of tier balanced: {', '.join(worse)}" if worse else None
    return formats_of("color", rows, columns, alpha=alpha) if worse else formats, reason, weight


class _Finest:
    """Level 0 of a picture with alpha and sides divisible by four, for encoding in different ways."""

    def __init__(self, values: Values, encoded: bool) -> None:
        self.values, self.encoded = values, encoded
        plain = color_texture(values, "RGBA8_SRGB", encoded=encoded, alpha_cutoff=None, tier=TIERS[0])
        self.codes = np.frombuffer(plain.levels[0], np.uint8).reshape(*values.shape[:2], 4)

    def errors(self, fmt: str, tier: str, alpha_weight: float = 1.0) -> dict[str, float]:
        """PSNR of colour and of alpha, which budgets name."""
        data = encode_rows(self.codes, fmt, tier=tier, threads=THREADS, alpha_weight=alpha_weight)
        texture = Texture(fmt, self.values.shape[1], self.values.shape[0], (data,))
        level = color_levels(texture, self.values, encoded=self.encoded, alpha_cutoff=None)[0]
        return {key: value for key, value in flat_errors("color", level).items() if key in METRICS}

    def alpha_weight(self, tier: str) -> float:
        """The least weight of alpha with which BC7 leaves no more of alpha than BC3 of tier "balanced"; the
        largest where none does. BC3 has eight bytes for alpha, BC7 one line for colour and alpha, or less
        room for alpha: the more alpha weighs, the more of colour is left."""
        least = self.errors("BC3_SRGB", "balanced")["alpha_psnr_db"]

        def keeps(weight: float) -> bool:
            return self.errors("BC7_SRGB", tier, weight)["alpha_psnr_db"] >= least

        return ALPHA_WEIGHTS[min(bisect_left(ALPHA_WEIGHTS, True, key=keeps), len(ALPHA_WEIGHTS) - 1)]


def color_texture(
    values: Values,
    fmt: str,
    *,
    encoded: bool,
    alpha_cutoff: float | None,
    tier: str,
    alpha_weight: float | None = None,
) -> Texture:
    """Every level of a colour picture (h, w, 1..4), codes or floats, in a colour format. alpha_weight: of BC7
    with alpha, None: that which suits the picture."""
    height, width = values.shape[:2]
    writer = LevelWriter(fmt, height, width, level_count(height, width))
    if alpha_weight is None:
        has_alpha = fmt == "BC7_SRGB" and values.shape[2] == 4
        alpha_weight = _Finest(values, encoded).alpha_weight(tier) if has_alpha else 1.0
    weight = alpha_weight

    def put_rows(level: int, first: int, codes: npt.NDArray[np.uint8]) -> None:
        if level and fmt.startswith("BC") and values.shape[2] in (2, 4):
            codes = with_unseen_in_range(codes)
        writer.put(level, first, encode_rows(codes, fmt, tier=tier, alpha_weight=weight))

    color_rows(values, put_rows, encoded=encoded, alpha_cutoff=alpha_cutoff)
    return writer.texture()


def spread(values: Values, wraps: tuple[bool, bool]) -> Values:
    """Texels that are wholly transparent take the colour of the nearest visible one: what lies under them is
    chance, and would show as a fringe in filtering, as a cliff in heights. Alpha stays."""
    if values.shape[2] not in (2, 4):
        return values
    source = gutter.gutter_source(values[:, :, -1] > 0, wraps)
    if source is None:
        return values
    filled = gutter.fill_gutter(values, source)
    filled[:, :, -1] = values[:, :, -1]
    return filled


def _filled(
    values: Values, uv: Path, root: Path | None, wraps: tuple[bool, bool], materials: Collection[str]
) -> Values:
    """Returns the picture with the gutters of the model's UV layout filled. materials: those that count."""
    mesh = read_model(uv, root).mesh
    mesh = mesh.of_materials(materials) if materials else mesh
    islands = gutter.island_map(mesh, height=values.shape[0], width=values.shape[1], file=uv)
    return gutter.fill_gutter(values, gutter.layout_source(islands, mesh, wraps))


def _with_alpha(image: Image, own: Values | None) -> Values:
    """Colour (h, w, 3), or (h, w, 4) where anything is not opaque; codes where the file has codes. own: alpha
    (h, w, 1) that replaces the picture's."""
    values: Values = image.values
    channels = values.shape[2]
    if channels < 3:  # grey becomes red, green and blue
        color = np.repeat(values[:, :, :1], 3, axis=2)
        values = color if channels == 1 else np.concatenate([color, values[:, :, 1:]], axis=2)
    if own is not None:
        if own.dtype != values.dtype:
            values = Image(values, image.color_space, image.source_bits).pixels
            own = Image(own, "data", 32).pixels
        values = np.concatenate([values[:, :, :3], own], axis=2)
    if values.shape[2] == 4 and bool((values[:, :, 3] >= _top(values)).all()):
        values = np.ascontiguousarray(values[:, :, :3])
    return values


def _top(values: Values) -> float:
    """Returns the value that stands for 1."""
    return 1.0 if values.dtype == np.float32 else float(np.iinfo(values.dtype).max)


def _alpha_of(values: Values, channel: str, *, inverted: bool) -> Values:
    """The alpha (h, w, 1) of a picture, as ColorSettings says."""
    own = _alpha_texels(values, channel)
    return np.asarray(_top(values) - own, values.dtype) if inverted else own


def _alpha_texels(values: Values, channel: str) -> Values:
    """The alpha of a picture (h, w, 1..4): of a picture without alpha, "a" is opaque."""
    has_alpha = values.shape[2] in (2, 4)
    if channel == "a" and not has_alpha:
        return np.full_like(values[:, :, :1], _top(values))
    see_through = has_alpha and bool((values[:, :, -1] < _top(values)).any())
    if channel == "a" or (channel not in ("r", "g", "b") and see_through):
        return values[:, :, -1:]
    at = max("rgb".find(channel), 0) if values.shape[2] >= 3 else 0
    return values[:, :, at : at + 1]

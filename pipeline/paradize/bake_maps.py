"""A picture -> the maps of a material, each with its mips and its measured error; a colour texture; a cube
map.

`paradize maps` and the bake of a scene both come here. The conventions are those of formats/FORMAT.md:
normals are green up, du/dv is signed and without mean, gloss holds specular intensity and smoothness.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Image, Mesh, Texture
from paradize.errors import BakeError, SourceError
from paradize.formats.ktx2 import encode_ktx2
from paradize.formats.png import encode_png
from paradize.kernels.maps import Levels, linear_to_srgb8, srgb_to_linear
from paradize.kernels.mathx import linear_to_srgb
from paradize.metrics.angle import AngleError, filter_angle, normal_error
from paradize.metrics.psnr import psnr_db
from paradize.metrics.texels import decode_texels
from paradize.readers.image import read_image
from paradize.readers.obj import read_obj
from paradize.stages import compress, cubemap, gutter, mips
from paradize.stages.dudv import dudv_map
from paradize.stages.gloss import GlossSettings, gloss_map
from paradize.stages.height import height_from_color, height_from_height, luminance_plane
from paradize.stages.normal import TIERS, derivative_filter, normal_map

F32 = npt.NDArray[np.float32]
MAPS = ("normal", "height", "gloss", "dudv")
MAX_STRENGTH = 1e6


@dataclass(frozen=True)
class MapProduct:
    """One baked map. data: the file's bytes. format: KTX2's, or "PNG8" / "PNG16". error: the value of
    `metric`, which stands first in `errors` (metric -> value, six significant digits). tier: the one that
    was used."""

    data: bytes
    width: int
    height: int
    format: str
    error: float
    metric: str | None
    tier: str
    errors: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _Layout:
    """Where the map's UV islands lie: ids (h, w) int32, -1 outside; source: where each gutter texel comes
    from."""

    mesh: Mesh
    islands: npt.NDArray[np.int32]
    source: npt.NDArray[np.int32] | None


def bake_maps(
    path: Path,
    *,
    only: Sequence[str] = MAPS,
    source: str = "color",
    strength: float = 1.0,
    wrap: str | tuple[str, str] = "clamp",
    green: str = "up",
    fmt: str = "ktx2",
    tier: str = "balanced",
    uv: Path | None = None,
    gloss_groups: Collection[str] | None = None,
    slope_scale: float | tuple[float, float] | None = None,
    levels: Levels | None = None,
    gloss: GlossSettings | None = None,
) -> dict[str, MapProduct]:
    """The maps named by `only` ("normal", "height", "gloss", "dudv") of the picture at `path`.

    source: "color" (heights are the luminance) or "height". strength: full white stands so many percent of
    the map's width high, -1e6..1e6. slope_scale replaces it: amplitude in metres over the texel's size in
    metres, along (x, y).
    wrap: "repeat" or "clamp", or one for each of (x, y). green: "up" or "down", of normal and du/dv. fmt:
    "ktx2", with all mips, or "png". uv: an OBJ whose UV layout the picture follows: slopes stay inside
    islands, gutters are filled.
    gloss_groups: groups or materials of that OBJ that shine; None: all. levels shape the height, gloss the
    gloss.
    Raises SourceError for what cannot be read, BakeError for settings that cannot be met.
    """
    _one_of("map", [name for name in only if name not in MAPS], MAPS)
    _check(path, source, strength, green, fmt, tier)
    wraps = _wraps(wrap)
    if gloss_groups is not None and uv is None:
        raise BakeError("groups that shine need a UV layout", mend="name the OBJ whose UVs the map follows")
    image = read_image(path, color_space="data" if source == "height" else None)
    warnings = _warnings(path, image, source)
    rows, columns = image.pixels.shape[:2]
    layout = None if uv is None else _layout(uv, rows, columns, wraps)
    if source == "color":
        image = replace(image, values=_spread(image.pixels, wraps))

    from_height = source == "height"
    heights = height_from_height(image, levels) if from_height else height_from_color(image, levels)
    if slope_scale is None:
        slope = strength / 100.0 * columns
        slopes = (slope, slope)
    else:
        slopes = slope_scale if isinstance(slope_scale, tuple) else (slope_scale, slope_scale)
    if source == "color":
        unit, brightness = heights, luminance_plane(image)
    else:
        unit, ranged = _unit(heights, path)
        warnings += ranged
        brightness = unit
    filter_name = derivative_filter(tier, image.source_bits)
    bake = _Bake(
        path, rows, columns, wraps, slopes, filter_name, green == "down", fmt, TIERS[tier], layout, warnings
    )
    if TIERS[tier] != tier:
        warnings.append(f"{path}: maps have no tier {tier!r} yet; {TIERS[tier]!r} was used")
    normals = None
    if set(only) & {"normal", "dudv", "gloss"}:
        normals = bake.fill(
            normal_map(
                heights,
                slope_scale=slopes,
                wrap=wraps,
                filter_name=filter_name,
                green_down=bake.green_down,
                islands=None if layout is None else layout.islands,
            )
        )
    made: dict[str, MapProduct] = {}
    for name in only:
        if name == "height":
            made[name] = bake.height(bake.fill(unit[:, :, None]))
        elif name == "normal" and normals is not None:
            made[name] = bake.normal(normals, heights)
        elif name == "dudv" and normals is not None:
            made[name] = bake.dudv(dudv_map(normals), heights)
        elif normals is not None:
            mask = None
            if gloss_groups is not None and layout is not None:
                mask = gutter.group_mask(layout.mesh, gloss_groups, height=rows, width=columns, file=uv)
            made[name] = bake.gloss(bake.fill(gloss_map(brightness, gloss or GlossSettings(), mask)), normals)
    return made


@dataclass(frozen=True)
class _Bake:
    """What the maps of one picture share; each method makes one map of float data and measures what it
    became."""

    path: Path
    rows: int
    columns: int
    wrap: tuple[bool, bool]
    slopes: tuple[float, float]
    filter_name: str
    green_down: bool
    fmt: str
    tier: str
    layout: _Layout | None
    warnings: list[str]

    def fill(self, pixels: F32) -> F32:
        """The map with its gutters filled, where there is a UV layout."""
        return pixels if self.layout is None else gutter.fill_gutter(pixels, self.layout.source)

    def normal(self, normals: F32, heights: F32) -> MapProduct:
        if self.fmt == "png":
            codes = _signed_codes(normals)
            return self._png(codes, self._normal_errors(_read_signed(codes)[:, :, :2], heights))
        texture = compress.encode_normal(mips.normal_mips(mips.normal_means(normals)), tier=self.tier)
        return self._ktx2(texture, self._normal_errors(decode_texels(texture), heights))

    def _normal_errors(self, decoded: F32, heights: F32) -> dict[str, float]:
        found = self._angles(decoded, heights, less_mean=False)
        errors = {"normal_p99_deg": found.p99, "normal_mean_deg": found.mean, "normal_max_deg": found.max}
        errors["normal_filter_deg"] = filter_angle(
            heights, slope_scale=self.slopes, wrap=self.wrap, filter_name=self.filter_name
        )
        return errors

    def dudv(self, offsets: F32, heights: F32) -> MapProduct:
        if self.fmt == "png":
            codes = _signed_codes(np.dstack([offsets, np.zeros_like(offsets[:, :, :1])]))
            decoded = _read_signed(codes)[:, :, :2]
        else:
            texture = compress.encode_dudv(mips.scalar_mips(offsets))
            decoded = decode_texels(texture)
        found = self._angles(decoded, heights, less_mean=True)
        errors = {"dudv_p99_deg": found.p99, "dudv_mean_deg": found.mean, "dudv_max_deg": found.max}
        return self._png(codes, errors) if self.fmt == "png" else self._ktx2(texture, errors)

    def _angles(self, decoded: F32, heights: F32, *, less_mean: bool) -> AngleError:
        return normal_error(
            decoded,
            heights,
            slope_scale=self.slopes,
            wrap=self.wrap,
            filter_name=self.filter_name,
            green_down=self.green_down,
            islands=None if self.layout is None else self.layout.islands,
            less_mean=less_mean,
        )

    def height(self, unit: F32) -> MapProduct:
        if self.fmt == "png":
            codes = (unit.astype(np.float64) * 65535.0 + 0.5).astype(np.uint16)
            return self._png(codes, {"height_psnr_db": _psnr(codes / 65535.0, unit)})
        texture = compress.encode_height(mips.scalar_mips(unit), tier=self.tier)
        return self._ktx2(texture, {"height_psnr_db": _psnr(decode_texels(texture), unit)})

    def gloss(self, pixels: F32, normals: F32) -> MapProduct:
        if self.fmt == "png":
            codes = compress.unorm8(np.dstack([pixels, np.zeros_like(pixels[:, :, :1])]))
            return self._png(codes, {"gloss_psnr_db": _psnr(codes[:, :, :2] / 255.0, pixels)})
        texture = compress.encode_gloss(mips.gloss_mips(pixels, mips.normal_means(normals)), tier=self.tier)
        return self._ktx2(texture, {"gloss_psnr_db": _psnr(decode_texels(texture), pixels)})

    def _png(self, codes: npt.NDArray[Any], errors: dict[str, float]) -> MapProduct:
        name = "PNG16" if codes.dtype == np.uint16 else "PNG8"
        return self._product(encode_png(codes), name, errors)

    def _ktx2(self, texture: Texture, errors: dict[str, float]) -> MapProduct:
        return self._product(encode_ktx2(texture), texture.format, errors)

    def _product(self, data: bytes, name: str, errors: dict[str, float]) -> MapProduct:
        metric = next(iter(errors))
        return MapProduct(
            data,
            self.columns,
            self.rows,
            name,
            errors[metric],
            metric,
            self.tier,
            errors,
            list(self.warnings),
        )


def bake_color(
    path: Path,
    *,
    alpha: Path | None = None,
    wrap: str | tuple[str, str] = "clamp",
    tier: str = "balanced",
    alpha_cutoff: float = 0.5,
    uv: Path | None = None,
) -> MapProduct:
    """The picture at `path` as an sRGB texture with mips in linear light.

    alpha: another picture whose luminance (or alpha) replaces the alpha. wrap: "repeat" or "clamp", or one
    for each of (x, y). alpha_cutoff, 0..1: each mip keeps the share of texels that pass it. uv: an OBJ whose
    UV layout the picture follows; its gutters are filled. Opaque pictures have no alpha in the texture.
    Raises SourceError and BakeError.
    """
    _one_of("tier", [] if tier in TIERS else [tier], TIERS)
    if not 0.0 <= alpha_cutoff <= 1.0:
        raise BakeError(f"the alpha cutoff is {alpha_cutoff}; 0 to 1 is the range")
    wraps = _wraps(wrap)
    image = read_image(path)
    rows, columns = image.pixels.shape[:2]
    warnings = []
    if image.source_bits == 32 and float(image.pixels.max()) > 1.0:
        warnings.append(f"{path}: brighter than 1 in places; a colour texture holds 0..1")
    pixels = _with_color_and_alpha(image.pixels)
    if alpha is not None:
        pixels = np.dstack([pixels[:, :, :3], _alpha_of(alpha, rows, columns)])
    if pixels.shape[2] == 4 and bool((pixels[:, :, 3] >= np.float32(1)).all()):
        pixels = pixels[:, :, :3]
    pixels = _spread(np.ascontiguousarray(pixels), wraps)
    if uv is not None:
        pixels = gutter.fill_gutter(pixels, _layout(uv, rows, columns, wraps).source)
    pixels = np.clip(pixels, np.float32(0), np.float32(1))
    if image.color_space == "srgb":
        codes = compress.unorm8(pixels)
        truth: npt.NDArray[np.floating] = pixels
        bits = image.source_bits if alpha is None or pixels.shape[2] == 3 else 32
        linear = srgb_to_linear(pixels, source_bits=bits)
    else:
        linear = pixels
        codes = linear_to_srgb8(linear)
        truth = linear_to_srgb(linear[:, :, :3])
        if linear.shape[2] == 4:
            truth = np.dstack([truth, linear[:, :, 3]])
    cutoff = alpha_cutoff if pixels.shape[2] == 4 else None
    texture = compress.encode_color(mips.color_mips(linear, alpha_cutoff=cutoff), codes, tier=tier)
    decoded = decode_texels(texture)
    errors = {"color_psnr_db": _psnr(decoded[:, :, :3], truth[:, :, :3])}
    if pixels.shape[2] == 4:
        errors["alpha_psnr_db"] = _psnr(decoded[:, :, 3], truth[:, :, 3])
    return MapProduct(
        encode_ktx2(texture),
        columns,
        rows,
        texture.format,
        errors["color_psnr_db"],
        "color_psnr_db",
        tier,
        errors,
        warnings,
    )


def bake_cubemap(paths: Sequence[Path]) -> MapProduct:
    """Six square pictures of one size, a power of two, +X -X +Y -Y +Z -Z, as a half-float cube map with mips.

    sRGB pictures are linearised. The error is the largest of any channel, relative to the texel's brightest.
    Raises SourceError.
    """
    if len(paths) != 6:
        raise SourceError(f"a cube map has six faces, not {len(paths)}")
    faces: list[F32] = []
    warnings: list[str] = []
    for path in paths:
        image = read_image(path)
        rows, columns, channels = image.pixels.shape
        size = faces[0].shape[0] if faces else rows
        if rows != columns or rows & (rows - 1) or rows != size:
            what = f"{columns} x {rows} texels; faces are square, powers of two, and of one size ({size})"
            raise SourceError(what, file=path)
        pixels = image.pixels
        if image.color_space == "srgb":
            pixels = srgb_to_linear(pixels, source_bits=image.source_bits)
        if image.source_bits == 8:
            warnings.append(f"{path}: 8 bits per channel; a sky shows bands")
        if float(pixels.max()) > cubemap.HALF_MAX:
            warnings.append(f"{path}: brighter than {cubemap.HALF_MAX:g}, which half floats end at")
        faces.append(np.repeat(pixels[:, :, :1], 3, axis=2) if channels < 3 else pixels[:, :, :3])
    stack = np.stack(faces)
    texture = cubemap.encode_cube(cubemap.cube_mips(stack))
    worst = 0.0
    for face in range(6):
        truth = stack[face].astype(np.float64)
        gap = np.abs(decode_texels(texture, 0, face)[:, :, :3] - truth).max(axis=2)
        worst = max(worst, float((gap / np.maximum(np.abs(truth).max(axis=2), 1e-4)).max()))
    error = float(f"{worst:.6g}")
    size = stack.shape[1]
    return MapProduct(
        encode_ktx2(texture), size, size, texture.format, error, "sky_max_relative", "balanced",
        {"sky_max_relative": error}, warnings,
    )  # fmt: skip


def _check(path: Path, source: str, strength: float, green: str, fmt: str, tier: str) -> None:
    _one_of("source", [] if source in ("color", "height") else [source], ("color", "height"))
    _one_of("green", [] if green in ("up", "down") else [green], ("up", "down"))
    _one_of("format", [] if fmt in ("ktx2", "png") else [fmt], ("ktx2", "png"))
    _one_of("tier", [] if tier in TIERS else [tier], TIERS)
    if not -MAX_STRENGTH <= strength <= MAX_STRENGTH:
        raise BakeError(f"strength {strength} is out of range; up to {MAX_STRENGTH:g} is taken", file=path)


def _one_of(what: str, wrong: Sequence[str], allowed: Collection[str]) -> None:
    if wrong:
        raise BakeError(f"no {what} {', '.join(map(repr, wrong))}", mend=f"one of {', '.join(allowed)}")


def _wraps(wrap: str | tuple[str, str]) -> tuple[bool, bool]:
    pair = (wrap, wrap) if isinstance(wrap, str) else wrap
    _one_of("wrap", [word for word in pair if word not in ("repeat", "clamp")], ("repeat", "clamp"))
    return pair[0] == "repeat", pair[1] == "repeat"


def _warnings(path: Path, image: Image, source: str) -> list[str]:
    if source == "height" and image.source_bits == 8:
        return [f"{path}: heights of 8 bits stand in 255 steps; save it with 16 bits or as float"]
    return []


def _layout(uv: Path, rows: int, columns: int, wraps: tuple[bool, bool]) -> _Layout:
    mesh = read_obj(uv).mesh
    islands = gutter.island_map(mesh, height=rows, width=columns, file=uv)
    return _Layout(mesh, islands, gutter.gutter_source(islands >= 0, wraps))


def _unit(heights: F32, path: Path) -> tuple[F32, list[str]]:
    """The heights in 0..1: as they are where they fit, else stretched from lowest to highest, with a
    warning."""
    low, high = float(heights.min()), float(heights.max())
    if low >= 0.0 and high <= 1.0:
        return heights, []
    if high == low:
        return np.zeros_like(heights), [f"{path}: every height is {low:g}; the height map holds 0"]
    unit = ((heights.astype(np.float64) - low) / (high - low)).astype(np.float32)
    return unit, [f"{path}: heights run from {low:g} to {high:g}; the height map holds them as 0..1"]


def _signed_codes(values: F32) -> npt.NDArray[np.uint8]:
    """-1..1 -> 0..255 so that 2v / 255 - 1 is nearest, and zero is 128 (read as 0, as 127 is)."""
    return ((np.clip(values, -1.0, 1.0).astype(np.float64) + 1.0) * 127.5 + 0.5).astype(np.uint8)


def _read_signed(codes: npt.NDArray[np.uint8]) -> F32:
    """What glTF's 2v / 255 - 1 reads, with 127 and 128 both exactly 0."""
    values = codes.astype(np.float32) * np.float32(2.0 / 255.0) - np.float32(1)
    return np.where((codes == 127) | (codes == 128), np.float32(0), values)


def _with_color_and_alpha(pixels: F32) -> F32:
    """Grey becomes red, green and blue; alpha stays: 3 or 4 channels."""
    if pixels.shape[2] >= 3:
        return pixels
    color = np.repeat(pixels[:, :, :1], 3, axis=2)
    return color if pixels.shape[2] == 1 else np.concatenate([color, pixels[:, :, 1:]], axis=2)


def _spread(pixels: F32, wraps: tuple[bool, bool]) -> F32:
    """Texels that are wholly transparent take the colour of the nearest visible one: what lies under them is
    chance, and would show as a fringe in filtering, as a cliff in heights. Alpha stays."""
    if pixels.shape[2] not in (2, 4):
        return pixels
    source = gutter.gutter_source(pixels[:, :, -1] > 0, wraps)
    if source is None:
        return pixels
    return np.dstack([gutter.fill_gutter(pixels, source)[:, :, :-1], pixels[:, :, -1:]])


def _alpha_of(path: Path, rows: int, columns: int) -> F32:
    """The alpha (h, w) of a picture: its own, or its brightness as it is stored."""
    pixels = read_image(path, color_space="data").pixels
    if pixels.shape[:2] != (rows, columns):
        what = f"{pixels.shape[1]} x {pixels.shape[0]} texels; its colour map has {columns} x {rows}"
        raise SourceError(what, file=path, mend="give both one size")
    if pixels.shape[2] in (2, 4):
        own = pixels[:, :, -1]
        if bool((own < 1).any()):
            return own
    return np.ascontiguousarray(pixels[:, :, 0])


def _psnr(decoded: npt.NDArray[np.floating], truth: npt.NDArray[np.floating]) -> float:
    return float(f"{psnr_db(decoded, truth):.6g}")

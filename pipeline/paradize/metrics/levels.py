"""The error of every mip level of a baked map against float64 references, level 0 first.

Level 0's truth is computed from the source in float64; the truth of level k is the mean of level 0's over the
area of each of its texels (not a mean of means, which is another where sizes are odd). Decoders, filters,
curves and means are the reference kernels' own.

The normals of a ground have one truth for all tiers and filters: the eighth-order differences of the source's
heights, within a thousandth of a degree of smooth ground from a wavelength of 8 texels on. Heights that stand
in codes are known to half a step only: around the truth lies the cone of all normals that the half steps
allow (the largest angle to a normal whose slopes lie within their reach), and an angle counts as far as it
exceeds the cone; at level k, the mean of the cones, which is generous: chance makes half steps cancel. The
heights are the source's by its own formula (source.py), not what the stages made of it.
Angles are degrees; PSNR is in dB of a peak of 1, at most LOSSLESS_DB; p99 is the smallest error that 99 of
100 do not pass. All numbers have six significant digits.
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import six
from paradize.kernels.reference import maps as reference_maps
from paradize.metrics.filters import EXACT, central_weights, taps
from paradize.metrics.texels import bc7_codes, decode_texels

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import HeightMap, Texture
    from paradize.kernels.reference.maps import Error

    F32 = npt.NDArray[np.float32]

LOSSLESS_DB = 120.0  # told where the mean squared error is below 1e-12

# How the kernels read a texture's format: name and, of plain texels, channels. Others are decoded first.
_TEXELS = {
    "R8_UNORM": ("unorm8", 1),
    "RG8_UNORM": ("unorm8", 2),
    "RG8_SNORM": ("snorm8", 2),
    "RGBA8_UNORM": ("unorm8", 4),
    "RGBA8_SRGB": ("unorm8", 4),
    "R16_UNORM": ("unorm16", 1),
    "RG16_UNORM": ("unorm16", 2),
    "RG16_SNORM": ("snorm16", 2),
    "R32F": ("float32", 1),
    "BC1_RGB_UNORM": ("bc1", 0),
    "BC1_RGB_SRGB": ("bc1", 0),
    "BC3_UNORM": ("bc3", 0),
    "BC3_SRGB": ("bc3", 0),
    "BC4_UNORM": ("bc4", 0),
    "BC5_UNORM": ("bc5", 0),
    "BC5_SNORM": ("bc5_signed", 0),
}


def _view(texture: Texture) -> reference_maps.Texture:
    """The texture for the kernels."""
    if texture.format in _TEXELS:
        name, channels = _TEXELS[texture.format]
        return reference_maps.Texture(name, texture.height, texture.width, texture.levels, channels)
    if texture.format.startswith("BC7"):
        codes = [bc7_codes(texture, level).tobytes() for level in range(len(texture.levels))]
        return reference_maps.Texture("unorm8", texture.height, texture.width, codes, 4)
    decoded = [decode_texels(texture, level) for level in range(len(texture.levels))]
    levels = [np.ascontiguousarray(level, "<f4").tobytes() for level in decoded]
    return reference_maps.Texture("float32", texture.height, texture.width, levels, decoded[0].shape[2])


def _angles(error: Error) -> dict[str, float]:
    mean = error.sum / error.number if error.number else 0.0
    return {"mean_deg": six(mean), "p99_deg": six(error.p99), "max_deg": six(error.max)}


def _differences(error: Error) -> dict[str, float]:
    found = {"psnr_db": _psnr(error.sum, error.number), "p99": six(error.p99), "max": six(error.max)}
    if error.alpha_number:
        found["alpha_psnr_db"] = _psnr(error.alpha_squares, error.alpha_number)
    return found


def _psnr(squares: float, count: int) -> float:
    """The logarithm is Decimal's, which is the same on every machine; numpy's and libm's are not."""
    mean = squares / count if count else 0.0
    return LOSSLESS_DB if mean <= 1e-12 else six(float(-10 * Decimal(mean).log10()))


def _truth(ground: HeightMap) -> reference_maps.HeightMap:
    """What every tier's normals are held to."""
    taps_of_truth = taps(EXACT)
    return reference_maps.HeightMap(
        ground.heights if ground.truth is None else ground.truth,
        taps=taps_of_truth,
        scale=ground.slope_scale,
        wrap=ground.wrap,
        green_down=ground.green_down,
        islands=ground.islands,
        codes=ground.codes if ground.truth is None else ground.true_codes,
        exact=taps_of_truth[0],
        cones=ground.codes is not None,
    )


def _filtered(ground: HeightMap) -> reference_maps.HeightMap:
    """What the ground's own filter makes of its heights."""
    return reference_maps.HeightMap(
        ground.heights,
        taps=taps(ground.filter_name),
        scale=ground.slope_scale,
        wrap=ground.wrap,
        green_down=ground.green_down,
        islands=ground.islands,
        codes=ground.codes if ground.held else None,
        exact=central_weights(4),
        held=ground.held,
    )


def normal_levels(texture: Texture, ground: HeightMap) -> list[dict[str, float]]:
    """mean_deg, p99_deg and max_deg of every level of a normal map of the ground, against the one truth.

    Levels average normals, then normalise them; where they cancel out the truth is (0, 0, 1). Of a ground
    with islands, texels are measured all of whose taps, and all of whose area, lie on one island (elsewhere
    filters and gutters are another matter); a level without such a texel has errors of 0.
    """
    return [_angles(level) for level in reference_maps.normal_levels(_view(texture), _truth(ground))]


def dudv_levels(texture: Texture, ground: HeightMap) -> list[dict[str, float]]:
    """The same of a du/dv map: x and y of the normals less their mean (over the islands), averaged; angles
    are those of the vectors that a shader would rebuild from them."""
    found = reference_maps.normal_levels(_view(texture), _truth(ground), offsets=True)
    return [_angles(level) for level in found]


def vector_error(xy: F32, ground: HeightMap, *, less_mean: bool = False) -> dict[str, float]:
    """The same of decoded x and y (h, w, 2) that are no texture: of normals, or, less_mean, of du/dv."""
    return _angles(reference_maps.normal_levels(_plain(xy), _truth(ground), offsets=less_mean)[0])


def encoding_error(shown: Texture | F32, ground: HeightMap) -> dict[str, float]:
    """mean_deg, p99_deg and max_deg of level 0 of a normal map, a texture or decoded x and y (h, w, 2),
    against what the ground's own filter makes of its heights in float64: arithmetic and storage alone."""
    view = _plain(shown) if isinstance(shown, np.ndarray) else _view(replace(shown, levels=shown.levels[:1]))
    return _angles(reference_maps.normal_levels(view, _filtered(ground))[0])


def filter_error(ground: HeightMap) -> dict[str, float]:
    """mean_deg, p99_deg and max_deg between the normals of the ground's filter, in float64, and the truth:
    what the filter costs. Islands as normal_levels."""
    return _angles(reference_maps.filter_angles(_filtered(ground), _truth(ground)))


def open_error(ground: HeightMap) -> dict[str, float]:
    """mean_deg, p99_deg and max_deg that the half steps of the source's codes leave open around the normals
    of level 0: angles up to there are no error, so that where it is large, an error of 0 says little. 0 of
    floats."""
    if ground.codes is None:
        return {"mean_deg": 0.0, "p99_deg": 0.0, "max_deg": 0.0}
    return _angles(reference_maps.open_angles(_truth(ground)))


def _plain(xy: F32) -> reference_maps.Texture:
    height, width = xy.shape[:2]
    if not xy.size:
        raise ValueError(f"no vectors in an array of {xy.shape}")
    level = np.ascontiguousarray(xy, "<f4").data.cast("B")
    return reference_maps.Texture("float32", height, width, [level], 2)


def value_levels(texture: Texture, level0: F32) -> list[dict[str, float]]:
    """psnr_db, p99 and max (absolute differences) of every level of linear data (h, w, c)."""
    return [_differences(level) for level in reference_maps.value_levels(_view(texture), level0)]


def gloss_levels(texture: Texture, gloss: F32, ground: HeightMap) -> list[dict[str, float]]:
    """psnr_db, p99 and max of every level of gloss (h, w, 2), both channels together; width_mean_deg,
    width_p99_deg and width_max_deg: how far a highlight's width is off, at half maximum of GGX's slopes.

    R's truth is averaged. G's, a smoothness s of roughness alpha = (1 - s)^2, averages alpha^2, twice the
    variance of slopes, and adds what averaging takes out of the truth's normals; where these have cones, the
    mean normal may be longer or shorter by their mean, and no smoothness of that range is an error. Islands
    as normal_levels.
    """
    view, truth = _view(texture), _truth(ground)
    values = map(_differences, reference_maps.gloss_levels(view, gloss, truth))
    widths = map(_angles, reference_maps.highlight_levels(view, gloss, truth))
    return [
        value | {f"width_{name}": angle for name, angle in width.items()}
        for value, width in zip(values, widths, strict=True)
    ]


def color_levels(
    texture: Texture, pixels: npt.NDArray[Any], *, encoded: bool, alpha_cutoff: float | None
) -> list[dict[str, float]]:
    """psnr_db, p99 and max of every level's colour, in sRGB-encoded values; alpha_psnr_db where pixels have
    alpha.

    pixels (h, w, 3 | 4) uint8, uint16 or float32: sRGB-encoded, or linear light; beyond 0..1 they count as
    clipped. Levels average linear light, weighted by alpha. alpha_cutoff: from level 1 on alpha keeps level
    0's share of texels at or above it, by a factor; None, and 0: alpha is averaged.
    """
    found = reference_maps.color_levels(_view(texture), pixels, encoded=encoded, alpha_cutoff=alpha_cutoff)
    return [_differences(level) for level in found]

"""The error of each mip level of a baked map against float64 references, level 0 first.

The reference of level 0 is computed from the source in float64. The reference of level k is the mean of level
0's over the area of each of its texels (not a mean of means, which differs for odd sizes). Decoders, filters,
curves and means belong to the reference kernels.

Normals have one reference for all tiers and filters: eighth-order differences of the source's heights, within
0.001 degrees on smooth heights with wavelengths of 8 texels and more. An integer source leaves a cone of
normals open (ERRORS.md); an angle counts by how much it exceeds the cone. The heights are the source's own
(source.py), not those of the stages. Authored normals are their own reference (authored.py).

Angles are degrees. PSNR is dB for a peak of 1, at most LOSSLESS_DB. p99 is the 99th percentile. All numbers
have six significant digits.
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import AuthoredNormals, rounded
from paradize.kernels.reference import maps as reference_maps
from paradize.metrics.filters import EXACT, central_weights, taps
from paradize.metrics.texels import bc7_codes, decode_texels

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import HeightMap, Texture
    from paradize.kernels.reference.maps import Error

    F32 = npt.NDArray[np.float32]

LOSSLESS_DB = 120.0  # where the mean squared error is at most 1e-12

# The kernels' name of a format and, for plain texels, its channels. Other formats are decoded first.
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


def _native(texture: Texture) -> reference_maps.Texture:
    """Converts a texture for the kernels."""
    if texture.format in _TEXELS:
        name, channels = _TEXELS[texture.format]
        return reference_maps.Texture(name, texture.height, texture.width, texture.levels, channels)
    if texture.format.startswith("BC7"):
        texels = [bc7_codes(texture, level).tobytes() for level in range(len(texture.levels))]
        return reference_maps.Texture("unorm8", texture.height, texture.width, texels, 4)
    decoded = [decode_texels(texture, level) for level in range(len(texture.levels))]
    levels = [np.ascontiguousarray(level, "<f4").tobytes() for level in decoded]
    return reference_maps.Texture("float32", texture.height, texture.width, levels, decoded[0].shape[2])


def _angles(error: Error) -> dict[str, float]:
    mean = error.sum / error.number if error.number else 0.0
    return {"mean_deg": rounded(mean), "p99_deg": rounded(error.p99), "max_deg": rounded(error.max)}


def _differences(error: Error) -> dict[str, float]:
    errors = {
        "psnr_db": psnr(error.sum, error.number),
        "p99": rounded(error.p99),
        "max": rounded(error.max),
    }
    if error.alpha_number:
        errors["alpha_psnr_db"] = psnr(error.alpha_squares, error.alpha_number)
    return errors


def psnr(squares: float, count: int) -> float:
    """PSNR in dB. The logarithm is Decimal's, which is the same on all machines, unlike numpy's and
    libm's."""
    mean = squares / count if count else 0.0
    return LOSSLESS_DB if mean <= 1e-12 else rounded(float(-10 * Decimal(mean).log10()))


def _normals(height_map: HeightMap | AuthoredNormals) -> reference_maps.Normals:
    """The reference normals for all tiers."""
    if isinstance(height_map, AuthoredNormals):
        return reference_maps.Vectors(height_map.vectors, islands=height_map.islands)
    return _reference(height_map)


def _reference(height_map: HeightMap) -> reference_maps.HeightMap:
    """The reference that the normals of all tiers are compared with."""
    levels = height_map.height_levels if height_map.reference_heights is None else height_map.reference_levels
    reference_taps = taps(EXACT)
    return reference_maps.HeightMap(
        height_map.heights if height_map.reference_heights is None else height_map.reference_heights,
        taps=reference_taps,
        scale=height_map.slope_scale,
        wrap=height_map.wrap,
        green_down=height_map.green_down,
        islands=height_map.islands,
        height_levels=levels,
        exact=reference_taps[0],
        cones=height_map.height_levels is not None,
    )


def _filtered(height_map: HeightMap) -> reference_maps.HeightMap:
    """The heights with their own filter."""
    return reference_maps.HeightMap(
        height_map.heights,
        taps=taps(height_map.filter_name),
        scale=height_map.slope_scale,
        wrap=height_map.wrap,
        green_down=height_map.green_down,
        islands=height_map.islands,
        height_levels=height_map.height_levels if height_map.clamp_slopes else None,
        exact=central_weights(4),
        clamp_slopes=height_map.clamp_slopes,
    )


def normal_levels(texture: Texture, height_map: HeightMap | AuthoredNormals) -> list[dict[str, float]]:
    """mean_deg, p99_deg and max_deg of each level of a normal map, against the reference of all tiers, or
    against the normals of an authored map.

    The reference of a level averages normals and normalizes the mean, which is (0, 0, 1) where they cancel.
    With islands, only texels whose taps and area lie on one island are measured (elsewhere the gutter
    decides); a level without such a texel has errors of 0.
    """
    return [_angles(level) for level in reference_maps.normal_levels(_native(texture), _normals(height_map))]


def dudv_levels(texture: Texture, height_map: HeightMap) -> list[dict[str, float]]:
    """mean_deg, p99_deg and max_deg of each level of a du/dv map. The reference is x and y of the normals
    minus their mean (over the islands), averaged; angles are those of the vectors that a shader rebuilds."""
    errors = reference_maps.normal_levels(_native(texture), _reference(height_map), offsets=True)
    return [_angles(level) for level in errors]


def vector_error(xy: F32, height_map: HeightMap, *, less_mean: bool = False) -> dict[str, float]:
    """mean_deg, p99_deg and max_deg of an array xy (h, w, 2) of decoded normals, or with less_mean of du/dv
    values, instead of a texture."""
    return _angles(
        reference_maps.normal_levels(_native_array(xy), _reference(height_map), offsets=less_mean)[0]
    )


def encoding_error(shown: Texture | F32, height_map: HeightMap) -> dict[str, float]:
    """mean_deg, p99_deg and max_deg of level 0 of a normal map against its own filter in float64: the error
    of arithmetic and storage alone.

    shown: a texture, or decoded x and y (h, w, 2).
    """
    if isinstance(shown, np.ndarray):
        view = _native_array(shown)
    else:
        view = _native(replace(shown, levels=shown.levels[:1]))
    return _angles(reference_maps.normal_levels(view, _filtered(height_map))[0])


def filter_error(height_map: HeightMap) -> dict[str, float]:
    """mean_deg, p99_deg and max_deg of the filter: the angles between its normals in float64 and the
    reference. Islands as in normal_levels."""
    return _angles(reference_maps.filter_angles(_filtered(height_map), _reference(height_map)))


def open_error(height_map: HeightMap) -> dict[str, float]:
    """mean_deg, p99_deg and max_deg of the cones of level 0: the angles that the half steps of an integer
    source leave open. Smaller errors count as 0, so where this is large an error of 0 means little. 0 for
    float sources."""
    if height_map.height_levels is None:
        return {"mean_deg": 0.0, "p99_deg": 0.0, "max_deg": 0.0}
    return _angles(reference_maps.open_angles(_reference(height_map)))


def _native_array(xy: F32) -> reference_maps.Texture:
    height, width = xy.shape[:2]
    if not xy.size:
        raise ValueError(f"no vectors in an array of {xy.shape}")
    level = np.ascontiguousarray(xy, "<f4").data.cast("B")
    return reference_maps.Texture("float32", height, width, [level], 2)


def value_levels(texture: Texture, level0: F32) -> list[dict[str, float]]:
    """psnr_db, p99 and max (absolute differences) of each level of linear data (h, w, c) float32."""
    return [_differences(level) for level in reference_maps.value_levels(_native(texture), level0)]


def gloss_levels(
    texture: Texture, gloss: F32, height_map: HeightMap | AuthoredNormals
) -> list[dict[str, float]]:
    """psnr_db, p99 and max of each level of gloss (h, w, 2), both channels together; width_mean_deg,
    width_p99_deg and width_max_deg: error of a highlight's half-width, at half maximum of GGX's distribution
    of slopes.

    The reference of R is averaged. For G, a smoothness s with roughness alpha = (1 - s)^2, alpha^2 (twice the
    variance of slopes) is averaged, plus the variance of the averaged reference normals. Where these have
    cones, the mean normal may be longer or shorter by their mean, and any smoothness in that range has no
    error. Islands as in normal_levels.
    """
    kernel_texture, reference = _native(texture), _normals(height_map)
    values = map(_differences, reference_maps.gloss_levels(kernel_texture, gloss, reference))
    widths = map(_angles, reference_maps.highlight_levels(kernel_texture, gloss, reference))
    return [
        value | {f"width_{name}": angle for name, angle in width.items()}
        for value, width in zip(values, widths, strict=True)
    ]


def color_levels(
    texture: Texture, pixels: npt.NDArray[Any], *, encoded: bool, alpha_cutoff: float | None
) -> list[dict[str, float]]:
    """psnr_db, p99 and max of each level's colour in sRGB-encoded values; alpha_psnr_db where pixels have
    alpha.

    pixels: (h, w, 3 | 4) uint8, uint16 or float32, sRGB-encoded or linear; values outside 0..1 are clipped.
    Levels average linear light weighted by alpha. alpha_cutoff: from level 1 on alpha is scaled to keep level
    0's share of texels at or above it; None or 0: alpha is averaged.
    """
    errors = reference_maps.color_levels(_native(texture), pixels, encoded=encoded, alpha_cutoff=alpha_cutoff)
    return [_differences(level) for level in errors]

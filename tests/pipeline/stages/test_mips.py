"""Promises of the mip chains."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.kernels import maps
from paradize.stages import mips
from paradize.stages.cubemap import cube_mips, directions
from paradize.stages.gloss import GlossSettings, gloss_map
from paradize.stages.sweep import level_count, sweep


def area_mean(image: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """Each output texel's mean over exactly the area it covers, by an integral in float64."""

    def along(values: np.ndarray, size: int) -> np.ndarray:
        count = values.shape[0]
        whole = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
        edges = np.arange(size + 1) * count / size
        low = np.floor(edges).astype(int).clip(0, count)
        high = np.minimum(low + 1, count)
        part = (edges - low).reshape(-1, *[1] * (values.ndim - 1))
        integral = whole[low] + (whole[high] - whole[low]) * part
        return (integral[1:] - integral[:-1]) * size / count

    half = along(image.astype(np.float64), rows)
    return along(half.swapaxes(0, 1), columns).swapaxes(0, 1)


def chain(
    image: np.ndarray,
    make: Callable[[dict[str, np.ndarray], int], np.ndarray] | None = None,
    **more: np.ndarray,
) -> list[np.ndarray]:
    """Every level of a sweep over an image (h, w, c), named "normal", and what else belongs to it."""
    height, width = image.shape[:2]
    bundle = {"normal": image, **more}
    levels: dict[int, dict[int, np.ndarray]] = {}

    def visit(level: int, first: int, rows: dict[str, np.ndarray]) -> None:
        assert first % 4 == 0
        levels.setdefault(level, {})[first] = rows["normal"] if make is None else make(rows, level)

    def source(first: int, last: int) -> dict[str, np.ndarray]:
        return {name: array[first:last] for name, array in bundle.items()}

    sweep(height, width, source, visit, halve=mips.half_maps)
    return [np.concatenate([rows for _, rows in sorted(levels[k].items())]) for k in sorted(levels)]


def colors(
    values: np.ndarray, *, encoded: bool = False, alpha_cutoff: float | None = None
) -> list[np.ndarray]:
    """Every level of color_rows: codes (h, w, 4)."""
    height, width = values.shape[:2]
    count = level_count(height, width)
    levels = [np.zeros((max(1, height >> k), max(1, width >> k), 4), np.uint8) for k in range(count)]

    def keep(level: int, first: int, rows: np.ndarray) -> None:
        levels[level][first : first + len(rows)] = rows

    mips.color_rows(values, keep, encoded=encoded, alpha_cutoff=alpha_cutoff)
    return levels


@pytest.mark.parametrize(
    "size", [(1, 1), (1, 700), (700, 1), (640, 512), (333, 1000), (52, 4096), (3000, 90)]
)
def test_bands_give_the_levels_that_whole_images_give(size: tuple[int, int]) -> None:
    image = np.random.default_rng(5).random((*size, 3), np.float32)
    levels = chain(image)
    assert len(levels) == max(size).bit_length()
    whole = image
    for level in levels:
        assert np.array_equal(level, whole)
        whole = maps.halve(whole)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 1000), st.integers(1, 17), st.integers(1, 17), st.integers(1, 4))
def test_every_level_is_the_mean_of_the_areas_below_it(
    seed: int, rows: int, columns: int, channels: int
) -> None:
    image = np.random.default_rng(seed).random((rows, columns, channels), np.float32)
    levels = chain(image)
    assert levels[-1].shape[:2] == (1, 1)
    for above, level in pairwise(levels):
        assert level.shape[:2] == (max(1, above.shape[0] // 2), max(1, above.shape[1] // 2))
        assert np.abs(level - area_mean(above, *level.shape[:2])).max() < 1e-6
    assert np.abs(levels[-1][0, 0] - image.mean(axis=(0, 1), dtype=np.float64)).max() < 1e-5


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000), st.integers(1, 9), st.integers(1, 9))
def test_a_tiles_mips_are_the_middle_of_its_repetitions_mips(
    seed: int, half_rows: int, half_columns: int
) -> None:
    tile = np.random.default_rng(seed).random((2 * half_rows, 2 * half_columns, 3), np.float32)
    repeated = maps.halve(np.tile(tile, (3, 3, 1)))
    middle = repeated[half_rows : 2 * half_rows, half_columns : 2 * half_columns]
    assert np.array_equal(maps.halve(tile), middle)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_colour_is_averaged_in_linear_light(dtype: type) -> None:
    checker = np.zeros((2, 2, 3), dtype)
    checker[0, 0] = checker[1, 1] = 1 if dtype == np.float32 else np.iinfo(dtype).max
    codes = colors(checker, encoded=True)[1]
    assert codes.tolist() == [[[188, 188, 188, 255]]]  # half the light; averaging codes would give 128


@pytest.mark.parametrize("size", [(64, 96), (37, 41), (64, 41), (37, 96), (1, 64), (104, 6)])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_every_colour_level_is_the_nearest_code_of_the_mean_light(
    size: tuple[int, int], channels: int
) -> None:
    values = np.random.default_rng(2).integers(0, 256, (*size, channels), dtype=np.uint8)
    rgba = values[:, :, {1: [0, 0, 0], 2: [0, 0, 0, 1]}.get(channels, list(range(channels)))]
    share = rgba.astype(np.float64) / 255
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)[:, :, :3]
    alpha = share[:, :, 3:] if channels in (2, 4) else np.ones((*size, 1))
    for level, codes in enumerate(colors(values, encoded=True)):
        shape = codes.shape[:2]
        if level > 1 and any(side % (1 << level) and side > 1 for side in size):
            break  # below an odd size a level is the mean of the one before, not quite of level 0
        if not level:
            assert np.array_equal(codes[:, :, : rgba.shape[2]], rgba)
            continue
        opaque = area_mean(alpha, *shape)
        mean = area_mean(light * alpha, *shape) / np.maximum(opaque, 1e-9)
        wanted = np.where(mean <= 0.0031308, mean * 12.92, 1.055 * mean ** (1 / 2.4) - 0.055) * 255
        assert np.abs(codes[:, :, :3] - wanted).max() < 0.505
        assert np.abs(codes[:, :, 3:] - opaque * 255).max() < 0.505


def test_codes_of_16_bits_become_the_nearest_of_8() -> None:
    codes = np.arange(65536, dtype=np.uint16).reshape(256, 256, 1)
    found = maps.rgba_codes(codes, encoded=True)
    assert np.array_equal(found[:, :, 0], np.rint(codes[:, :, 0] / 257))


def test_every_8_bit_code_survives_linear_light() -> None:
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16, 1)
    back = maps.rgba_codes(maps.linear_light(codes, encoded=True), encoded=False)
    assert np.array_equal(back[:, :, 0], codes[:, :, 0])


def test_transparent_texels_do_not_tint_their_neighbours() -> None:
    image = np.float32([[[1, 0, 0, 1], [0, 1, 0, 0]], [[0, 1, 0, 0], [0, 1, 0, 0]]])
    assert colors(image)[1].tolist() == [[[255, 0, 0, 64]]]
    assert colors((image * 255).astype(np.uint8), encoded=True)[1].tolist() == [[[255, 0, 0, 64]]]
    clear = np.float32([[[0.2, 0.4, 0.6, 0], [0.4, 0.6, 0.8, 0]]])
    light = maps.halve(clear, with_alpha=True)
    assert np.allclose(light[0, 0], [0.3, 0.5, 0.7, 0])
    faint = np.float32([[[0.2, 0.4, 0.6, 1e-4], [1, 1, 1, 0]]])
    assert np.allclose(maps.halve(faint, with_alpha=True)[0, 0], [0.2, 0.4, 0.6, 5e-5])


@pytest.mark.parametrize("channels", [2, 4])
def test_codes_of_transparent_texels_keep_their_mean_colour(channels: int) -> None:
    codes = np.random.default_rng(3).integers(0, 256, (4, 6, channels), dtype=np.uint8)
    codes[:, :, -1] = 0
    codes[:2, :2, -1] = 1
    wanted = maps.halve(maps.linear_light(codes, encoded=True), with_alpha=True)
    assert np.abs(maps.halved_light(codes) - wanted).max() < 1e-6


def test_the_coverage_s_factor_is_the_least_that_keeps_as_many_texels() -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        alpha = rng.random((9, 11), np.float32) * np.float32(0.9) + np.float32(0.1)
        cutoff, kept = rng.uniform(0.2, 0.8), int(rng.integers(1, alpha.size))
        factor = maps.coverage_factor(alpha, fraction=kept / alpha.size, cutoff=cutoff)
        lifted = alpha * np.float32(factor)
        assert (lifted >= np.float32(cutoff)).sum() == kept
        assert (lifted * np.float32(1 - 3e-6) >= np.float32(cutoff)).sum() == kept - 1


def test_cut_outs_keep_their_coverage_in_every_mip() -> None:
    rng = np.random.default_rng(4)
    image = np.full((64, 64, 4), 255, np.uint8)
    image[:, :, 3] *= rng.random((64, 64)) < 0.3  # thin and scattered, as fronds are
    share = (image[:, :, 3] >= 128).mean()
    kept = colors(image, encoded=True, alpha_cutoff=0.5)
    plain = colors(image, encoded=True)
    for level in range(1, 5):
        count = kept[level][:, :, 3].size
        assert abs((kept[level][:, :, 3] >= 128).mean() - share) <= 1.5 / count + 0.06
    assert (plain[3][:, :, 3] >= 128).mean() < share / 2  # without care they vanish


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [2, 4])
def test_what_lies_at_the_cutoff_counts_as_covered(dtype: type, channels: int) -> None:
    """By numpy: alpha times the factor that lets level 0's share of texels reach the cutoff, 0.4."""
    top = 1.0 if dtype == np.float32 else float(np.iinfo(dtype).max)
    rng = np.random.default_rng(8)
    picture = np.zeros((32, 48, channels), dtype)
    picture[:, :, -1] = (rng.choice([0.0, 0.2, 0.4, 0.8], (32, 48), p=[0.5, 0.2, 0.2, 0.1]) * top).astype(
        dtype
    )
    alpha = picture[:, :, -1:].astype(np.float64) / top
    share = (picture[:, :, -1] >= np.asarray(0.4 * top, dtype)).mean()
    assert 0.25 < share < 0.35
    for level, codes in enumerate(colors(picture, encoded=True, alpha_cutoff=0.4)[:4]):
        opaque = area_mean(alpha, *codes.shape[:2])
        if level:
            least = np.sort(opaque.ravel())[::-1][int(share * opaque.size + 0.5) - 1]
            opaque = np.minimum(1.0, opaque * 0.4 / least)
        assert np.abs(codes[:, :, 3:] - opaque * 255).max() < 0.51, level


@pytest.mark.parametrize(("cutoff", "share", "factor"), [(0.4, 1 / 32, 16), (0.05, 1.0, 1 / 16)])
def test_alpha_grows_by_sixteen_at_most_and_shrinks_to_a_sixteenth(
    cutoff: float, share: float, factor: float
) -> None:
    """Every 32nd texel, or all, of an alpha of 0.5: one factor would not lift the means to the cutoff."""
    picture = np.zeros((32, 32, 4), np.float32)
    picture[:, :, 3] = 0.0 if share < 1 else 1.0
    picture[::4, ::8, 3] = 0.5 if share < 1 else 1.0
    codes = colors(picture, alpha_cutoff=cutoff)[3]
    mean = 0.5 * share if share < 1 else 1.0
    assert np.abs(codes[:, :, 3] - 255 * mean * factor).max() < 0.51


def test_normals_are_averaged_before_they_are_normalised() -> None:
    rng = np.random.default_rng(6)
    vectors = rng.normal(size=(8, 8, 3)).astype(np.float32)
    vectors[:, :, 2] = np.abs(vectors[:, :, 2]) + 0.1
    unit = maps.normalise(vectors)
    found = chain(unit, mips.unit_rows)
    for level in range(1, 4):
        mean = area_mean(unit, 8 >> level, 8 >> level)
        expected = mean / np.sqrt((mean * mean).sum(axis=2, keepdims=True))
        assert np.abs(found[level] - expected).max() < 1e-6


def test_the_length_of_a_vector_changes_no_direction() -> None:
    vectors = np.random.default_rng(7).normal(size=(3, 50, 3)).astype(np.float32)
    for scale in (1e-5, 1e5):
        short = maps.normalise(vectors * np.float32(scale))
        assert np.abs(short - maps.normalise(vectors)).max() < 1e-6


def test_normals_that_cancel_out_fall_back_to_up() -> None:
    opposed = np.float32([[[1, 0, 0], [-1, 0, 0]], [[0, 1, 0], [0, -1, 0]]])
    assert np.array_equal(chain(opposed, mips.unit_rows)[1], np.float32([[[0, 0, 1]]]))


def test_smoothness_falls_where_normals_disagree_and_stays_where_they_agree() -> None:
    gloss = gloss_map(np.full((8, 8), 0.5, np.float32), GlossSettings(smoothness=(0.8, 0.8)))
    up = np.broadcast_to(np.float32([0, 0, 1]), (8, 8, 3)).copy()
    calm = chain(up, mips.gloss_rows, **mips.gloss_bundle(gloss))
    for level in calm:
        assert np.abs(level[:, :, 1] - 0.8).max() < 1e-6
        assert np.abs(level[:, :, 0] - 0.5).max() < 1e-6
    rough = up.copy()
    rough[::2, :, :] = np.float32([0.6, 0, 0.8])
    rough[1::2, :, :] = np.float32([-0.6, 0, 0.8])
    choppy = chain(rough, mips.gloss_rows, **mips.gloss_bundle(gloss))
    assert (choppy[1][:, :, 1] < 0.3).all()
    assert np.abs(choppy[1][:, :, 0] - 0.5).max() < 1e-6, "specular intensity is not widened"
    # The widened roughness is the wave's own: slopes of +-0.75 along one axis; isotropic, half of it on each.
    alpha2 = (1 - choppy[1][0, 0, 1]) ** 4
    assert alpha2 == pytest.approx(0.2**4 + 2 * 0.5 * 0.75**2, rel=0.45)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 1000))
def test_smoothness_never_grows_down_the_chain_of_an_even_gloss(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(16, 16, 3)).astype(np.float32)
    vectors[:, :, 2] = np.abs(vectors[:, :, 2]) + 0.5
    gloss = np.full((16, 16, 2), 0.7, np.float32)
    levels = chain(maps.normalise(vectors), mips.gloss_rows, **mips.gloss_bundle(gloss))
    for level in levels:
        assert (level[:, :, 1] <= np.float32(0.7) + 1e-6).all()
        assert (level[:, :, 1] >= 0).all()


def test_a_constant_sky_stays_constant_and_a_smooth_one_has_no_seams() -> None:
    even = np.full((6, 16, 16, 3), 2.5, np.float32)
    for level in cube_mips(even):
        assert np.abs(level - 2.5).max() < 1e-6
    place = (np.arange(32) + 0.5) / 16 - 1
    s, t = np.meshgrid(place, place)
    faces = []
    for face in range(6):
        d = directions(face, s, t)
        d = d / np.sqrt((d * d).sum(axis=2, keepdims=True))
        faces.append(d.astype(np.float32))
    levels = cube_mips(np.stack(faces))
    for level in levels[1:4]:
        size = level.shape[1]
        place = (np.arange(size) + 0.5) * 2 / size - 1
        s, t = np.meshgrid(place, place)
        for face in range(6):
            d = directions(face, s, t)
            d = d / np.sqrt((d * d).sum(axis=2, keepdims=True))
            # A colour that is the direction itself: the mean over a footprint points at its middle.
            found = level[face] / np.sqrt((level[face] ** 2).sum(axis=2, keepdims=True))
            assert np.abs(found - d).max() < 0.6 / size
    # Over the edge +X | +Z (right of +Z is left of +X, mirrored by the faces' own axes) levels meet smoothly.
    for level in levels[1:3]:
        step = np.abs(level[4][:, -1] - level[0][:, 0]).max()
        inner = np.abs(level[4][:, -1] - level[4][:, -2]).max()
        assert step < 1.6 * inner


def test_a_texel_of_a_coarser_sky_weighs_finer_ones_by_their_solid_angles() -> None:
    faces = np.random.default_rng(3).random((6, 32, 32, 1)).astype(np.float32)
    x = np.arange(33) / 16 - 1
    area = np.arctan2(np.outer(x, x), np.sqrt(1 + x[:, None] ** 2 + x**2))  # from the middle to a corner
    weight = np.diff(np.diff(area, axis=0), axis=1)
    found = cube_mips(faces)[1]
    for row, column in ((1, 1), (1, 7), (4, 14)):
        there = np.s_[2 * row - 1 : 2 * row + 3, 2 * column - 1 : 2 * column + 3]
        of_each = np.outer([1, 3, 3, 1], [1, 3, 3, 1]) * weight[there]
        for face in range(6):
            mean = (faces[face, :, :, 0][there] * of_each).sum() / of_each.sum()
            assert found[face, row, column, 0] == pytest.approx(mean, abs=1e-4)

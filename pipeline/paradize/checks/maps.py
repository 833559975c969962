"""Rules for maps that belong together, as far as the baked files alone prove a fault.

Block compression adds noise, so a rule reports only differences beyond those of any correct encoder. The
measured errors of a map say how exact it is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import islice
from math import hypot, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.checks.rules import Finding, isolated
from paradize.checks.slopes import TOGETHER, agreement
from paradize.data import Texture
from paradize.errors import FormatError
from paradize.files import MAX_BYTES, read_file
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.scene.manifest import map_sets, maps_of_material
from paradize.map_table import MAPS, maps_of
from paradize.metrics.texels import decode_texels, rebuilt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

_NAMED = re.compile(rf"(.+)_({'|'.join(MAPS)})\.ktx2")
_CODES: dict[str, tuple[Any, int]] = {"RG8_SNORM": (np.int8, -127), "RG16_SNORM": (np.dtype("<i2"), -32767)}
_FEW = 0.02  # share of a level's texels: fewer wrong ones may be noise of the compression
_APART = 0.03  # of the range, plus a share of the contrast: how much areas of two levels may differ
_CONTRAST = 0.3
_STEPS = 4080  # entries of the table of linear light: every value of 8, 6 and 5 bits is near one
_AGREED = 0.8  # length of averaged normals from which on their direction is meaningful
_ROUNDS = 16  # at most, until the mean of clipped values is 0
_CUT = 0.999  # of du/dv: such a texel may have been clipped
_WHOLE = 0.999  # weight of an area without clipped texels
_ROUGH = 0.06  # how much smoother than its normals allow a level may be


@dataclass(frozen=True)
class Map:
    """A decoded texture and the name of its file."""

    file: str
    texture: Texture

    @cached_property
    def finest(self) -> F32:
        """The texels of level 0."""
        return decode_texels(self.texture)

    def texels(self, level: int) -> F32:
        return self.finest if level == 0 else decode_texels(self.texture, level)


def scene_maps(manifest: dict[str, Any], folder: Path) -> Iterator[Finding]:
    """The findings in the maps of water, terrain and objects of a manifest whose files lie in `folder`."""
    terrain, water = manifest["terrain"], manifest["water"]
    surfaces: list[dict[str, str | None]] = []
    if terrain:
        for layer in ("sand", "effect"):
            surfaces.append({kind: terrain[f"{layer}_{kind}"] for kind in maps_of("ground")})
    if water:
        surfaces.append({kind: water[kind] for kind in maps_of("water")})
    for item in manifest["objects"]:
        for material, _ in map_sets(item):
            surfaces += maps_of_material(material).values()
    for surface in surfaces:
        entries = {kind: manifest["artifacts"][name] for kind, name in surface.items() if name}
        files = {kind: (folder / entry["file"], entry["bytes"]) for kind, entry in entries.items()}
        yield from _isolated_maps(files, green_up=True)


def folder_maps(files: Sequence[Path]) -> Iterator[Finding]:
    """The findings in the maps that `paradize maps` wrote: <stem>_normal.ktx2 and so on."""
    surfaces: dict[str, dict[str, tuple[Path, int]]] = {}
    for file in files:
        if match := _NAMED.fullmatch(file.name):
            surfaces.setdefault(match[1], {})[match[2]] = (file, MAX_BYTES)
    for surface in surfaces.values():
        yield from _isolated_maps(surface)


def _isolated_maps(files: Mapping[str, tuple[Path, int]], *, green_up: bool = False) -> Iterator[Finding]:
    if files:
        first = str(next(iter(files.values()))[0])
        yield from isolated(check_maps(_read(files), green_up=green_up), first)


def _read(files: Mapping[str, tuple[Path, int]]) -> dict[str, Map]:
    """The textures of the files that can be read and are not larger than given. Other rules report the
    others."""
    maps = {}
    for kind, (file, most) in files.items():
        try:
            maps[kind] = Map(str(file), decode_ktx2(read_file(file, most)))
        except (OSError, FormatError):
            continue
    return maps


def check_maps(maps: Mapping[str, Map], *, green_up: bool = False) -> Iterator[Finding]:
    """The findings in the maps of one surface, by kind (of paradize.map_table), all made from one source.
    green_up: whether normals are known to be green up; files alone do not say."""
    for kind, texture_map in maps.items():
        srgb = texture_map.texture.format.endswith("_SRGB")  # another rule reports a wrong colour space
        if (
            texture_map.texture.faces == 1
            and "F" not in texture_map.texture.format
            and srgb == (MAPS[kind].kind == "color")
        ):
            yield from _levels(texture_map, kind)
    normal, dudv, gloss, height = (maps.get(kind) for kind in ("normal", "dudv", "gloss", "height"))
    if dudv is not None:
        yield from _drift(dudv)
    if normal is not None and dudv is not None and _same_size(normal, dudv):
        yield from _offsets(normal, dudv)
    if normal is not None and height is not None and _same_size(normal, height, channels=1):
        yield from _leaning(normal, height, green_up)
    if normal is not None and gloss is not None and _same_size(normal, gloss):
        yield from _widening(normal, gloss)


def _same_size(a: Map, b: Map, channels: int = 2) -> bool:
    one, other = a.texture, b.texture
    return (one.width, one.height, one.faces) == (other.width, other.height, other.faces) and all(
        decode_texels(texture, len(texture.levels) - 1).shape[2] >= channels for texture in (one, other)
    )


def _drift(dudv: Map) -> Iterator[Finding]:
    texture = dudv.texture
    if texture.format not in _CODES:
        return
    kind, least = _CODES[texture.format]
    for level, data in enumerate(texture.levels):
        values = np.maximum(np.frombuffer(data, kind).astype(np.int64), least).reshape(-1, 2)
        sums = values.sum(axis=0).tolist()
        if any(sums):
            what = f"the stored values of x and y add up to {sums[0]} and {sums[1]}, not to 0"
            yield Finding("PZ211", dudv.file, what, f"level {level}")


def _offsets(normal: Map, dudv: Map) -> Iterator[Finding]:
    xy = normal.finest[:, :, :2].astype(np.float64)
    stored = dudv.finest[:, :, :2].astype(np.float64)
    height, width = xy.shape[:2]
    slack = np.full(xy.shape, 3.0 / 127.0)
    if normal.texture.format.startswith("BC") and height % 4 == 0 and width % 4 == 0:
        blocks = xy.reshape(height // 4, 4, width // 4, 4, 2)
        ranges = blocks.max(axis=(1, 3)) - blocks.min(axis=(1, 3))
        slack += 0.12 * ranges.repeat(4, axis=0).repeat(4, axis=1)
    apart = np.abs(stored - _without_mean(xy))
    off = (apart > slack).any(axis=2)
    if off.mean() > _FEW:
        y, x = np.unravel_index(int(apart.max(axis=2).argmax()), off.shape)
        what = (
            f"{100 * off.mean():.0f} % of the texels differ from {normal.file}, by {apart.max():.2f} at worst"
        )
        yield Finding("PZ212", dudv.file, what, f"texel {x}, {y}")


def _without_mean(xy: F64) -> F64:
    """The du/dv of normals (h, w, 2): less their mean, clipped to -1..1, and again until the mean is 0."""
    for _ in range(_ROUNDS):
        mean = xy.mean(axis=(0, 1))
        if np.abs(mean).max() < 1e-3:
            break
        xy = np.clip(xy - mean, -1.0, 1.0)
    return xy


def _leaning(normal: Map, height: Map, green_up: bool) -> Iterator[Finding]:
    """Slopes of the normals correlate with those of the heights, for any strength and filter."""
    vectors = rebuilt(normal.finest[:, :, :2])
    slopes = -vectors[:, :, :2] / np.maximum(vectors[:, :, 2:], 0.05)
    correlation = agreement(height.finest[:, :, :1], slopes.astype(np.float64), green_up)
    if correlation is not None and correlation < TOGETHER:
        what = f"its slopes and those of {height.file} have a correlation of {correlation:.2f}"
        yield Finding("PZ215", normal.file, f"{what}, at least {TOGETHER:g} is expected")


def _square(vectors: F32 | F64) -> F32 | F64:
    """The squared lengths of vectors along the last axis: numpy sums axes of a few numbers slowly."""
    return np.asarray(sum(np.square(vectors[..., k]) for k in range(vectors.shape[-1])))


def _half(values: F32 | F64) -> F32 | F64:
    """Means of pairs of texels along axis 0; for an odd number, weighted means of three."""
    n = len(values)
    if n % 2 == 0 or n == 1:
        return np.asarray((values[0::2] + values[1::2]) / 2.0) if n > 1 else values
    part = np.arange(n // 2, dtype=np.float64).reshape(-1, *([1] * (values.ndim - 1)))
    before, after = n // 2 - part, part + 1.0
    return np.asarray((before * values[0:-1:2] + (n // 2) * values[1::2] + after * values[2::2]) / n)


def _means(values: F32 | F64) -> Iterator[F32 | F64]:
    """Values (h, w, c) at every level from 0 on, each the mean of the one before."""
    yield values
    while max(values.shape[:2]) > 1:
        values = _half(_half(values).swapaxes(0, 1)).swapaxes(0, 1)
        yield values


def _content(texture_map: Map, level: int, kind: str) -> F32 | F64:
    """The values by which levels are compared: those whose area mean every level keeps. The last channel is
    the weight of the others."""
    values = texture_map.texels(level)
    weight = np.ones((*values.shape[:2], 1), np.float32)
    if kind == "normal":
        return np.dstack([rebuilt(values[:, :, :2]), weight])
    if kind == "dudv":  # clipped values are not known
        weight[np.maximum(*np.abs(np.moveaxis(values[:, :, :2], 2, 0))) >= _CUT] = 0.0
        return np.dstack([values[:, :, :2], weight])
    if texture_map.texture.format.endswith("_SRGB"):
        if texture_map.texture.format != "BC1_RGB_SRGB":
            weight = values[:, :, 3:]
        light = _light()[np.rint(values[:, :, :3] * np.float32(_STEPS)).astype(np.uint16)]
        return np.dstack([light * weight, weight])
    if kind == "gloss":  # the intensity; smoothness changes with the level
        values = values[:, :, :1]
    return np.dstack([values, weight])


@cache
def _light() -> F32:
    """Linear light of sRGB values k / _STEPS."""
    encoded = np.arange(_STEPS + 1) / _STEPS
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return light.astype(np.float32)


def _levels(texture_map: Map, kind: str) -> Iterator[Finding]:
    """Each level has, over areas of about 4 texels, the mean of level 0; or that of level 1, whose blocks
    hold fewer colours: in dithered pictures those of level 0 lie on no line, so that its mean moves."""
    wanted = list(_means(_content(texture_map, 0, kind)))
    second: list[F32 | F64] = []
    for level in range(1, len(texture_map.texture.levels)):
        apart = _beyond(texture_map, level, kind, wanted)
        if apart is None:
            continue
        if level > 1 and texture_map.texture.format.startswith(("BC1", "BC3")):
            second = second or [wanted[0], *_means(_content(texture_map, 1, kind))]
            if _beyond(texture_map, level, kind, second) is None:
                continue
        what = f"differs from level 0 by {apart:.3f} (root mean square, linear)"
        yield Finding("PZ213", texture_map.file, what, f"level {level}")
        return


def _beyond(texture_map: Map, level: int, kind: str, wanted: list[F32 | F64]) -> float | None:
    """How far a level differs from the wanted means, by level, where that is more than a format leaves; else
    None."""
    coarse = min(level + 1, len(wanted) - 1)
    here = _content(texture_map, level, kind)
    if kind == "normal":  # weight each normal by how well the normals of level 0 below it agree
        here[:, :, :3] *= np.sqrt(_square(wanted[level][:, :, :3]))[:, :, None]
    means = [*islice(_means(here), 2)][-1]
    least = _WHOLE if kind == "dudv" else 0.25
    seen = (wanted[coarse][:, :, -1] > least) & (means[:, :, -1] > least)
    if kind == "normal":
        seen &= _square(wanted[coarse][:, :, :3]) > _AGREED * _AGREED
    if not seen.any():
        return None
    truth, shown = (_shown(values[seen], kind) for values in (wanted[coarse], means))
    contrast = float(np.sqrt(np.square(truth - truth.mean(axis=0)).mean()))
    apart = float(np.sqrt(np.square(truth - shown).mean()))
    limit = _APART + _CONTRAST * contrast + _block_error(wanted[level], texture_map.texture.format)
    return apart if apart > limit else None


def _block_error(wanted: F32 | F64, form: str) -> float:
    """The RMS error that no encoder of a block format can avoid: all colours of a BC1 or BC3 block are four
    on one line, and a channel of BC4 and BC5 has eight values. 0 for other formats."""
    if not form.startswith(("BC1", "BC3", "BC4", "BC5")):
        return 0.0
    values = wanted[:, :, :-1] / np.maximum(wanted[:, :, -1:], 1e-3)
    rows, columns = (min(4, size) for size in values.shape[:2])
    down, across = values.shape[0] // rows, values.shape[1] // columns
    grid = values[: down * rows, : across * columns].reshape(down, rows, across, columns, -1)
    blocks = grid.swapaxes(1, 2).reshape(-1, rows * columns, values.shape[2])
    rounding = float(np.sqrt(np.square(np.ptp(blocks, axis=1)).mean() / 12.0))  # of one step
    if form.startswith(("BC4", "BC5")):  # steps of a seventh; z, rebuilt from x and y, doubles the error
        return rounding * 2.0 / 7.0
    blocks = blocks - blocks.mean(axis=1, keepdims=True)
    spread = np.linalg.eigvalsh(blocks.swapaxes(1, 2) @ blocks)  # ascending
    return hypot(sqrt(max(0.0, spread[:, :2].sum() / blocks.size)), rounding / 3.0)


def _shown(values: F32 | F64, kind: str) -> F64:
    """(n, c): directions of normals; else values divided by their weight. Of du/dv less their mean, because
    clipping moves it, and another rule looks at it."""
    if kind == "normal":
        length = np.sqrt(_square(values[:, :3]))[:, None]
        return np.asarray(values[:, :3] / np.maximum(length, 1e-3))
    shown = np.asarray(values[:, :-1] / values[:, -1:])
    return shown - shown.mean(axis=0) if kind == "dudv" else shown


def _widening(normal: Map, gloss: Map) -> Iterator[Finding]:
    """Smoothness is nowhere above what averaged roughness and the spread of the normals allow, with slack for
    the compression of both."""
    rough = 1.0 - gloss.finest[:, :, 1:2].astype(np.float64)
    vectors = rebuilt(normal.finest[:, :, :2])
    joined = np.dstack([rough * rough * rough * rough, vectors])
    for level, means in enumerate(_means(joined)):
        if level == 0 or level >= len(gloss.texture.levels):
            continue
        square = np.minimum(1.0, _square(means[:, :, 1:]))
        r = np.maximum(np.sqrt(square), 1e-6)
        lost = np.maximum(0.0, 0.7 * 2.0 * (1.0 - square) / (r * (3.0 - square)) - 0.004)
        most = 1.0 - np.sqrt(np.sqrt(np.minimum(1.0, 0.9 * means[:, :, 0] + lost)))
        smooth = gloss.texels(level)[:, :, 1]
        off = smooth > most + _ROUGH
        if off.mean() > _FEW:
            y, x = np.unravel_index(int((smooth - most).argmax()), off.shape)
            what = f"smoothness {smooth[y, x]:.2f} where normals allow {most[y, x]:.2f}"
            yield Finding("PZ214", gloss.file, what, f"level {level} texel {x}, {y}", int(off.sum()))
            return

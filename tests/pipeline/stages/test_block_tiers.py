"""Whether the tiers of block compression stand in the order that they are declared in: each metric that a
budget may name, and maxima, picture by picture.

python -m tests.pipeline.stages.test_block_tiers FOLDER prints the share of a folder's pictures in order.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.bakers.color import bake_color
from paradize.data import Texture
from paradize.metrics.texels import decode_texels
from paradize.stages.compress import encode_rows, formats_of
from paradize.tiers import TIERS
from tests.pipeline.heights import save

F64 = npt.NDArray[np.float64]
Pixels = npt.NDArray[np.uint8]
Errors = dict[str, float]  # of one texture; the less the better

SIDE = 256  # of the part that is cut from the middle of a picture


def pictures(folder: Path) -> Iterator[tuple[str, Pixels]]:
    """Name and the middle, (h, w, 1 to 4) uint8, of every picture of 16 x 16 texels or more that reads."""
    hint = oiio.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() not in {".png", ".jpg", ".jpeg", ".tga"} or "malformed" in path.parts:
            continue
        source = oiio.ImageInput.open(str(path), hint)
        if source is None:
            oiio.geterror()
            continue
        spec = source.spec()
        pixels = source.read_image(0, 0, 0, min(spec.nchannels, 4), oiio.UINT8)
        if pixels is None or min(spec.width, spec.height) < 16:
            source.geterror()
            continue
        height, width = (min(side // 4 * 4, SIDE) for side in pixels.shape[:2])
        y, x = (pixels.shape[0] - height) // 2, (pixels.shape[1] - width) // 2
        yield str(path.relative_to(folder)), np.ascontiguousarray(pixels[y : y + height, x : x + width])


def decoded(values: npt.NDArray[np.generic], fmt: str, tier: str) -> F64:
    height, width = values.shape[:2]
    texture = Texture(fmt, width, height, (encode_rows(values, fmt, tier=tier),))
    return decode_texels(texture).astype(np.float64)


def differences(name: str, off: F64) -> Errors:
    """rms, p99 and max, to five digits, and no finer than what is decoded in single precision."""
    off = np.abs(off)
    found = {"rms": np.sqrt(np.square(off).mean()), "p99": np.percentile(off, 99), "max": off.max()}
    return {f"{name} {key}": round(float(f"{value:.5g}"), 7) for key, value in found.items()}


def color_errors(rgba: Pixels, fmt: str, tier: str) -> Errors:
    off = decoded(rgba, fmt, tier) - (rgba if "BC1" not in fmt else rgba[:, :, :3]) / 255.0
    found = differences("colour", off[:, :, :3])
    if "BC7" in fmt:
        found |= differences("all", off)
    return found if "BC1" in fmt or rgba[:, :, 3].min() == 255 else found | differences("alpha", off[:, :, 3])


def baked_errors(rgba: Pixels, tier: str) -> Errors:
    """Of level 0 of what a bake makes of the picture, as it states them; PSNR with the sign turned."""
    with TemporaryDirectory() as folder:
        path = save(Path(folder) / "picture.png", rgba)
        level = bake_color(path, tier=tier).levels[0]
    return {key: -value if key.endswith("_db") else value for key, value in level.items()}


def value_errors(values: npt.NDArray[np.float32], fmt: str, tier: str) -> Errors:
    return differences("values", decoded(values, fmt, tier) - values)


def normal_errors(normals: npt.NDArray[np.float32], fmt: str, tier: str) -> Errors:
    xy = decoded(normals, fmt, tier)[:, :, :2]
    z = np.sqrt(np.maximum(0, 1 - np.square(xy).sum(axis=2)))
    shown = np.dstack([xy, z])
    shown /= np.linalg.norm(shown, axis=2, keepdims=True)
    truth = normals.astype(np.float64)
    cross = np.linalg.norm(np.cross(shown, truth), axis=2)
    angle = np.degrees(np.arctan2(cross, (shown * truth).sum(axis=2)))
    found = {"mean": angle.mean(), "p99": np.percentile(angle, 99), "max": angle.max()}
    return {f"angle {key}": float(f"{value:.5g}") for key, value in found.items()}


def slopes_normals(grey: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    down, across = np.gradient(grey * np.float32(6))
    normals = np.dstack([-across, down, np.ones_like(grey)])
    return (normals / np.linalg.norm(normals, axis=2, keepdims=True)).astype(np.float32)


Series = dict[str, list[Errors]]  # what is encoded -> errors of each tier, in order


def series_of(pixels: Pixels) -> Series:
    """The errors of every format that the picture may take, and of the formats that the tiers declare."""
    channels = pixels.shape[2]
    grey = pixels[:, :, :3].mean(axis=2, dtype=np.float32) / np.float32(255)
    normals = slopes_normals(grey)
    found: Series = {}

    def add(name: str, errors: Callable[[str, str], Errors], *formats: str) -> None:
        found[name] = [errors(fmt, tier) for fmt, tier in zip(formats, TIERS, strict=True)]

    if channels >= 3:
        opaque = np.full_like(pixels[:, :, :1], 255)
        alpha = pixels[:, :, 3:] if channels == 4 else opaque
        rgba = np.ascontiguousarray(np.concatenate([pixels[:, :, :3], alpha], axis=2))
        kind = "color with alpha" if alpha.min() < 255 else "color"
        found[f"{kind}, baked"] = [baked_errors(rgba, tier) for tier in TIERS]
        known = [formats_of("color", *pixels.shape[:2], tier=tier, alpha=kind != "color") for tier in TIERS]
        for fmt in {formats[0] for formats in known}:
            add(f"{kind}, {fmt}", lambda fmt, tier: color_errors(rgba, fmt, tier), *[fmt] * 3)
    add("BC4_UNORM", lambda fmt, tier: value_errors(grey[:, :, None], fmt, tier), *["BC4_UNORM"] * 3)
    two = np.dstack([grey, np.sqrt(grey)])
    add("BC5_UNORM", lambda fmt, tier: value_errors(two, fmt, tier), *["BC5_UNORM"] * 3)
    add("BC5_SNORM", lambda fmt, tier: normal_errors(normals, fmt, tier), *["BC5_SNORM"] * 3)
    return found


def shares(folder: Path, tell: Callable[[str], None] = lambda _: None) -> dict[tuple[str, str], list[bool]]:
    """The encoded kind and the metric -> of each picture, whether its tiers are in order."""
    found: dict[tuple[str, str], list[bool]] = {}
    for name, pixels in pictures(folder):
        for kind, tiers in series_of(pixels).items():
            for metric in tiers[0]:
                values = [errors[metric] for errors in tiers]
                in_order = values == sorted(values, reverse=True)
                found.setdefault((kind, metric), []).append(in_order)
                if not in_order:
                    tell(f"{kind} {metric} {name}: {values}")
    return found


def promised(kind: str, metric: str) -> bool:
    """No budget names p99 of colour nor alpha's maximum. Of a picture with alpha, what is baked keeps what a
    budget names, and BC7 the sum over its channels, which is what its encoder makes small."""
    if kind == "color with alpha, baked":
        return metric.endswith("_db")
    if kind == "color with alpha, BC7_SRGB":
        return metric == "all rms"
    return metric not in {"p99", "colour p99", "all p99", "alpha max"}


@pytest.mark.deep
def test_tiers_are_in_order_on_nineteen_of_twenty_pictures(sources: Path) -> None:
    out: list[str] = []
    found = shares(sources, out.append)
    assert len(found) > 10
    for (kind, metric), orders in found.items():
        if promised(kind, metric):
            assert sum(orders) >= 0.95 * len(orders), (kind, metric, out)


def main() -> None:
    for (kind, metric), orders in shares(
        Path(sys.argv[1]), lambda line: print(line, file=sys.stderr)
    ).items():
        print(f"{sum(orders) / len(orders):6.1%} of {len(orders):3d}  {kind}, {metric}")


if __name__ == "__main__":
    main()

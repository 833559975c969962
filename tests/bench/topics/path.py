"""The savings by the island's flight: bytes of its path-aware bake beside those of a full one, and how far
the frames of both are apart.

Full is defined in tests/pipeline/full_bake.py: all four maps of every picture (of height maps too), all mips,
all levels of detail with all attributes, every patch of the terrain at the same error. Left out of it are the
maps that no scene could use: those of a colour picture whose heights are painted in a picture of its own.
The frames are those of the scene's viewport at ten moments, rendered by the player from both bakes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from paradize.build.options import BuildOptions
from row import Row
from tests.pipeline.full_bake import MOMENTS_S, Sizes, frames_apart, full_bake, measure_sizes
from tests.places import ROOT

ISLAND = ROOT / "raw_assets" / "island.toml"


def row_of(what: str, sizes: Sizes, full: int, frames: dict[str, float], limit: float | None) -> Row:
    ours = (
        f"FLIP mean {frames['flip_mean']:.2g}, largest {frames['flip_max']:.2g}, "
        f"PSNR {frames['psnr_db']:.4g} dB, "
        f"{frames['same']:.0f} of {len(MOMENTS_S)} frames the same byte by byte"
    )
    peer = f"largest source that the path needs: {sizes.source_name}, {sizes.source / 1e6:.2f} MB"
    return Row(
        what, sizes.path / 1e6, "the full bake", full / 1e6, ours, peer, limit, unit="MB",
        inside="the files of the baked folder", ours_on="bytes, no time", peer_on="bytes, no time",
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    del runs
    os.environ |= {"PARADIZE_STORE": str(folder / "store"), "PARADIZE_REPORT": ""}
    path_aware, full = folder / "path", folder / "full"
    from paradize.build.bake import bake

    for report in (bake(ISLAND, path_aware, BuildOptions()), full_bake(ISLAND, full, BuildOptions())):
        assert not report.errors, report.errors
    sizes = measure_sizes(ISLAND, path_aware, full)
    frames = frames_apart(path_aware, full, MOMENTS_S, folder)
    twice = [name for name in sizes.parts if name.startswith(("sand_height_", "effect_height_"))]
    useful = sizes.full - sum(sizes.parts[name] for name in twice)
    yield row_of("The island for its flight, bytes", sizes, useful, frames, 1.5)

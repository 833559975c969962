"""Tiers are in order: from `fast` to `exact` errors fall by every metric that a budget may name, and no tier
takes longer than another that errs no more. Shown by
`python -m tests.pipeline.tradeoff.test_tier_order FILE|FOLDER ...`.

Block compression has tests of its own (tests/pipeline/kernels/).
"""

from __future__ import annotations

import itertools
import statistics
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.maps.bake import bake_maps
from paradize.bakers.maps.rows import filter_errors, no_worse_than_fast
from paradize.bakers.product import MapProduct
from paradize.data import HeightMap
from paradize.errors import ParadizeError
from paradize.kernels.threads import VARIABLE as THREADS
from paradize.scene.budget import METRICS
from paradize.stages import normal
from paradize.tradeoff.plan import FileOptions, file_groups
from paradize.tradeoff.tiers import _worst
from paradize.tradeoff.timing import TrialGroup
from tests.pipeline.heights import save

STAGES = ("levels of detail", "tangent frames", "terrain", "slope filter")
ALIKE = 0.02  # errors nearer to each other than this share are one, as `paradize measure` has it
QUICKER = 0.9  # of a time: less than that has no chance
IN_ORDER, DOMINATED = 0.95, 0.5
# Under one bound a terrain of fewer triangles has a larger RMS (pipeline/paradize/build/README.md).
TRIANGLES_FOR_TIME = ("terrain", "fast", "balanced", "terrain_rms_m")


@dataclass
class Tally:
    """Files counted. order: (stage, tier, next tier, metric) -> whether each file errs no more in the next.
    dominated: (stage, tier) -> whether another tier is better on each file. seconds: of each tier."""

    order: dict[tuple[str, str, str, str], list[bool]] = field(default_factory=lambda: defaultdict(list))
    dominated: dict[tuple[str, str], list[bool]] = field(default_factory=lambda: defaultdict(list))
    seconds: dict[tuple[str, str], list[float]] = field(default_factory=lambda: defaultdict(list))

    def add(self, group: TrialGroup) -> None:
        ours = [one for one in group.trials if "simplifier" not in one.arguments]  # not other libraries
        found = {one.tier: one.call(**one.arguments, runs=3) for one in ours}
        common = min(len(made.levels) for made in found.values())
        errors = {tier: _worst(made.levels[:common]) for tier, made in found.items()}
        known = [name for name in errors[group.trials[0].tier] if METRICS.get(name, None)]
        assert known and all(METRICS[name].less_is_better for name in known)
        took = {tier: statistics.median(made.seconds) for tier, made in found.items()}
        for one, after in itertools.pairwise(found):
            for name in known:
                bound = group.trials[0].arguments.get("max_error_m", 0.0)  # far below it all is rounding
                slack = ALIKE * max(errors[one][name], bound) + 1e-7
                worse = errors[after][name] > errors[one][name] + slack
                self.order[group.stage, one, after, name].append(not worse)
        for tier in found:
            sizes = {name: found[name].bytes or 0 for name in found}
            self.seconds[group.stage, tier].append(took[tier])
            self.dominated[group.stage, tier].append(
                any(
                    took[other] < QUICKER * took[tier]
                    and all(errors[other][name] <= errors[tier][name] for name in known)
                    and (group.stage != "terrain" or sizes[other] <= sizes[tier])
                    for other in found
                    if other != tier
                )
            )


def measured(files: Sequence[Path]) -> Tally:
    """All files that can be read, on one core."""
    tally = Tally()
    for path in files:
        try:
            groups = file_groups(
                path, FileOptions() if path.suffix == ".obj" else FileOptions(source="height")
            )
        except ParadizeError as refused:
            print(f"{path}: {refused}", file=sys.stderr)
            continue
        for group in groups:
            if group.stage in STAGES and len(group.trials) > 1:
                tally.add(group)
    return tally


def lines(tally: Tally) -> Iterator[str]:
    for (stage, one, after, name), kept in tally.order.items():
        yield f"{stage}: {one} -> {after}: {name} falls on {sum(kept)} of {len(kept)} files"
    for (stage, tier), bad in tally.dominated.items():
        took = statistics.median(tally.seconds[stage, tier])
        yield f"{stage}: {tier}: median {1e3 * took:.3g} ms, dominated on {sum(bad)} of {len(bad)} files"


def sample(folder: Path, models: int, heights: int) -> list[Path]:
    """Models and heightmaps of every size, every so many-th."""
    found = []
    for pattern, least, count in (("*.obj", 10_000, models), ("height/*.png", 600, heights)):
        some = [path for path in sorted(folder.rglob(pattern)) if least < path.stat().st_size < 400_000]
        some = [path for path in some if "rgb" not in path.name and "nasty" not in str(path)]
        found += some[:: max(1, len(some) // count)][:count]
    return found


def test_slopes_of_eighth_order_are_not_held_to_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where balanced takes them exact makes the same normals, in the same time."""
    codes = np.linspace(0, 1, 17, dtype=np.float32)
    heights = codes[np.random.default_rng(5).integers(0, 17, (12, 20))]
    grounds = [
        HeightMap(heights, (4.0, 4.0), (True, True), "eighth", height_levels=codes, clamp_slopes=held)
        for held in (False, True)
    ]
    monkeypatch.setattr(normal, "_limited_slopes", lambda *_: pytest.fail("held"))
    free, held = (normal.normal_rows(ground, 0, 12) for ground in grounds)
    assert (free == held).all()


_ROOF = np.repeat(np.abs(np.arange(32) - 16)[None, :], 32, axis=0)
_STAIR = (np.arange(256) // 16)[None, :]
# For these `auto` predicts that a long fit errs least; it errs far more than the central difference.
MISJUDGED = {
    "roof.png": (_ROOF * 8).astype(np.uint8),
    "stair.png": (_STAIR * 17).astype(np.uint8),
    "stair of 16 bits.png": (_STAIR * 4369).astype(np.uint16),
    "roof of half floats.exr": (_ROOF / 16).astype(np.float32),
    "stair of half floats.exr": (_STAIR / 16).astype(np.float32),
}


@pytest.mark.parametrize("name", MISJUDGED)
def test_tiers_are_in_order_where_auto_misjudges_the_map(name: str, tmp_path: Path) -> None:
    path = save(tmp_path / name, MISJUDGED[name][:, :, None])

    def baked(tier: str, measure: bool = True) -> MapProduct:
        return bake_maps(
            path, only=["normal"], source="height", strength=20, tier=tier, measure=measure
        )["normal"]  # fmt: skip

    tiers = [baked(tier) for tier in ("fast", "balanced", "exact")]
    for one, after in itertools.pairwise(tiers):
        for part in ("p99", "mean", "max", "filter", "filter_p99", "filter_max"):
            metric = f"normal_{part}_deg"
            assert after.errors[metric] <= one.errors[metric], (metric, one.filter, after.filter)
    assert baked("balanced", measure=False).data == tiers[1].data


def test_large_maps_and_uv_islands_keep_no_filter_that_errs_more_than_that_of_fast() -> None:
    heights = np.resize(_STAIR[0] / np.float32(16), (300, 256)).astype(np.float32)
    islands = np.where(np.arange(256) % 64 < 60, np.arange(256) // 64, -1)[None, :].astype(np.int32)
    for layout in (None, np.repeat(islands, 300, axis=0)):
        large = HeightMap(heights, (20.0, 20.0), (False, False), "smooth6", islands=layout)
        fast = filter_errors(replace(large, filter_name="central"))
        assert any(error > fast[name] for name, error in filter_errors(large).items())
        assert all(error <= fast[name] for name, error in filter_errors(no_worse_than_fast(large)).items())


@pytest.mark.deep
def test_errors_fall_from_tier_to_tier_and_no_tier_is_dominated(
    corpus: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(THREADS, "1")
    tally = measured(sample(corpus, 40, 12))
    assert {key[0] for key in tally.order} == set(STAGES)
    for key, kept in tally.order.items():
        if key != TRIANGLES_FOR_TIME:
            assert sum(kept) >= IN_ORDER * len(kept), "\n".join(lines(tally))
    for key, bad in tally.dominated.items():
        assert sum(bad) <= DOMINATED * len(bad), (key, "\n".join(lines(tally)))


if __name__ == "__main__":
    import os

    os.environ[THREADS] = "1"
    places = [Path(name) for name in sys.argv[1:]]
    files = [file for place in places for file in (sample(place, 40, 12) if place.is_dir() else [place])]
    print(*lines(measured(files)), sep="\n")

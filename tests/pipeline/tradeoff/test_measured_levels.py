"""Levels of detail are measured as they are baked, and libraries compared where all of them reach."""

from __future__ import annotations

from pathlib import Path

from paradize.bakers.mesh.bake import bake_mesh
from paradize.scene.baker_settings import MeshSettings
from paradize.tradeoff.curve import Point, dominates
from paradize.tradeoff.plan import FileOptions, file_groups
from paradize.tradeoff.tiers import _uneven
from paradize.tradeoff.timing import TrialResult


def results(*chains: tuple[int, ...]) -> list[TrialResult]:
    return [TrialResult([0.1], [{} for _ in chain], 1, "", chain) for chain in chains]


def test_levels_are_compared_down_to_the_triangles_that_all_reach() -> None:
    assert _uneven(results((1780, 890, 445), (1780, 974, 516), (1780, 900))) == {0: 2, 1: 2}
    assert _uneven(results((1780, 890), (1780, 445))) == {}, "a library's one level is all that it has"
    assert _uneven(results((100, 50), (100,))) == {}, "the source alone is not a level to compare with"
    assert _uneven(results((), ())) == {}


def test_a_library_that_is_quicker_and_slides_the_texture_dominates_nothing() -> None:
    def point(series: str, seconds: float, slides: float) -> Point:
        result = {"median": seconds, "low": seconds, "high": seconds, "runs": 3}
        return {
            "tier": series, "seconds": result, "error": {"value": 0.1}, "bytes": 100,  # type: ignore[typeddict-item]
            "in_use": False, "dominated": False, "on_front": False, "series": series,
            "beside": {"lod_normal_p99_deg": 3.0, "uv_shift_p99": slides},
        }  # fmt: skip

    ours = point("paradize", 2.0, 0.001)
    assert dominates(point("other", 1.0, 0.001), ours, True)
    assert not dominates(point("other", 1.0, 0.03), ours, True)
    assert dominates(point("paradize", 1.0, 0.03), ours, True), "tiers of one series share what is beside"


def two_sheets(path: Path) -> Path:
    """Two sheets of 8 x 8 quads with a bump, which share the whole map."""
    count = range(9)
    points = [(x, y, z + 0.1 * (x % 3) * (y % 2)) for z in (0, 5) for y in count for x in count]
    lines = [f"v {x} {y} {z}" for x, y, z in points]
    lines += [f"vt {x / 8} {y / 8}" for y in count for x in count]
    for first in (0, 81):
        for a in (9 * y + x + 1 for y in range(8) for x in range(8)):
            lines.append("f " + " ".join(f"{v + first}/{v}" for v in (a, a + 1, a + 10, a + 9)))
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_model_whose_uvs_overlap_is_measured_as_the_command_bakes_it(tmp_path: Path) -> None:
    path = two_sheets(tmp_path / "sheets.obj")
    groups = {group.stage: group for group in file_groups(path, FileOptions())}
    assert "overlaps" in groups["atlas"].note
    (used,) = (trial for trial in groups["levels of detail"].trials if trial.tier == "balanced")
    measured = used.call(**used.arguments, runs=1)
    baked = bake_mesh(path, MeshSettings()).report["lods"]
    assert list(measured.triangles) == [level["triangles"] for level in baked]
    assert len(baked) > 1 and "normals turn by" in measured.note
    assert len(used.call(**used.arguments, runs=1, most_levels=2).triangles) == 2


def test_a_new_layout_says_that_pictures_of_the_old_one_no_longer_fit(tmp_path: Path) -> None:
    path = two_sheets(tmp_path / "sheets.obj")
    warnings = bake_mesh(path, MeshSettings(atlas=True)).report["warnings"]
    assert any("pictures painted for the old one no longer fit" in text for text in warnings)

"""How far a vertex sways: by its distance from the root, judged by a search of all pairs in float64."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Mesh
from paradize.formats.glb.reader import decode_glb
from paradize.kernels.mesh import reach
from paradize.readers.obj import read_obj
from paradize.scene.baker_settings import MeshSettings
from paradize.stages.reproject import take_sway
from paradize.stages.sway import ROOTED, sway
from tests.pipeline.searched import searched
from tests.pipeline.shapes import grid, soup, sphere
from tests.places import ROOT

F32 = npt.NDArray[np.float32]


def strip(*points: tuple[float, float, float]) -> Mesh:
    """A band along points, half as wide as its least step, as the blade of a frond."""
    rows = [(x, y, z + side) for x, y, z in points for side in (0.0, 0.01)]
    faces = [(k, k + 1, k + 2) if k % 2 else (k + 1, k, k + 2) for k in range(len(rows) - 2)]
    return soup(rows, faces)


def joined(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0, *(len(mesh.positions) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)]).astype(
            np.uint32
        ),
    )


def palm() -> Mesh:
    """A trunk of 4 m with two fronds of 1 m that hang beside its top."""
    trunk = strip(*((0.0, y, 0.0) for y in (0.0, 1.0, 2.0, 3.0, 4.0)))
    left, right = (
        strip(*((side * (0.05 + x), 4.0 + 0.1 * x, 0.0) for x in (0.0, 0.5, 1.0))) for side in (-1.0, 1.0)
    )
    return joined(trunk, left, right)


def test_the_root_stands_still_and_the_farthest_tip_leans_most() -> None:
    found = sway(palm())
    assert (found[:2] == 0).all()
    assert found[:, 0].max() == 1.0 and found[10:, 0].min() > found[8:10, 0].max() - 1e-3 > 0.5
    assert (np.diff(found[:10:2, 0]) > 0).all() and (np.diff(found[10:16:2, 0]) > 0).all()


def test_half_way_up_a_blade_leans_a_quarter_as_far_as_its_tip() -> None:
    found = sway(strip((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 2.0, 0.0)))
    assert found[:, 0] == pytest.approx([0.0, 0.0, 0.25, 0.25, 1.0, 1.0], abs=0.01)


def test_the_lowest_fiftieth_is_rooted_and_what_is_higher_bends() -> None:
    found = sway(strip((0.0, 0.0, 0.0), (0.0, 0.04, 0.0), (0.0, 0.4, 0.0), (0.0, 4.0, 0.0)))
    assert found[::2, 0] == pytest.approx([0.0, 0.0, (0.36 / 3.96) ** 2, 1.0], abs=1e-3)


def test_only_what_hangs_flutters_and_its_tip_most() -> None:
    found = sway(palm())[:, 1]
    assert (found[:10] == 0).all()
    for tips in (found[10:16], found[16:]):
        assert tips.min() == 0.0 and tips.max() == 1.0


def test_blades_that_stand_by_themselves_lean_alike_and_do_not_flutter() -> None:
    blades = [strip(*((x, y, 0.0) for y in (0.0, 0.2, 0.4))) for x in (0.0, 1.0, 5.0)]
    found = sway(joined(*blades))
    assert (found[:, 1] == 0).all()
    assert np.array_equal(found[:6], found[6:12]) and np.array_equal(found[:6], found[12:])


@given(st.integers(0, 2**31), st.integers(2, 6))
@settings(max_examples=25, deadline=None)
def test_distances_are_those_of_a_search_of_all_pairs(seed: int, parts: int) -> None:
    rng = np.random.default_rng(seed)
    made = [
        Mesh(
            (rng.uniform(-1, 1, (5, 3)) + rng.uniform(-4, 4, 3)).astype(np.float32),
            np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4]], np.uint32),
        )
        for _ in range(parts)
    ]
    mesh = joined(*made)
    found = reach(mesh.positions, mesh.triangles, ROOTED)
    assert np.allclose(found.from_root, searched(mesh), rtol=1e-12, atol=1e-12)


@given(st.integers(0, 2**31))
@settings(max_examples=10, deadline=None)
def test_the_order_of_triangles_and_vertices_changes_nothing(seed: int) -> None:
    mesh, rng = palm(), np.random.default_rng(seed)
    order = rng.permutation(len(mesh.positions))
    back = np.argsort(order)
    turned = Mesh(mesh.positions[order], rng.permutation(back[mesh.triangles].astype(np.uint32)))
    assert np.array_equal(sway(turned), sway(mesh)[order])


def test_vertices_at_one_place_sway_alike() -> None:
    mesh = sphere(8)
    assert mesh.uvs is not None
    _, first, number = np.unique(mesh.positions, axis=0, return_index=True, return_inverse=True)
    assert len(first) < len(mesh.positions), "the ball has a seam"
    found = sway(mesh)
    assert np.array_equal(found, found[first][number.reshape(-1)])


@pytest.mark.parametrize("scale", [2.0**-40, 1.0, 2.0**40])
def test_size_changes_nothing(scale: float) -> None:
    mesh = palm()
    scaled = replace(mesh, positions=mesh.positions * np.float32(scale))
    assert np.array_equal(sway(scaled), sway(mesh))


def test_a_flat_mesh_is_all_root() -> None:
    assert (sway(grid(4)) == 0).all()


def at_places(values: F32, mesh: Mesh) -> dict[bytes, set[bytes]]:
    found: dict[bytes, set[bytes]] = {}
    for place, value in zip(mesh.positions, values, strict=True):
        found.setdefault(place.tobytes(), set()).add(value.tobytes())
    return found


def test_a_level_sways_as_the_source_does_there_and_opens_no_seam() -> None:
    source = sphere(12)
    source = replace(source, sway=sway(source))
    level = sphere(7)
    taken = take_sway(source, level).sway
    assert taken is not None and taken.shape == (len(level.positions), 2)
    assert all(len(values) == 1 for values in at_places(taken, level).values())
    assert source.sway is not None
    for place, value in zip(level.positions, taken, strict=True):
        gap = np.linalg.norm(source.positions - place, axis=1)
        near = source.sway[gap < 0.35]
        assert (near.min(axis=0) - 1e-6 <= value).all() and (value <= near.max(axis=0) + 1e-6).all()


@pytest.mark.parametrize("quantise", [None, {}])
def test_a_mesh_holds_its_sway_only_where_a_pass_reads_it(quantise: dict[str, float] | None) -> None:
    model = ROOT / "raw_assets/palm/palm.obj"
    given = MeshSettings(lods=2, quantise=quantise)
    plain = ("POSITION", "NORMAL", "TEXCOORD_0")
    without = bake_mesh(model, replace(given, attributes=plain), tangent_tiers=False)
    made = bake_mesh(model, replace(given, attributes=(*plain, "_SWAY")), tangent_tiers=False)
    assert b"_SWAY" not in without.glb
    levels = decode_glb(made.glb)
    errors = [level["quantise_sway_max"] for level in made.report["lods"]] if quantise is not None else [0.0]
    assert max(errors) <= 0.5 / 255 + 1e-7
    for lod, bare in zip(levels, decode_glb(without.glb), strict=True):
        assert lod.mesh.sway is not None and bare.mesh.sway is None
        assert np.array_equal(lod.mesh.positions, bare.mesh.positions)
        # The roots stand still, the tips lean most, and fronds flutter.
        lowest = lod.mesh.positions[:, 1] < lod.mesh.positions[:, 1].min() + 0.05
        assert lod.mesh.sway[lowest, 0].max() < 0.01 and lod.mesh.sway[:, 0].max() > 0.9
        assert lod.mesh.sway[:, 1].max() > 0.9


def test_the_island_s_palm_leans_from_the_root_to_the_tips() -> None:
    mesh = read_obj(Path(ROOT / "raw_assets/palm/palm.obj")).mesh
    found = sway(mesh)
    trunk = next(group for group in mesh.groups if group.name == "trunk")
    rows = np.unique(mesh.triangles[trunk.first : trunk.first + trunk.count])
    assert (found[rows, 1] == 0).all(), "the trunk stands by itself"
    heights = mesh.positions[rows, 1]
    rank = np.corrcoef(np.argsort(np.argsort(heights)), np.argsort(np.argsort(found[rows, 0])))[0, 1]
    assert rank > 0.99

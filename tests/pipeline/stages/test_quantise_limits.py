"""Codes at their limits: the least step_grid, the fewest bits; and odd but legal files before the metric."""

from __future__ import annotations

import struct
from dataclasses import replace

import numpy as np
import pytest

from paradize.data import Lod, Mesh, QuantisationGrid
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.reader import decode_glb
from paradize.metrics.quantised import quantised_errors
from paradize.stages.quantise import (
    direction_bits,
    mesh_grid,
    quantise,
    quantise_levels,
    terrain_grid,
)
from paradize.stages.tangents import tangent_frames
from tests.pipeline.glb_json import document, with_document
from tests.pipeline.shapes import grid, sphere


@pytest.mark.parametrize("seed", range(20))
def test_a_grid_spans_its_mesh_with_the_least_step_that_a_float_can_have(seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(9, 3)).astype(np.float32)
    wide = points.astype(np.float64)
    extent = float((wide.max(axis=0) - wide.min(axis=0)).max())
    step = np.float32(mesh_grid([Mesh(points, np.zeros((0, 3), np.uint32))]).step[0])
    assert float(step) * 65535 >= extent > float(np.nextafter(step, np.float32(0))) * 65535


def test_bits_of_directions_keep_half_the_diagonal_of_a_code_inside_the_bound() -> None:
    """Half a code along each of three axes: sqrt(3) / 2 of it, and more by how far steps differ."""
    for ratio in (1.0, 20.0):
        step_grid = QuantisationGrid((1.0, 1.0 / ratio, 0.5), (0.0, 0.0, 0.0))
        for bits, above in ((8, 16), (16, 32)):
            bound = np.degrees(np.sqrt(3) / 2 / (2 ** (bits - 1) - 1)) * max(ratio, 2.0)
            assert direction_bits(step_grid, bound * 1.001) == bits
            assert direction_bits(step_grid, bound * 0.999) == above


def test_heights_take_gentle_steps_where_they_cost_an_eighth_of_the_bound() -> None:
    """Pixels of 1 x 2 metres: a 64th of the longer side is 1 / 32; half of it is the error."""
    for error_m, step in ((8 / 64 * 1.001, 1 / 32), (8 / 64 * 0.999, 10 / 65535)):
        found = terrain_grid((5, 9), (8.0, 8.0), (-3.0, 7.0), error_m)
        assert found.step == (1.0, pytest.approx(step, rel=1e-9), 2.0)
        assert found.origin == (-4.0, -3.0, -4.0)
    oblong = terrain_grid((5, 9), (8.0, 12.0), (0.0, 1.0))
    assert oblong.origin == (-4.0, 0.0, -6.0)


def test_tangents_alone_can_need_sixteen_bits() -> None:
    """The ground's normals are codes of 8 bits; tangents that are turned by 14 degrees are not."""
    ground = tangent_frames(grid(2))
    assert ground.tangents is not None
    for degrees, kind in ((0.0, np.int8), (14.0, np.int16)):
        tangents = ground.tangents.copy()
        tangents[:, :3] = [np.cos(np.radians(degrees)), 0, np.sin(np.radians(degrees))]
        mesh = replace(ground, tangents=tangents)
        (codes,) = quantise_levels([mesh], mesh_grid([mesh]))
        assert codes.normals is not None and codes.normals.dtype == kind


@pytest.mark.parametrize("value", [-0.001, 1.001])
def test_texture_coordinates_just_outside_stay_floats(value: float) -> None:
    ground = grid(2)
    assert ground.uvs is not None
    uvs = ground.uvs.copy()
    uvs[4, 1] = value
    found = quantise(replace(ground, uvs=uvs), mesh_grid([ground])).uvs
    assert found is not None and np.array_equal(found, uvs)


def encoded(*meshes: Mesh) -> bytes:
    step_grid = mesh_grid(meshes)
    return encode_glb([Lod(mesh, 0.0, 0.0, quantised=quantise(mesh, step_grid)) for mesh in meshes], "codes")


def test_all_levels_errors_are_shares_of_the_first_ones_diagonal() -> None:
    levels = [tangent_frames(sphere(12, radius=radius)) for radius in (2.0, 0.5)]
    for found in quantised_errors(encoded(*levels), levels):
        assert found["quantise_max"] * 2 * 12**0.5 == pytest.approx(found["quantise_max_m"], rel=1e-5) != 0


def test_a_row_begins_where_view_and_accessor_say_together() -> None:
    mesh = tangent_frames(sphere(6))
    data = encoded(mesh)
    tree = document(data)
    for entry in tree["accessors"]:
        view = tree["bufferViews"][entry["bufferView"]]
        entry["byteOffset"] = view.pop("byteOffset", 0)
    assert quantised_errors(with_document(data, tree), [mesh]) == quantised_errors(data, [mesh])


def test_the_lowest_code_stands_for_minus_one() -> None:
    """-32768 of 16 bits is -1 as -32767 is: no sign is another, no direction longer."""
    mesh = tangent_frames(grid(2))
    assert mesh.tangents is not None
    mesh = replace(mesh, tangents=mesh.tangents * np.float32([1, 1, 1, -1]))
    data = bytearray(encoded(mesh))
    tree = document(bytes(data))
    entry = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["TANGENT"]]
    (length,) = struct.unpack_from("<I", data, 12)
    at = 28 + length + tree["bufferViews"][entry["bufferView"]]["byteOffset"] + 6
    assert struct.unpack_from("<h", data, at) == (-32767,)
    struct.pack_into("<h", data, at, -32768)
    assert quantised_errors(bytes(data), [mesh])[0]["quantise_tangent_max_deg"] < 0.01


@pytest.mark.parametrize(("bits", "form", "lowest"), [(8, "<b", -128), (16, "<h", -32768)])
def test_the_lowest_code_is_read_as_the_one_above_it(bits: int, form: str, lowest: int) -> None:
    mesh = tangent_frames(grid(2))
    assert mesh.tangents is not None
    mesh = replace(mesh, tangents=mesh.tangents * np.float32([-1, 1, 1, -1]))
    codes = quantise(mesh, mesh_grid([mesh]), direction_bits=bits)
    data = bytearray(encode_glb([Lod(mesh, 0.0, 0.0, quantised=codes)], "codes"))
    tree = document(bytes(data))
    entry = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["TANGENT"]]
    (length,) = struct.unpack_from("<I", data, 12)
    at = 28 + length + tree["bufferViews"][entry["bufferView"]]["byteOffset"]
    (before,) = decode_glb(bytes(data))
    for component in (0, 3):
        place = at + component * bits // 8
        assert struct.unpack_from(form, data, place) == (lowest + 1,)
        struct.pack_into(form, data, place, lowest)
    (after,) = decode_glb(bytes(data))
    assert before.mesh.tangents is not None and after.mesh.tangents is not None
    assert before.mesh.tangents.tobytes() == after.mesh.tangents.tobytes()

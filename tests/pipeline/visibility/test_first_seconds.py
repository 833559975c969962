"""The second that is stated for a mip or a level of detail is never later than a brute search finds, and not
much earlier."""

from __future__ import annotations

import numpy as np
import pytest

from paradize.scene.flight import plan_flight
from paradize.scene.placement import placed
from paradize.scene.settings import EyePoint, Instance, TargetPoint
from paradize.scene.settings import Flight as FlightSettings
from paradize.visibility.finest_mip import SLACK, Placement, finest_lod, surface_of
from paradize.visibility.first_seconds import mip_seconds, texels_by_run
from paradize.visibility.texel_footprint import views_of
from tests.pipeline.visibility.test_required_detail import FOV_DEG, HEIGHT, flight_views_of, texels_at, waves

EARLIER_S = 1.0  # that bounds may be: half a level, and boxes a quarter of the surface wide


def approach(far_m: float, near_m: float) -> FlightSettings:
    """Eight seconds from far to near, at first looking aside."""
    way = [far_m + (near_m - far_m) * share for share in (0.0, 0.0, 0.3, 0.6, 0.9, 1.0, 1.0, 0.5)]
    aside = [2.0 * far_m, 2.0 * far_m, *6 * [0.0]]
    return FlightSettings(
        duration_s=8.0,
        fov_deg=FOV_DEG,
        near_m=0.2,
        far_m=500.0,
        eye=tuple(EyePoint(position=(0.5, 3.0, z)) for z in way),
        target=tuple(TargetPoint(position=(x, 0.0, 0.5 * x)) for x in aside),
    )


def first(moments: np.ndarray, needed: np.ndarray) -> float | None:
    return float(moments[np.argmax(needed)]) if needed.any() else None


def test_a_mip_is_needed_from_the_second_on_that_a_pixel_first_samples_it() -> None:
    flight, mesh, size = approach(90.0, 6.0), waves(12, 4.0, 0.3), (4096, 4096)
    assert mesh.uvs is not None
    views = views_of(flight_views_of(flight), ("camera",), None)
    texels = texels_by_run(views, surface_of(mesh, mesh.uvs, *size), [Placement()])
    stated = mip_seconds(views.query, texels, 13)
    moments = np.linspace(0.0, 8.0, 80, endpoint=False)
    brute = texels_at(moments, plan_flight(flight), mesh, size)
    for level, second in enumerate(stated):
        # The mips that a device surely samples, and those that it may sample: half a level finer.
        sure = first(moments, brute < (np.inf if level == 12 else float(2 << level)))
        may = first(moments, brute < (np.inf if level == 12 else SLACK * float(2 << level)))
        assert sure is None or (second is not None and second <= sure), level
        assert second is None or may is None or may - second < EARLIER_S, (level, second, may)
    assert len(set(stated)) > 3  # the flight needs them one after another
    assert stated == sorted(stated, key=lambda s: -(np.inf if s is None else s))


def test_a_level_of_detail_is_needed_from_the_second_on_that_the_player_first_draws_it() -> None:
    flight, errors = approach(200.0, 8.0), [0.0, 0.02, 0.1, 0.5]
    where = ((0.0, 1.0), (-9.0, 2.0))  # z and scale
    places = [Placement(placed(Instance(position=(0.0, 0.0, z), scale=scale))) for z, scale in where]
    views = views_of(flight_views_of(flight), ("camera",), None)
    *_, stated = finest_lod(views, (0.0, 0.0, 0.0), 1.0, errors, places)
    pixels, planned = HEIGHT / (2 * np.tan(np.radians(FOV_DEG) / 2)), plan_flight(flight)
    moments = np.linspace(0.0, 8.0, 800, endpoint=False)
    drawn = np.full((len(moments), len(places)), 99)  # the level that the player draws
    for at, t in enumerate(moments):
        eye, target = (np.array(place) for place in planned.view(float(t)))
        ahead = (target - eye) / np.linalg.norm(target - eye)
        for i, (z, scale) in enumerate(where):
            way = np.array([0.0, 0.0, z]) - eye
            away = np.linalg.norm(way)
            if way @ ahead / away > np.cos(np.radians(FOV_DEG / 2)):  # its centre is surely in the picture
                accepted = max(0.0, away - scale) / pixels
                drawn[at, i] = max([k for k in range(4) if errors[k] * scale <= accepted], default=0)
    for level, second in enumerate(stated):
        brute = first(moments, (drawn <= level).any(axis=1))
        assert (brute is None) == (second is None), level
        if brute is not None and second is not None:
            assert brute - EARLIER_S < second <= brute, level
    assert stated[0] is None and len(set(stated)) == 4


def test_what_is_never_seen_is_never_needed() -> None:
    mesh = waves(4, 4.0, 0.3)
    assert mesh.uvs is not None
    views = views_of(flight_views_of(approach(90.0, 6.0)), ("camera",), None)
    away = Placement(placed(Instance(position=(0.0, 900.0, 0.0))))
    texels = texels_by_run(views, surface_of(mesh, mesh.uvs, 64, 64), [away])
    assert mip_seconds(views.query, texels, 7) == [None] * 7
    assert finest_lod(views, (0.0, 0.0, 0.0), 1.0, [0.0, 0.1], [away])[3] == [None, None]


@pytest.mark.parametrize("levels", [1, 5])
def test_the_coarsest_mip_is_needed_as_soon_as_anything_is_seen(levels: int) -> None:
    mesh = waves(4, 4.0, 0.3)
    assert mesh.uvs is not None
    views = views_of(flight_views_of(approach(90.0, 6.0)), ("camera",), None)
    texels = texels_by_run(views, surface_of(mesh, mesh.uvs, 64, 64), [Placement()])
    seen_s = mip_seconds(views.query, texels, levels)[-1]
    assert seen_s is not None and 0.0 < seen_s < 4.0

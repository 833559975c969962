"""The cost of laying out, filling and walking the gutters of a map, beside baking the map."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from paradize.bakers.color import bake_color
from paradize.build.measurements.gutter_limits import sampled_levels
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.kernels.gutter import walk
from paradize.readers.obj import read_obj
from paradize.stages.gutter import find_islands
from row import CORES, Row, on, pair_ms
from tests.places import ROOT

JETTY = ROOT / "raw_assets/jetty"


def rows(runs: int, folder: Path) -> Iterator[Row]:
    picture = JETTY / "jetty.png"
    mesh = read_obj(JETTY / "jetty.obj").mesh
    texture = decode_ktx2(bake_color(picture, measure=False).data)
    shape = {"height": texture.height, "width": texture.width}
    islands = find_islands(mesh, repeat=False, **shape)
    assert islands is not None
    reach = np.full(islands.count, 0.001)
    chain = sampled_levels(texture, "color")
    found = walk(chain, "color", islands.layout, reach)
    of = f"{islands.count} islands on {texture.width} x {texture.height}"

    def bake() -> object:
        return bake_color(picture, measure=False)

    sides = {
        "inside": "ours: that alone; the peer's: the bake, decoding included",
        "ours_on": on(CORES),
        "peer_on": on(CORES),
    }
    name = "baking the colour map, PNG to BC1 KTX2"
    ours, peer = pair_ms(lambda: find_islands(mesh, repeat=False, **shape), bake, runs)
    yield Row(f"finding {of} texels", ours, name, peer, "", "", **sides)
    ours, peer = pair_ms(lambda: walk(chain, "color", islands.layout, reach), bake, runs)
    yield Row(
        f"walking their borders at all {len(chain)} levels", ours, name, peer,
        f"{sum(level.samples for level in found)} samples", "", **sides,
    )  # fmt: skip

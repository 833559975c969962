"""How the vertices of a plant, a flag or a sign move in the wind: what a player needs to bend them.

The trunk of a palm leans little and the tips of its fronds lean far: a point leans by its distance from the
root along trunk and rachis, squared, as the end of a beam that is loaded evenly. What hangs on a part that
stands, a frond or a bunch of nuts, also flutters by its distance from where it hangs.

Source: T. Sousa, "Vegetation Procedural Animation and Shading in Crysis", GPU Gems 3, 2007, chapter 16, which
has artists paint what is found here from the mesh.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.kernels.mesh import number_rows, reach

if TYPE_CHECKING:
    from paradize.data import F32, Mesh

# Vertices in this lowest share of the height are rooted.
ROOTED = 0.02


def sway(mesh: Mesh) -> F32:
    """Returns (n, 2) float32 in 0 to 1, for each vertex: how far it leans, of what the farthest does; and how
    far it flutters, of what the tip of its branch does. Vertices at one place get the same values."""
    number, first = number_rows(mesh.positions)
    found = reach(mesh.positions[first], number[mesh.triangles], ROOTED)
    longest = float(found.from_root.max())
    lean = (found.from_root / longest) ** 2 if longest > 0.0 else np.zeros_like(found.from_root)
    return np.ascontiguousarray(np.stack([lean, found.in_branch], axis=1)[number], np.float32)

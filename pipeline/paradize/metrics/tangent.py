"""How sound tangent frames are: length, right angles, sign; and how far from other frames, in degrees."""

from __future__ import annotations

import numpy as np

from paradize.data import Mesh
from paradize.kernels.reference import angles_deg


def frame_faults(mesh: Mesh) -> dict[str, float]:
    """tangent_length: largest |1 - length|; tangent_lean_deg: largest angle that a tangent leans from the
    plane of its normal; tangent_sign: how many w are neither 1 nor -1. All 0 for perfect frames."""
    if mesh.tangents is None or mesh.normals is None:
        return {"tangent_length": 0.0, "tangent_lean_deg": 0.0, "tangent_sign": 0.0}
    t = mesh.tangents.astype(np.float64)
    length = np.sqrt(t[:, 0] * t[:, 0] + t[:, 1] * t[:, 1] + t[:, 2] * t[:, 2])
    lean = np.abs(90.0 - angles_deg(mesh.tangents[:, :3], mesh.normals))
    return {
        "tangent_length": float(f"{float(np.abs(1.0 - length).max()):.6g}"),
        "tangent_lean_deg": float(f"{float(lean.max()):.6g}"),
        "tangent_sign": float((np.abs(mesh.tangents[:, 3]) != 1).sum()),
    }

"""Where a map of a glTF material lies: a set of texture coordinates, and KHR_texture_transform."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TextureTransform:
    """Texture coordinates of a material's maps. coordinates: the number of the set. matrix: a b tx c d ty:
    u' = a u + b v + tx, v' = c u + d v + ty."""

    coordinates: int = 0
    matrix: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)

    def relative_to(self, other: TextureTransform) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """Scale and offset, along u and v, by which the other's coordinates become these; None where they are
        of another set, turned or sheared."""
        a, b, x, c, d, y = other.matrix
        p, q, own_x, r, s, own_y = self.matrix
        area = a * d - b * c
        if self.coordinates != other.coordinates or area == 0.0:
            return None
        along, across = (p * d - q * c) / area, (q * a - p * b) / area  # self's rows by other's
        beside, down = (r * d - s * c) / area, (s * a - r * b) / area
        if max(abs(across), abs(beside)) > 1e-6 * max(abs(along), abs(down)):
            return None
        return (along, down), (own_x - along * x, own_y - down * y)

    def __str__(self) -> str:
        moved = ", moved by KHR_texture_transform" if self.matrix != (1.0, 0.0, 0.0, 0.0, 1.0, 0.0) else ""
        return f"TEXCOORD_{self.coordinates}{moved}"

"""`paradize export`: writes a baked folder as one self-contained GLB.

scene.py writes it; flight.py makes the camera's keys, pictures.py the PNG textures, heights.py the terrain
from above, shapes.py quads and joined patches."""

__all__ = ["scene"]

"""Pictures of what was baked: pictures.py shows each map as the hardware reads it, shade.py lights a
material, raster.py finds the pixels of triangles, player.py has the player draw a scene."""

__all__ = ["pictures", "player", "raster", "shade"]

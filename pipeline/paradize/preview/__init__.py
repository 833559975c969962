"""Pictures of what was baked: pictures.py shows each map as the hardware reads it, shade.py lights a
material, player.py has the player draw a scene."""

__all__ = ["pictures", "player", "raster", "shade"]

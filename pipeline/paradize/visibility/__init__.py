"""Finds what the camera path sees. query.py: when a sphere is in view. texel_footprint.py: how small a pixel
is on a surface. finest_mip.py: the finest mip or level of detail that is ever read."""

__all__ = ["finest_mip", "first_seconds", "query", "texel_footprint"]

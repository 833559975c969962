"""Grids of heights that are no pictures, as terrain tools and surveys write them: SRTM tiles, ESRI ASCII
grids, raw numbers."""

from paradize.readers.grids.read import MAX_SIDE, read_grid

__all__ = ["MAX_SIDE", "read_grid"]

"""Paradize: bakes OBJ models, colour maps and heightmaps into measured, engine-ready assets."""

__version__ = "0.1.0"

"""Wavefront MTL: the statements of a material file and their maps, as records of materials."""

from paradize.readers.mtl.read import MAX_BYTES, Library, read_mtl

__all__ = ["MAX_BYTES", "Library", "read_mtl"]

"""Readers of source files: OBJ, MTL, pictures, heightmaps, sounds."""

__all__ = ["gltf", "heightmap", "image", "model", "names", "record", "sound"]

"""Readers of source files: OBJ, MTL, pictures, heightmaps, sounds."""

__all__ = ["gltf", "heightmap", "image", "metal", "model", "names", "record", "sound"]

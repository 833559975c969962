"""Readers and writers of baked files: GLB, KTX2, PNG, scene.json. FORMAT.md describes the bytes."""

__all__ = ["device", "glb", "ktx2", "png", "scene"]

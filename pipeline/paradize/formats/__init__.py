"""Readers and writers of baked files: GLB, KTX2, PNG, scene.json. FORMAT.md describes the bytes."""

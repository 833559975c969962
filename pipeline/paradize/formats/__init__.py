"""Readers and writers of what is baked: GLB, KTX2, PNG, scene.json. FORMAT.md describes the bytes."""

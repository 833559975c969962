"""`paradize measure`: the time, the error and the bytes of every tier of every stage.

scene.py measures a scene, tiers.py one file. plan.py, mesh.py, texture.py and terrain.py list what is
measured, timing.py times it, curve.py and words.py draw the conclusions; attribution.py and player.py measure
pictures."""

__all__ = ["plan", "scene", "tiers"]

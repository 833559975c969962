"""`paradize new`: writes a small scene that bakes and plays at once, with your model in it.

scene.py writes the TOML and copies the model; sources.py makes sky, terrain, sand and a vase.
"""

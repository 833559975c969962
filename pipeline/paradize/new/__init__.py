"""`paradize new`: a small scene that bakes and plays at once, with your model in it. scene.py writes it."""

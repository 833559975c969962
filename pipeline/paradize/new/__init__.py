"""`paradize new`: writes a small scene that bakes and plays at once, with your model in it.

scene.py writes the TOML; model.py copies the model, shapes.py measures it, and instances.py lists the places
of what a glTF shows often; views.py takes its cameras and its sun; sources.py makes sky, terrain, sand and a
vase. template.py writes the scenes of --template, whose texts and sources are in templates/.
"""

__all__ = ["scene", "template", "templates"]

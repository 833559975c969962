"""One package or module per kind of artifact: sources and settings in, a baked file and its errors out.

registry.py names the function of each kind; a worker process calls it. product.py is what the bakers of
pictures share. No baker knows a scene's other artifacts, the store, or the folder that is published.
"""

__all__ = ["authored", "color", "cubemap", "maps", "mesh", "product", "quantise", "registry", "terrain"]

"""`paradize export`: a baked folder as one self-contained GLB. scene.py is the way in."""

"""Model -> GLB: levels of detail, tangent frames, the UV atlas, draw order. bake.py joins them.

lods_from_path.py decides from the camera path how fine the levels must be; refine.py is the `exact` tier.
"""

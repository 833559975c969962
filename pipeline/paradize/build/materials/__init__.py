"""The materials of a scene's objects and their maps: what models say, what the scene adds, which maps are
shared, and what of a colour map the triangles show."""

"""A heightmap -> a mesh (mesh.py) or the tiles of patches that the player streams (tiles.py).

tree.py describes the tree of right triangles; grow.py finds the patches that a flight needs.
"""

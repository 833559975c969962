"""Authored maps -> textures: normal, height, gloss, occlusion. bake.py joins the steps.

pictures.py reads the pictures, normals.py judges a normal map, cast.py casts occlusion from a model,
rows.py makes any rows of the maps and what metrics compare them with, textures.py makes and measures all
mips.
"""

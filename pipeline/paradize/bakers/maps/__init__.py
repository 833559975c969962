"""A picture -> the maps of a material: height, normal, gloss, du/dv. bake.py joins the steps.

rows.py makes any rows of the maps; textures.py writes KTX2 with all mips, png.py writes PNG.
"""

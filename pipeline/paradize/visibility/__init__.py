"""What the camera path sees: when a sphere is in view (query.py), how small a pixel is on a surface
(texel_footprint.py), and which mip or level of detail is the finest that is ever read (finest_mip.py).
"""

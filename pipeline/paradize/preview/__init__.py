"""Baked maps as pictures: shade.py lights a material, pictures.py shows each map as the hardware reads it."""

"""Measures published objects: how levels of detail look, how near the flight comes, how far gutters reach,
how fine textures must be. object_measurements.py runs it in workers and keeps the results."""

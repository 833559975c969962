"""The scene file and what follows from it alone.

settings.py holds every field with its default, unit and range; schema.py reads a table of TOML; budget.py
names the metrics; flight.py is the camera path; requirements.py says which artifacts exist, and which pass
needs each.
"""

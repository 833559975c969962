"""The scene file and what follows from it alone.

settings.py declares every field with its default, unit, range and meaning (FIELDS.md lists them); schema.py
reads a table of TOML; budget.py names the metrics; flight.py is the camera path; requirements.py says which
artifacts exist, and which pass needs each."""

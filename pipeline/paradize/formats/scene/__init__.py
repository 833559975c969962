"""scene.json. manifest.py reads and writes it, schema.py says what each member must be, fields.py holds the
checks of single members, terrain_tables.py those of the terrain's tree."""

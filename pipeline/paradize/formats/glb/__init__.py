"""GLB (binary glTF 2.0): encode.py writes levels of detail, reader.py reads them; layout.py: the fields.

tiles.py writes the terrain's patches, bundle.py what `export` writes, codes.py vertices as 16-bit codes;
cut.py leaves levels out of a file.
"""

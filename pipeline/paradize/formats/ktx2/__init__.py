"""KTX2 textures. encode.py writes, reader.py reads, layout.py defines the fields, cut.py removes mips,
size.py reads the size."""

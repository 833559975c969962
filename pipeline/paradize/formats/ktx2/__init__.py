"""KTX2 textures: encode.py writes, reader.py reads, layout.py names the fields, cut.py leaves mips out."""

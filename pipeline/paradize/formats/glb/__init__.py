"""GLB (binary glTF 2.0). encode.py writes levels of detail, reader.py reads them, layout.py has the
constants.

tiles.py: terrain patches. bundle.py: the output of `export`. quantised.py: decodes quantised vertices.
cut.py: removes levels from a file. document.py: reads the JSON alone. writer.py: the binary chunk.
"""

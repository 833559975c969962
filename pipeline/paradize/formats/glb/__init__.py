"""GLB (binary glTF 2.0). encode.py writes levels of detail, reader.py reads them, layout.py has the
constants.

tiles.py: terrain patches. bundle.py: the output of `export`. quantised.py: decodes quantised vertices.
cut.py: removes levels from a file. document.py: reads the JSON alone. measures.py: what a player
must know of a material before it loads the mesh. writer.py: the binary chunk.
"""

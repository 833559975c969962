"""Reads glTF 2.0 models, `.glb` and `.gltf`.

Source: The Khronos Group, "glTF 2.0 Specification", 2021, and its registry of extensions.

read.py is the door. document.py holds the container and its JSON, buffers.py and accessors.py the bytes and
the arrays, compression.py those that meshopt and Draco packed, nodes.py and skins.py where things stand,
primitives.py triangles and their attributes, materials.py and pictures.py the surface, assemble.py the one
mesh that comes out. extensions.py lists what is read of the registry. split.py takes instanced meshes out of
a model.

Nothing of a file is trusted: every index, count, offset and type is checked where it is used, the work is
bounded by the size of the files, and each fault is one SourceError with the JSON pointer of its place.
"""

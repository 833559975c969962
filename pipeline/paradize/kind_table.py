"""The kinds of files: their names, what to do with them, and the bytes and suffixes that tell them."""

from __future__ import annotations

import re
from dataclasses import dataclass

HEAD_BYTES = 1 << 16
MODEL_SUFFIXES = (".obj", ".glb", ".gltf", ".ply", ".stl")
GRID_SUFFIXES = (".hgt", ".raw", ".r16", ".r32")  # heights without a header
_CHECK = "`paradize check {file}` takes it"
_MAPS = "`paradize maps {file} -o {stem}-maps` takes it"
_TERRAIN = "`paradize terrain {file} -o {stem}.glb --size 111000 111000 --height 1` takes it"
_MESH = "`paradize mesh {file} -o {stem}.glb` or `paradize new {stem}-scene --from {file}` takes it"
_EXPORT = "export it as glTF (.glb) from the program that made it, or open it in Blender and export it there"
_UNPACK = "unpack it, and name the file that it holds"
_TO_PNG = "save it as PNG, TIFF or OpenEXR"
_TO_OGG = "save it as Ogg Vorbis, mono or stereo"
_POINTER = "it stands for a file that was not fetched: `git lfs pull` in its repository fetches it"
_PAGE = "a failed download leaves such a page in place of the file: download the file again"


@dataclass(frozen=True)
class Kind:
    """name: with its article, "an OBJ model". mend: what to do with such a file; {file}, {name} and {stem}
    are replaced by the file's own."""

    name: str
    mend: str = ""


OBJ = Kind("an OBJ model", _MESH)
GLTF = Kind("a glTF model", _MESH)
PLY = Kind("a PLY model", _MESH)
STL = Kind("an STL model", _MESH)
GLB = Kind("a GLB model", f"{_MESH.replace('-o {stem}.glb', '-o {stem}-baked.glb')}; a baked one: {_CHECK}")
MODEL = Kind("an OBJ, glTF, PLY or STL model")  # as it is wanted; a file is one of these
PICTURE = Kind("a picture", _MAPS)
HEIGHTS = Kind("a heightmap", _TERRAIN)
SCENE = Kind("a scene TOML", "`paradize bake {file}` takes it")
BAKED = Kind("a baked scene", _CHECK)
TEXTURE = Kind("a KTX2 texture", f"{_CHECK} if it is baked; save others as PNG where they were made")
SOUND = Kind("an Ogg sound", 'a scene takes it: write `file = "{name}"` under `[[sound]]`')
MATERIALS = Kind("an MTL material file", "give the OBJ model that it belongs to")
FOLDER = Kind("a folder", "name a file in it")
EMPTY = Kind("an empty file", "save or export it again")
UNKNOWN = Kind("a binary file of an unknown kind", "name another file")
TEXT = Kind("text")  # of any kind; the reader's own message is more specific

# Formats that are not read, so that a refusal can name them.
_FBX = Kind("an FBX model", _EXPORT)
_BLEND = Kind("a Blender file", "open it in Blender and export it as glTF (.glb)")
_COLLADA = Kind("a COLLADA model", _EXPORT)
_USD = Kind("a USD scene", _EXPORT)
_X3D = Kind("an X3D or VRML scene", _EXPORT)
_OFF = Kind("an OFF model", _EXPORT)
_POINTS = "make a surface of its points, as CloudCompare and MeshLab do, and export that as PLY"
_GDAL = "`gdal_translate {file} {stem}.tif` makes a GeoTIFF of it, which `paradize terrain` takes"
_SURFACE = "export its surface as OBJ from a viewer of {}"
_NAMED = "name one of the models that it names"
_TILE = "`npx 3d-tiles-tools {tool} -i {{file}} -o {{stem}}.glb` takes its model out"

MAGIC: tuple[tuple[bytes, Kind], ...] = (
    (b"\x89PNG\r\n\x1a\n", Kind("a PNG picture", _MAPS)),
    (b"\xff\xd8\xff", Kind("a JPEG picture", _MAPS)),
    (b"GIF8", Kind("a GIF picture", _MAPS)),
    (b"qoif", Kind("a QOI picture", _MAPS)),
    (b"DDS ", Kind("a DDS picture", _MAPS)),
    (b"\x76\x2f\x31\x01", Kind("an OpenEXR picture", _MAPS)),
    (b"#?RADIANCE", Kind("a Radiance picture", _MAPS)),
    (b"#?RGBE", Kind("a Radiance picture", _MAPS)),
    (b"II*\0", Kind("a TIFF picture", _MAPS)),
    (b"MM\0*", Kind("a TIFF picture", _MAPS)),
    (b"8BPS", Kind("a PSD picture", _MAPS)),
    (b"\xabKTX 20\xbb\r\n\x1a\n\0\0\0\0", Kind("a Basis Universal picture", _MAPS)),
    (b"\xabKTX 20\xbb\r\n\x1a\n", TEXTURE),
    (b"glTF", GLB),
    (b"ply\n", PLY),
    (b"ply\r", PLY),
    (b"OggS", SOUND),
    (b"Kaydara FBX Binary", _FBX),
    (b"; FBX ", _FBX),
    (b"BLENDER", _BLEND),
    (b"PXR-USDC", _USD),
    (b"#usda ", _USD),
    (b"Ogawa", Kind("an Alembic scene", _EXPORT)),
    (b"//Maya ASCII", Kind("a Maya scene", _EXPORT)),
    (b"#VRML", _X3D),
    (b"#X3D", _X3D),
    (b"b3dm", Kind("a batch of 3D Tiles", _TILE.format(tool="b3dmToGlb"))),
    (b"i3dm", Kind("a list of instances of 3D Tiles", _TILE.format(tool="i3dmToGlb"))),
    (b"VOX ", Kind("a MagicaVoxel model", _EXPORT)),
    (b"xof ", Kind("a DirectX model", _EXPORT)),
    (b"IDP2", Kind("a Quake 2 model", _EXPORT)),
    (b"IDP3", Kind("a Quake 3 model", _EXPORT)),
    (b"INTERQUAKEMODEL\0", Kind("an IQM model", _EXPORT)),
    (b"BB3D", Kind("a Blitz3D model", _EXPORT)),
    (b"AC3D", Kind("an AC3D model", _EXPORT)),
    (b"MS3D000000", Kind("a MilkShape model", _EXPORT)),
    (b"PMX ", Kind("an MMD model", _EXPORT)),
    (b"Pmd\0\0\x80?", Kind("an MMD model", _EXPORT)),
    (b"\0\x10[MeshSerializer", Kind("an Ogre model", _EXPORT)),
    (b"NetImmerse File Format", Kind("a NetImmerse model", _EXPORT)),
    (b"Gamebryo File Format", Kind("a NetImmerse model", _EXPORT)),
    (b"3D Geometry File Format", Kind("a Rhino model", _EXPORT)),
    (b"\0\1\1\x30db", Kind("an OpenFlight model", _EXPORT)),
    (b"\0\1\1\x44db", Kind("an OpenFlight model", _EXPORT)),
    (b"# vtk DataFile", Kind("a VTK data set", _EXPORT)),
    (b"# .PCD", Kind("a PCD point cloud", _POINTS)),
    (b"LASF", Kind("a LAS point cloud", _POINTS)),
    (b"CDF\1", Kind("a netCDF data set", _GDAL)),
    (b"CDF\2", Kind("a netCDF data set", _GDAL)),
    (b"\x89HDF\r\n\x1a\n", Kind("an HDF5 data set", _GDAL)),
    (b"GRIB", Kind("a GRIB data set", _GDAL)),
    (b"EHFA_HEADER_TAG", Kind("an ERDAS grid", _GDAL)),
    (b"TERRAGENTERRAIN ", Kind("a Terragen terrain", _GDAL)),
    (b"binterr", Kind("a VTP terrain", _GDAL)),
    (b"DSAA", Kind("a Surfer grid", _GDAL)),
    (b"DSBB", Kind("a Surfer grid", _GDAL)),
    (b"DSRB", Kind("a Surfer grid", _GDAL)),
    (b"gimp xcf", Kind("a GIMP image", _TO_PNG)),
    (b"VTF\0", Kind("a Valve texture", _TO_PNG)),
    (b"PVR\3", Kind("a PVR texture", _TO_PNG)),
    (b"PKM ", Kind("an ETC texture", _TO_PNG)),
    (b"\x13\xab\xa1\x5c", Kind("an ASTC texture", _TO_PNG)),
    (b"\xabKTX 11\xbb\r\n\x1a\n", Kind("a KTX 1 texture", _TO_PNG)),
    (b"sB\x13\0", Kind("a Basis Universal texture", _TO_PNG)),
    (b"%PDF", Kind("a PDF document", _TO_PNG)),
    (b"fLaC", Kind("a FLAC sound", _TO_OGG)),
    (b"ID3", Kind("an MP3 sound", _TO_OGG)),
    (b"version https://git-lfs", Kind("a pointer of Git LFS", _POINTER)),
    (b"\xff\xfe", TEXT),  # UTF-16
    (b"\xfe\xff", TEXT),
)
# Packed files, of which the suffix says more.
PACKED: tuple[tuple[bytes, Kind], ...] = (
    (b"PK\x03\x04", Kind("a ZIP archive", _UNPACK)),
    (b"Rar!", Kind("a RAR archive", _UNPACK)),
    (b"7z\xbc\xaf\x27\x1c", Kind("a 7-Zip archive", _UNPACK)),
    (b"\x1f\x8b", Kind("a file that gzip packed", _UNPACK)),
    (b"\x28\xb5\x2f\xfd", Kind("a file that Zstandard packed", _UNPACK)),
)
RIFF_MAGIC = (b"RIFF", b"RIFX", b"RF64")  # its numbers big-endian, and of 64 bits
RIFF = {b"WEBP": Kind("a WebP picture", _MAPS), b"WAVE": Kind("a WAV sound", _TO_OGG)}  # at byte 8
SUFFIXES = dict.fromkeys(
    (".avif", ".bmp", ".jp2", ".pbm", ".pfm", ".pgm", ".pnm", ".ppm", ".tga", ".webp"), PICTURE
)
SUFFIXES |= dict.fromkeys(GRID_SUFFIXES, HEIGHTS) | {".ply": PLY, ".stl": STL}
SUFFIXES |= dict.fromkeys((".usd", ".usdc", ".usda", ".usdz"), _USD) | {".blend": _BLEND, ".fbx": _FBX}
SUFFIXES |= {
    suffix: Kind(name, _EXPORT)
    for suffix, name in (
        (".3ds", "a 3DS model"),
        (".3mf", "a 3MF model"),
        (".abc", "an Alembic scene"),
        (".c4d", "a Cinema 4D scene"),
        (".lwo", "a LightWave model"),
        (".max", "a 3ds Max scene"),
        (".mb", "a Maya scene"),
        (".skp", "a SketchUp model"),
    )
}
SUFFIXES |= {
    suffix: Kind(name, _GDAL)
    for suffix, name in (
        (".bil", "a raw grid of GIS"),
        (".bip", "a raw grid of GIS"),
        (".bsq", "a raw grid of GIS"),
        (".dem", "a USGS DEM"),
        (".dt0", "a DTED grid"),
        (".dt1", "a DTED grid"),
        (".dt2", "a DTED grid"),
        (".e00", "an ArcInfo grid"),
        (".flt", "a raw grid of GIS"),
        (".vrt", "a list of grids of GIS"),
    )
}
_VOLUME = Kind("a medical volume", _SURFACE.format("volumes, such as 3D Slicer"))
_SPLATS = Kind("a cloud of Gaussian splats", f"they have no surface: {_POINTS}")
SUFFIXES |= {".dcm": _VOLUME, ".nii": _VOLUME, ".splat": _SPLATS, ".spz": _SPLATS}
SOUNDS = {  # whose first bytes say too little
    suffix: Kind(f"{name} sound", _TO_OGG)
    for suffix, name in (
        (".aac", "an AAC"),
        (".aif", "an AIFF"),
        (".aiff", "an AIFF"),
        (".m4a", "an AAC"),
        (".mp3", "an MP3"),
        (".wma", "a WMA"),
    )
}
SUFFIXES |= SOUNDS
SUFFIXES |= dict.fromkeys((".iff", ".lbm"), Kind("an IFF file", _TO_PNG))
SUFFIXES[".pcx"] = Kind("a PCX file", _TO_PNG)
SUFFIXES[".xyz"] = Kind("a list of points", f"of heights on a grid {_GDAL}; of others {_POINTS}")
SUFFIXES |= dict.fromkeys((".heic", ".heif"), Kind("a HEIC photo", _TO_PNG))
# An output folder of such a name is a mistake. Most of these kinds are told by their bytes, not by the name.
FILE_SUFFIXES = frozenset(
    (
        *(*MODEL_SUFFIXES, *SUFFIXES),
        *(".asc", ".basis", ".dds", ".exr", ".gif", ".hdr", ".jpe", ".jpeg", ".jpg", ".jxl", ".ktx", ".ktx2"),
        *(".pbm", ".png", ".psd", ".qoi", ".svg", ".tif", ".tiff"),
        *(".dae", ".ma", ".mtl", ".off", ".step", ".stp", ".vox", ".vrm", ".wrl", ".x3d"),
        *(".flac", ".ogg", ".wav", ".7z", ".gz", ".rar", ".zip", ".zst"),
        *(".csv", ".html", ".json", ".pdf", ".toml", ".txt", ".xml"),
    )
)


# Possessive quantifiers: a match never tries blanks and comments in another way, which would take for ever.
_BEFORE_ROOT = rb"(?:\xef\xbb\xbf)?(?:\s|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>\[]*+(?:\[.*?\]\s*+)?>)*+"


def _xml(root: bytes) -> re.Pattern[bytes]:
    """Finds text of XML by the name of its root element."""
    return re.compile(rb"\A%s<%s[\s>]" % (_BEFORE_ROOT, root), re.S)


# The words near the beginning of text of some kinds, the more particular first.
TEXTS: tuple[tuple[re.Pattern[bytes], Kind], ...] = (
    (re.compile(rb"\A\s*<(?:!DOCTYPE\s+html|html)\b", re.I), Kind("a web page", _PAGE)),
    (_xml(b"COLLADA"), _COLLADA),
    (_xml(b"X3D"), _X3D),
    (_xml(b"amf"), Kind("an AMF model", _EXPORT)),
    (_xml(b"VTKFile"), Kind("a VTK data set", _EXPORT)),
    (_xml(b"GIFTI"), Kind("a GIfTI surface", _EXPORT)),
    (_xml(b"robot"), Kind("a description of a robot (URDF)", _NAMED)),
    (_xml(b"sdf"), Kind("a description of a simulation (SDF)", _NAMED)),
    (_xml(b"mesh"), Kind("an Ogre model", _EXPORT)),
    (_xml(b"svg"), Kind("an SVG drawing", _TO_PNG)),
    (
        re.compile(rb"\AISO-10303-21\b.{0,8192}?\bFILE_SCHEMA\s*\(\s*\(\s*'IFC", re.S),
        Kind("an IFC model", "`IfcConvert {file} {stem}.glb` makes a GLB of it"),
    ),
    (re.compile(rb"\AISO-10303-21\b"), Kind("a STEP model", _EXPORT)),
    (re.compile(rb"\A.{72}S[ 0]{6}1\r?\n"), Kind("an IGES model", _EXPORT)),
    (re.compile(rb"\A(?:\s*999\s.*\n)?\s*0\s+SECTION\b"), Kind("a DXF drawing", _EXPORT)),
    (re.compile(rb"\A(?:\s|#.*\n)*+(?:ST)?C?N?4?n?OFF\b"), _OFF),
    (re.compile(rb"\A\s*MD5Version\s+\d"), Kind("a Doom 3 model", _EXPORT)),
    (re.compile(rb"\A\s*version\s+1\s+nodes\b"), Kind("a Source Engine model", _EXPORT)),
    (
        re.compile(rb"\A(?:HEADER|REMARK|CRYST1|MODEL|ATOM|HETATM)\b.*?^(?:ATOM  |HETATM)", re.S | re.M),
        Kind("a molecule", _SURFACE.format("molecules")),
    ),
    (re.compile(rb'"type"\s*:\s*"CityJSON"'), Kind("a CityJSON model", _EXPORT)),
    (re.compile(rb'"geometricError"\s*:'), Kind("a tileset of 3D Tiles", _NAMED)),
    (re.compile(rb"\A[AI]\s+\d+\b.{0,80}?\sOBJ\b", re.S), Kind("an X-Plane model", _EXPORT)),
)
ASCII_GRID = re.compile(rb"\A(?:\xef\xbb\xbf)?\s*(?:[A-Za-z_]+[ \t]+\S+\s+){0,8}?ncols[ \t]+\S", re.I)
GLTF_LIST = re.compile(rb'"(?:accessors|buffers|meshes|nodes|scenes)"\s*:')  # no tileset has one
STATEMENT = re.compile(rb"^[ \t]*(?:v|vn|vt|f)[ \t]+[-+.\d]|^[ \t]*mtllib[ \t]", re.M)
MATERIAL = re.compile(rb"^[ \t]*newmtl[ \t]", re.M)
TABLE = re.compile(
    rb"^[ \t]*+\[\[?[ \t]*+[\w-]++(?:[ \t]*+\.[ \t]*+[\w\"' -]++)*+[ \t]*+\]\]?[ \t]*+(?:#.*)?\r?$", re.M
)
CONTROLS = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")

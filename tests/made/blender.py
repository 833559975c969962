"""A chair as Blender 4 exports it, by the options of pipeline/FROM_BLENDER.md: glTF Binary and OBJ.

In Blender: a seat 0.5 m wide (X) and 0.4 m deep (Y), 0.45 m high (Z), and a back along +Y that reaches 1 m.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np

from paradize.formats.png import encode_png
from tests.made.pictures import photograph

# Lowest and highest corner in Blender: X, Y (away from the front view), Z (up); metres.
BOXES = (((-0.25, -0.2, 0.40), (0.25, 0.2, 0.45)), ((-0.24, 0.15, 0.44), (0.24, 0.19, 1.0)))
MTL = """# Blender 4.2.1 LTS MTL File: 'chair.blend'
# www.blender.org

newmtl Wood
Ka 1.000000 1.000000 1.000000
Ks 0.500000 0.500000 0.500000
Ni 1.500000
d 1.000000
illum 3
Ps 0.000000
Pc 0.000000
Pcr 0.030000
aniso 0.000000
anisor 0.000000
Tf 0.000000 0.000000 0.000000
map_Kd base.png
map_Pr rough.png
map_Pm metal.png
map_Ke glow.png
map_Bump -bm 1.000000 normal.png
"""
PICTURES = {"base": 1, "orm": 2, "normal": 3, "glow": 4}


def corners(blender: tuple[tuple[float, ...], tuple[float, ...]]) -> np.ndarray:
    """Faces of a box, (6, 4, 3), as exported with Y up and -Z forward: (x, y, z) -> (x, z, -y)."""
    low, high = (np.array(corner) for corner in blender)
    faces = []
    for axis in range(3):
        for side in (0, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            quad = np.zeros((4, 3))
            quad[:, axis] = (low, high)[side][axis]
            for k, (a, b) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
                quad[k, u], quad[k, v] = (low, high)[a][u], (low, high)[b][v]
            faces.append(quad if side else quad[::-1])
    quads = np.array(faces)
    return np.stack([quads[..., 0], quads[..., 2], -quads[..., 1]], axis=-1)


def pictures() -> dict[str, bytes]:
    """PNG by name: base colour; occlusion, roughness and metalness in one; normals of waves; emission."""
    slopes = 0.4 * np.sin(np.arange(32) * np.pi / 4)
    x, y = np.meshgrid(slopes, slopes)
    normals = np.stack([x, y, np.ones_like(x)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    made = {name: photograph(32, 32, seed) for name, seed in PICTURES.items()}
    made["normal"] = np.rint(127.5 + 127.5 * normals).astype(np.uint8)
    return {name: encode_png(pixels) for name, pixels in made.items()}


def shape() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, normals and texture coordinates (bottom-left origin) of all faces, (n, 4, k)."""
    quads = np.concatenate([corners(box) for box in BOXES])
    across = np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0])
    normals = np.repeat((across / np.linalg.norm(across, axis=1, keepdims=True))[:, None], 4, axis=1)
    unit = np.array([[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]])
    cells = np.array([[k % 4, k // 4] for k in range(len(quads))])
    return quads, normals, (unit[None] + cells[:, None]) / 4.0


def write_glb(path: Path) -> Path:
    """glTF Binary: pictures inside, one node, names as Blender gives them."""
    quads, normals, uv = shape()
    uv = np.stack([uv[..., 0], 1.0 - uv[..., 1]], axis=-1)
    first = 4 * np.arange(len(quads))[:, None]
    indices = (first + np.array([0, 1, 2, 0, 2, 3])).astype("<u2")
    arrays = [array.reshape(-1, array.shape[-1]).astype("<f4") for array in (quads, normals, uv)]
    parts = [array.tobytes() for array in arrays] + [indices.tobytes(), *pictures().values()]
    data, views = b"", []
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
        data += part + bytes(-len(part) % 4)
    low, high = (arrays[0].min(0).tolist(), arrays[0].max(0).tolist())
    accessors = [
        {"bufferView": k, "componentType": 5126, "count": len(array), "type": f"VEC{array.shape[1]}"}
        for k, array in enumerate(arrays)
    ]
    accessors[0] |= {"min": low, "max": high}
    accessors.append({"bufferView": 3, "componentType": 5123, "count": indices.size, "type": "SCALAR"})
    material = {
        "name": "Wood",
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}},
        "occlusionTexture": {"index": 1},
        "normalTexture": {"index": 2},
        "emissiveTexture": {"index": 3},
        "emissiveFactor": [1, 1, 1],
    }
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}
    tree = {
        "asset": {"generator": "Khronos glTF Blender I/O v4.2.70", "version": "2.0"},
        "scene": 0,
        "scenes": [{"name": "Scene", "nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "Chair"}],
        "materials": [material],
        "meshes": [{"name": "Chair", "primitives": [primitive]}],
        "textures": [{"sampler": 0, "source": k} for k in range(4)],
        "images": [
            {"bufferView": 4 + k, "mimeType": "image/png", "name": name} for k, name in enumerate(PICTURES)
        ],
        "samplers": [{"magFilter": 9729, "minFilter": 9987}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def write_obj(path: Path) -> Path:
    """OBJ with its MTL (PBR Extensions) and its pictures (Path Mode: Copy) beside."""
    quads, normals, uv = shape()
    lines = ["# Blender 4.2.1 LTS", "# www.blender.org", f"mtllib {path.stem}.mtl", "o Chair"]
    lines += ["v {:.6f} {:.6f} {:.6f}".format(*row) for row in quads.reshape(-1, 3)]
    lines += ["vn {:.4f} {:.4f} {:.4f}".format(*row) for row in normals.reshape(-1, 3)]
    lines += ["vt {:.6f} {:.6f}".format(*row) for row in uv.reshape(-1, 2)]
    lines += ["s 0", "usemtl Wood"]
    lines += ["f " + " ".join(f"{k}/{k}/{k}" for k in range(n, n + 4)) for n in range(1, 4 * len(quads), 4)]
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".mtl").write_text(MTL)
    rough, metal = (encode_png(photograph(32, 32, seed)[..., :1].copy()) for seed in (5, 6))
    for name, data in (pictures() | {"rough": rough, "metal": metal}).items():
        (path.parent / f"{name}.png").write_bytes(data)
    return path

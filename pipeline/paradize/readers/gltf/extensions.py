"""The glTF extensions that are read, and the warnings for the rest."""

from __future__ import annotations

from paradize.readers.gltf.document import Document

READ = {
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",  # views.py says what becomes of them
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "MSFT_lod",  # its first level is what the scene shows
}
# Without these the surface is there: a file that requires one is read, and what it loses is said.
LEFT_OUT = {
    "EXT_feature_metadata": "metadata",
    "EXT_instance_features": "metadata",
    "EXT_lights_image_based": "light",
    "EXT_mesh_features": "metadata",
    "EXT_structural_metadata": "metadata",
    "FB_ngon_encoding": "which triangles are one polygon",
    "KHR_animation_pointer": "animations",
    "KHR_audio": "sounds",
    "KHR_materials_anisotropy": "anisotropic highlights",
    "KHR_materials_clearcoat": "clear coats",
    "KHR_materials_diffuse_transmission": "light that shines through",
    "KHR_materials_dispersion": "dispersion",
    "KHR_materials_iridescence": "iridescence",
    "KHR_materials_sheen": "sheen",
    "KHR_materials_variants": "other variants of the materials; the default one is read",
    "KHR_texture_ktx": "KTX2 pictures",
    "KHR_xmp": "metadata",
    "KHR_xmp_json_ld": "metadata",
    "VRM": "an avatar's rig and its shading as a drawing",
    "VRMC_materials_hdr_emissiveMultiplier": "stronger light of its own",
    "VRMC_materials_mtoon": "shading as a drawing",
    "VRMC_node_constraint": "nodes that follow others",
    "VRMC_springBone": "bones that swing",
    "VRMC_springBone_extended_collider": "bones that swing",
    "VRMC_vrm": "an avatar's rig",
    "VRMC_vrm_animation": "an avatar's animation",
}


def check_extensions(document: Document) -> None:
    """Warns of extensions that are not read. Raises SourceError for one that the file requires and without
    which it would not be the same surface."""
    lists = {
        name: document.get(document.tree, "", name, list, [])
        for name in ("extensionsRequired", "extensionsUsed")
    }
    names = {key: [str(name)[:80] for name in values] for key, values in lists.items()}
    for name in names["extensionsRequired"]:
        if name not in READ and name not in LEFT_OUT:
            mend = "export the model without it"
            raise document.fault(
                f"needs the extension {name}, which is not read", "/extensionsRequired", mend
            )
    for name in dict.fromkeys(names["extensionsRequired"] + names["extensionsUsed"]):
        if name not in READ:
            lost = f": {LEFT_OUT[name]}" if name in LEFT_OUT else ""
            document.warn(f"extension {name} is left out{lost}")

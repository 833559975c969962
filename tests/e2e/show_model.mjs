// window.show(path, {size, eye, target, fov_deg, near, far, position, scale, sun, radiance, ambient}): loads
// /models/PATH (glTF, GLB or OBJ with its MTL) and draws it once: a sun (direction towards it, linear RGB), light
// from all sides that stands for a grey sky (linear RGB), no shadows. Posts linear RGBA floats, row 0 lowest.
import {
    Color,
    DirectionalLight,
    FloatType,
    LinearSRGBColorSpace,
    LoadingManager,
    MeshPhysicalMaterial,
    NoToneMapping,
    PerspectiveCamera,
    PMREMGenerator,
    Scene,

    Vector3,
    WebGLRenderTarget,
    WebGLRenderer,
} from "three";
import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { MTLLoader } from "three/addons/loaders/MTLLoader.js";
import { OBJLoader } from "three/addons/loaders/OBJLoader.js";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";

const renderer = new WebGLRenderer();
renderer.toneMapping = NoToneMapping;
renderer.outputColorSpace = LinearSRGBColorSpace;
const draco = new DRACOLoader().setDecoderPath("/three/examples/jsm/libs/draco/gltf/");

// As Blender and Paradize read a Wavefront material: Kd is linear, and a colour map replaces it. Ns becomes a
// roughness as in B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007.
function physical(material) {
    const shine = material.specular ?? new Color(0, 0, 0);
    const used = new MeshPhysicalMaterial({
        name: material.name,
        roughness: Math.pow(2 / ((material.shininess ?? 0) + 2), 0.25),
        metalness: 0.0,
        specularIntensity: Math.max(shine.r, shine.g, shine.b),
    });
    used.color = material.map ? new Color(1, 1, 1) : material.color.clone();
    if (!material.map && used.color) {
        used.color.convertLinearToSRGB(); // MTLLoader takes Kd for sRGB
    }
    used.map = material.map ?? null;
    used.alphaMap = material.alphaMap ?? null;
    used.opacity = material.opacity;
    used.transparent = material.opacity < 1.0;
    used.alphaTest = material.alphaMap ? 0.5 : 0.0;
    used.vertexColors = material.vertexColors;
    return used;
}

async function load(path) {
    const missing = [];
    const manager = new LoadingManager();
    manager.onError = (url) => missing.push(url);
    const loaded = new Promise((done) => (manager.onLoad = done));
    const url = `/models/${path.split("/").map(encodeURIComponent).join("/")}`;
    const folder = url.slice(0, url.lastIndexOf("/") + 1);
    if (!/\.obj$/i.test(path)) {
        const loader = new GLTFLoader(manager).setDRACOLoader(draco).setMeshoptDecoder(MeshoptDecoder);
        return [(await loader.loadAsync(url)).scene, missing];
    }
    const text = await (await fetch(url)).text();
    const library = /^mtllib\s+(.+?)\s*$/m.exec(text);
    const loader = new OBJLoader(manager);
    if (library) {
        const answer = await fetch(folder + encodeURIComponent(library[1]));
        if (answer.ok) {
            const materials = new MTLLoader(manager).setResourcePath(folder).parse(await answer.text(), folder);
            materials.preload();
            loader.setMaterials(materials);
            if (Object.values(materials.materials).some((one) => one.map || one.alphaMap)) {
                await loaded;
            }
        }
    }
    const object = loader.parse(text);
    object.traverse((part) => {
        if (part.isMesh) {
            part.material = Array.isArray(part.material) ? part.material.map(physical) : physical(part.material);
        }
    });
    return [object, missing];
}

function sky(color) {
    const all = new Scene();
    all.background = new Color().setRGB(...color, LinearSRGBColorSpace);
    const made = new PMREMGenerator(renderer);
    const target = made.fromScene(all);
    made.dispose();
    return target;
}

window.show = async (path, { size, eye, target, fov_deg, near, far, position, scale, sun, radiance, ambient }) => {
    const [model, missing] = await load(path);
    const around = sky(ambient);
    const scene = new Scene();
    scene.background = new Color().setRGB(...ambient, LinearSRGBColorSpace);
    scene.environment = around.texture;
    const light = new DirectionalLight(new Color().setRGB(...radiance, LinearSRGBColorSpace), 1.0);
    light.position.set(...sun);
    model.position.set(...position);
    model.scale.setScalar(scale);
    let triangles = 0;
    model.traverse((part) => {
        if (part.isMesh) {
            const { index, attributes } = part.geometry;
            triangles += (index ?? attributes.position).count / 3;
            for (const material of [part.material].flat()) {
                for (const map of [material.map, material.normalMap, material.roughnessMap, material.emissiveMap]) {
                    if (map) {
                        map.anisotropy = renderer.capabilities.getMaxAnisotropy();
                    }
                }
            }
        }
        if (part.isLight) {
            part.intensity = 0; // the scene's own light only
        }
    });
    scene.add(model, light);
    const camera = new PerspectiveCamera(fov_deg, 1.0, near, far);
    camera.position.set(...eye);
    camera.lookAt(new Vector3(...target));
    const picture = new WebGLRenderTarget(size, size, { samples: 4, type: FloatType });
    renderer.setRenderTarget(picture);
    renderer.render(scene, camera);
    const drawn = new Float32Array(4 * size * size);
    renderer.readRenderTargetPixels(picture, 0, 0, size, size, drawn);
    await fetch("/shown", { method: "POST", body: drawn });
    picture.dispose();
    around.dispose();
    return { triangles, missing, error: renderer.getContext().getError() };
};

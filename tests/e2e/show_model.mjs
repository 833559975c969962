// window.show(path, {size, eye, target, fov_deg, near, far, position, scale, sun, radiance, ambient}): loads
// /models/PATH (glTF, GLB or OBJ with its MTL) and draws it once: a sun (direction towards it, linear RGB), light
// from all sides that stands for a grey sky (linear RGB), no shadows. Posts linear RGBA floats, row 0 lowest.
import {
    Color,
    DirectionalLight,
    DoubleSide,
    FloatType,
    FrontSide,
    LinearSRGBColorSpace,
    LoadingManager,
    MeshPhysicalMaterial,
    NoToneMapping,
    PerspectiveCamera,
    RepeatWrapping,
    Scene,
    SRGBColorSpace,
    TextureLoader,
    Vector3,
    WebGLRenderTarget,
    WebGLRenderer,
} from "three";
import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { KTX2Loader } from "three/addons/loaders/KTX2Loader.js";
import { MTLLoader } from "three/addons/loaders/MTLLoader.js";
import { OBJLoader } from "three/addons/loaders/OBJLoader.js";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { sharpen, skyOf } from "./sky.mjs";

const renderer = new WebGLRenderer();
renderer.toneMapping = NoToneMapping;
renderer.outputColorSpace = LinearSRGBColorSpace;
const basis = new KTX2Loader().setTranscoderPath("/three/examples/jsm/libs/basis/").detectSupport(renderer);
const draco = new DRACOLoader().setDecoderPath("/three/examples/jsm/libs/draco/gltf/");

// As pipeline/paradize/readers/mtl reads a Wavefront material: Kd is linear, and a colour map replaces it; Pr, Pm,
// Ke, norm and their maps are those of glTF; Ns and Ks become a roughness and a reflectance seen straight on.
// info: statements of the MTL, of which MTLLoader leaves out the physical ones. picture(file): a texture or null.
// blender: Blender wrote it, with a Ns and a Ks of its own.
function physical(material, info, picture, blender) {
    const used = new MeshPhysicalMaterial({ name: material.name });
    const exponent = info.ns === undefined ? null : Math.max(parseFloat(info.ns), 0);
    const phong = info.pr === undefined;
    if (!phong) {
        used.roughness = parseFloat(info.pr);
    } else if (exponent !== null && blender) {
        used.roughness = 1 - Math.sqrt(Math.min(exponent / 1000, 1));
    } else if (exponent !== null) {
        used.roughness = Math.pow(2 / (exponent + 2), 0.25);
    } else {
        used.roughness = 0.7;
    }
    used.metalness = parseFloat(info.pm ?? 0);
    used.map = picture(info.map_kd);
    if (used.map) {
        used.map.colorSpace = SRGBColorSpace;
    } else if (info.kd) {
        used.color.setRGB(...info.kd, LinearSRGBColorSpace);
    }
    let reflectance = phong && exponent === null ? 0 : 0.04;
    if (["0", "1"].includes(info.illum)) {
        reflectance = 0;
    } else if (info.ks) {
        reflectance = Math.min((info.ks[0] + info.ks[1] + info.ks[2]) / 3, 1);
        if (blender) {
            reflectance *= 0.08;
        } else if (phong) {
            reflectance *= 8 / ((exponent ?? 0) + 8);
            const metal = !used.map && Math.max(...(info.kd ?? [1])) <= 0.04;
            reflectance = metal ? reflectance : Math.min(reflectance, 0.08);
        }
    }
    used.specularIntensity = reflectance > 0 ? 1 : 0;
    used.ior = (1 + Math.sqrt(reflectance)) / (1 - Math.min(Math.sqrt(reflectance), 0.99));
    used.emissiveMap = picture(info.map_ke ?? info.map_emissive);
    if (used.emissiveMap) {
        used.emissiveMap.colorSpace = SRGBColorSpace;
        used.emissive.setRGB(1, 1, 1);
    } else if (info.ke) {
        used.emissive.setRGB(...info.ke, LinearSRGBColorSpace);
    }
    used.normalMap = picture(info.norm);
    for (const [map, factor, file] of [
        ["roughnessMap", "roughness", info.map_pr],
        ["metalnessMap", "metalness", info.map_pm],
    ]) {
        used[map] = picture(file ?? info.map_orm);
        used[factor] = used[map] ? 1 : used[factor];
    }
    used.aoMap = picture(info.map_orm);
    used.alphaMap = picture(info.map_d);
    const clear = parseFloat(info.tr ?? 0) % 1; // 1 is how opaque it is, in files that say it so
    used.opacity = used.alphaMap ? 1 : Math.min(Math.max(parseFloat(info.d ?? 1 - clear), 0), 1);
    used.transparent = used.opacity < 1.0;
    used.alphaTest = used.alphaMap ? 0.5 : 0.0;
    used.side = used.alphaMap ? DoubleSide : FrontSide; // as `new --from` writes scenes
    return used;
}

function within(seconds, promise) {
    const late = (_, fail) => setTimeout(() => fail(new Error(`not loaded in ${seconds} s`)), 1000 * seconds);
    return Promise.race([promise, new Promise(late)]);
}

// Frees a model's vertices and pictures. Its programs stay for the next model: to compile them costs seconds.
function dispose(model) {
    model.traverse((part) => {
        part.geometry?.dispose();
        for (const material of [part.material ?? []].flat()) {
            Object.values(material).forEach((value) => value?.isTexture && value.dispose());
        }
    });
}

// The material files that an OBJ names, of all its mtllib lines, encoded for an URL.
function librariesOf(text) {
    return [...text.matchAll(/^mtllib\s+(.+?)\s*$/gm)].map((line) => encodeURIComponent(line[1]));
}

// The first two numbers behind an option of a map statement.
function pairOf(statement, option, otherwise) {
    const words = statement.split(/\s+/);
    const at = words.indexOf(option);
    return [1, 2].map((k) => (at < 0 ? otherwise : Number(words[at + k])));
}

// Empty where there is no such file.
async function textOf(url) {
    const answer = await fetch(url);
    return answer.ok ? await answer.text() : "";
}

async function load(path) {
    const missing = [];
    const manager = new LoadingManager();
    manager.onError = (url) => missing.push(url);
    const loaded = new Promise((done) => (manager.onLoad = done));
    const url = `/models/${path.split("/").map(encodeURIComponent).join("/")}`;
    const folder = url.slice(0, url.lastIndexOf("/") + 1);
    if (!/\.obj$/i.test(path)) {
        const loader = new GLTFLoader(manager).setDRACOLoader(draco).setKTX2Loader(basis).setMeshoptDecoder(MeshoptDecoder);
        const { scene } = await loader.loadAsync(url);
        if (!scene) {
            throw new Error("three.js shows no file without a scene");
        }
        return [scene, missing];
    }
    const text = await (await fetch(url)).text();
    const statements = (await Promise.all(librariesOf(text).map((name) => textOf(folder + name)))).join("\n");
    const loader = new OBJLoader(manager);
    const pictures = new Map([[undefined, null]]);
    let infos = {};
    let blender = false;
    if (statements) {
        blender = statements.startsWith("# Blender");
        const materials = new MTLLoader(manager).parse(statements, folder);
        infos = materials.materialsInfo;
        const files = Object.values(infos).flatMap((info) =>
            ["map_kd", "map_ke", "map_emissive", "map_pr", "map_pm", "map_orm", "map_d", "norm"].map((key) => info[key]),
        );
        for (const file of new Set(files.filter((one) => one))) {
            const loading = new TextureLoader(manager).loadAsync(folder + file.split(/\s+/).at(-1));
            const texture = await loading.catch(() => null); // the manager says which are missing
            if (texture) {
                texture.wrapS = texture.wrapT = RepeatWrapping;
                texture.repeat.set(...pairOf(file, "-s", 1));
                texture.offset.set(...pairOf(file, "-o", 0));
            }
            pictures.set(file, texture);
        }
        for (const name of Object.keys(infos)) {
            materials.materials[name] = new MeshPhysicalMaterial({ name });
        }
        loader.setMaterials(materials);
    }
    const object = loader.parse(text);
    const used = (one) => physical(one, infos[one.name] ?? {}, (file) => pictures.get(file), blender);
    object.traverse((part) => {
        if (part.isMesh) {
            if (!part.geometry.getAttribute("normal").array.every(Number.isFinite)) {
                part.geometry.computeVertexNormals(); // faces name normals that the file does not hold
            }
            part.material = Array.isArray(part.material) ? part.material.map(used) : used(part.material);
            for (const material of [part.material].flat()) {
                material.vertexColors = part.geometry.hasAttribute("color"); // OBJLoader: only without an MTL
            }
        }
    });
    return [object, missing];
}

window.show = async (path, { size, eye, target, fov_deg, near, far, position, scale, sun, radiance, ambient }) => {
    const [model, missing] = await within(30, load(path));
    const around = skyOf(renderer, ambient);
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
                sharpen(renderer, material);
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
    dispose(model);
    return { triangles, missing, error: renderer.getContext().getError() };
};

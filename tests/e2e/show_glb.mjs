// window.show(name, {width, height, box, color, cutoffs}): loads /files/NAME.glb with GLTFLoader and draws every
// node of it by itself, seen along -Z by an orthographic camera whose window is box = [left, right, bottom, top]
// in metres. Posts two pictures of each, RGBA8, row 0 first: kind=shape, opaque white where there is a
// triangle, and kind=light, lit, with the KTX2 `color` (or null) and each material's alpha cutoff.
import {
    AmbientLight,
    Color,
    DirectionalLight,
    DoubleSide,
    MeshBasicMaterial,
    MeshLambertMaterial,
    OrthographicCamera,
    Scene,
    SRGBColorSpace,
    WebGLRenderTarget,
    WebGLRenderer,
} from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { KTX2Loader } from "three/addons/loaders/KTX2Loader.js";

const renderer = new WebGLRenderer({ alpha: true });
renderer.setClearColor(new Color(0, 0, 0), 0);
const textures = new KTX2Loader().detectSupport(renderer);
const models = new GLTFLoader().setKTX2Loader(textures);

async function post(query, target, width, height) {
    const drawn = new Uint8Array(4 * width * height);
    renderer.readRenderTargetPixels(target, 0, 0, width, height, drawn);
    const turned = new Uint8Array(drawn.length); // WebGL's row 0 is the lowest
    for (let row = 0; row < height; ++row) {
        turned.set(drawn.subarray(4 * width * row, 4 * width * (row + 1)), 4 * width * (height - 1 - row));
    }
    await fetch(`/shown?${query}`, { method: "POST", body: turned });
}

window.show = async (name, { width, height, box, color, cutoffs }) => {
    const gltf = await models.loadAsync(`/files/${name}.glb`);
    const texture = color ? await textures.loadAsync(`/files/${color}.ktx2`) : null;
    const [left, right, bottom, top] = box;
    const reach = 1e3 * Math.max(right - left, top - bottom);
    const camera = new OrthographicCamera(left, right, top, bottom, -reach, reach);
    const target = new WebGLRenderTarget(width, height, { samples: 0, colorSpace: SRGBColorSpace });
    renderer.setRenderTarget(target);
    const levels = [];
    for (let node = 0; node < gltf.parser.json.nodes.length; ++node) {
        const object = await gltf.parser.getDependency("node", node);
        const scene = new Scene();
        const sun = new DirectionalLight(0xffffff, 2.5);
        sun.position.set(0.5, 0.7, 0.6);
        scene.add(object, sun, new AmbientLight(0xbcd4ff, 1.2));
        const found = { name: object.name, triangles: 0, attributes: [] };
        const parts = [];
        object.traverse((part) => {
            if (part.isMesh) {
                parts.push([part, part.material.name]);
                found.triangles += part.geometry.index.count / 3;
                found.attributes = Object.keys(part.geometry.attributes).sort();
            }
        });
        for (const kind of ["shape", "light"]) {
            for (const [part, material] of parts) {
                part.material =
                    kind === "shape"
                        ? new MeshBasicMaterial({ side: DoubleSide })
                        : new MeshLambertMaterial({
                              side: DoubleSide,
                              map: texture,
                              alphaTest: texture ? (cutoffs[material] ?? 0) : 0,
                          });
            }
            renderer.clear();
            renderer.render(scene, camera);
            await post(`name=${name}&level=${node}&kind=${kind}`, target, width, height);
        }
        levels.push(found);
    }
    target.dispose();
    return { levels, error: renderer.getContext().getError() };
};

// window.show(name, {width, height, seconds, sky, hidden}): loads /files/NAME.glb with GLTFLoader and draws it through
// its own camera, animated by its own flight, at each of the seconds. Posts each picture, row 0 first, and returns
// where the camera was: its place and its matrix, column by column. Without `sky` the pictures are sRGB in bytes (RGBA).
// sky: linear RGB of light from all sides, which is the background as well; the pictures are then linear floats.
// hidden: beginnings of the names of nodes that are not drawn.
import {
    AmbientLight,
    AnimationMixer,
    Color,
    FloatType,
    LinearSRGBColorSpace,
    NoToneMapping,
    Scene,
    SRGBColorSpace,
    WebGLRenderTarget,
    WebGLRenderer,
} from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { sharpen, skyOf } from "./sky.mjs";

const renderer = new WebGLRenderer();
renderer.toneMapping = NoToneMapping;
const loader = new GLTFLoader();

window.show = async (name, { width, height, seconds, sky, hidden = [] }) => {
    const gltf = await loader.loadAsync(`/files/${name}.glb`);
    const target = new WebGLRenderTarget(
        width,
        height,
        sky ? { samples: 4, type: FloatType } : { colorSpace: SRGBColorSpace },
    );
    renderer.setRenderTarget(target);
    const scene = new Scene();
    scene.add(gltf.scene);
    if (sky) {
        scene.background = new Color().setRGB(...sky, LinearSRGBColorSpace);
        scene.environment = skyOf(renderer, sky).texture;
    } else {
        scene.add(new AmbientLight(0xbcd4ff, 1.0));
    }
    let triangles = 0;
    gltf.scene.traverse((part) => {
        if (hidden.some((start) => part.name.startsWith(start))) {
            part.visible = false;
        }
        if (part.isMesh) {
            triangles += part.geometry.index.count / 3;
            sharpen(renderer, part.material);
        }
    });
    const camera = gltf.cameras[0];
    const mixer = new AnimationMixer(gltf.scene);
    mixer.clipAction(gltf.animations[0]).play();
    const poses = [];
    for (const second of seconds) {
        mixer.setTime(second);
        scene.updateMatrixWorld(true);
        renderer.render(scene, camera);
        poses.push(camera.matrixWorld.elements.slice());
        const drawn = sky ? new Float32Array(4 * width * height) : new Uint8Array(4 * width * height);
        renderer.readRenderTargetPixels(target, 0, 0, width, height, drawn);
        const turned = drawn.slice(); // WebGL's row 0 is the lowest
        for (let row = 0; row < height; ++row) {
            turned.set(drawn.subarray(4 * width * row, 4 * width * (row + 1)), 4 * width * (height - 1 - row));
        }
        await fetch(`/shown?second=${second}`, { method: "POST", body: turned });
    }
    target.dispose();
    return { poses, triangles, duration_s: gltf.animations[0].duration, error: renderer.getContext().getError() };
};

// window.show(name, {width, height, seconds}): loads /files/NAME.glb with GLTFLoader and draws it through its own
// camera, animated by its own flight, at each of the seconds. Posts each picture, RGBA8, row 0 first, and returns
// where the camera was: its place and its matrix, column by column.
import {
    AmbientLight,
    AnimationMixer,
    SRGBColorSpace,
    WebGLRenderTarget,
    WebGLRenderer,
} from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const renderer = new WebGLRenderer();
const loader = new GLTFLoader();

window.show = async (name, { width, height, seconds }) => {
    const gltf = await loader.loadAsync(`/files/${name}.glb`);
    const target = new WebGLRenderTarget(width, height, { colorSpace: SRGBColorSpace });
    renderer.setRenderTarget(target);
    gltf.scene.add(new AmbientLight(0xbcd4ff, 1.0));
    const camera = gltf.cameras[0];
    const mixer = new AnimationMixer(gltf.scene);
    mixer.clipAction(gltf.animations[0]).play();
    const poses = [];
    for (const second of seconds) {
        mixer.setTime(second);
        gltf.scene.updateMatrixWorld(true);
        renderer.render(gltf.scene, camera);
        poses.push(camera.matrixWorld.elements.slice());
        const drawn = new Uint8Array(4 * width * height);
        renderer.readRenderTargetPixels(target, 0, 0, width, height, drawn);
        const turned = new Uint8Array(drawn.length); // WebGL's row 0 is the lowest
        for (let row = 0; row < height; ++row) {
            turned.set(drawn.subarray(4 * width * row, 4 * width * (row + 1)), 4 * width * (height - 1 - row));
        }
        await fetch(`/shown?second=${second}`, { method: "POST", body: turned });
    }
    let triangles = 0;
    gltf.scene.traverse((part) => {
        triangles += part.isMesh ? part.geometry.index.count / 3 : 0;
    });
    target.dispose();
    return { poses, triangles, duration_s: gltf.animations[0].duration, error: renderer.getContext().getError() };
};

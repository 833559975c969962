// Light from all sides, for the pages beside.
import { Color, LinearSRGBColorSpace, PMREMGenerator, Scene } from "three";

const skies = new Map();

// A sky of one colour (linear RGB) as a render target, whose texture is an environment for materials. Made once.
export function skyOf(renderer, color) {
    if (!skies.has(`${color}`)) {
        const all = new Scene();
        all.background = new Color().setRGB(...color, LinearSRGBColorSpace);
        const generator = new PMREMGenerator(renderer);
        skies.set(`${color}`, generator.fromScene(all));
        generator.dispose();
    }
    return skies.get(`${color}`);
}

// Maps as sharp as the renderer can draw them at a slant.
export function sharpen(renderer, material) {
    for (const map of [material.map, material.normalMap, material.roughnessMap, material.emissiveMap]) {
        if (map) {
            map.anisotropy = renderer.capabilities.getMaxAnisotropy();
        }
    }
}

// window.show(name): loads /files/NAME.ktx2 with KTX2Loader, draws every level of every face, one fragment a
// texel and unfiltered, into a float target, and posts what was drawn: RGBA float32, row 0 first.
// window.offers: the texture extensions that this WebGL has.
import {
    FloatType,
    GLSL3,
    Mesh,
    NearestFilter,
    NearestMipmapNearestFilter,
    OrthographicCamera,
    PlaneGeometry,
    RawShaderMaterial,
    Scene,
    WebGLRenderTarget,
    WebGLRenderer,
} from "three";
import { KTX2Loader } from "three/addons/loaders/KTX2Loader.js";

const renderer = new WebGLRenderer();
const loader = new KTX2Loader().detectSupport(renderer);

const vertexShader = `in vec3 position;
void main() { gl_Position = vec4(2.0 * position.xy, 0.0, 1.0); }`;
const head = `precision highp float;
uniform int level;
out vec4 color;
`;
const flat = `${head}
uniform highp sampler2D texels;
void main() { color = texelFetch(texels, ivec2(gl_FragCoord.xy), level); }`;
// The direction of a texel's centre, by the table of the OpenGL specification, section "Cube Map Texture Selection".
const cube = `${head}
uniform highp samplerCube texels;
uniform int face;
uniform float size;
void main() {
    vec2 st = 2.0 * gl_FragCoord.xy / size - 1.0;
    vec3 toward[6] = vec3[6](
        vec3(1.0, -st.y, -st.x), vec3(-1.0, -st.y, st.x),
        vec3(st.x, 1.0, st.y), vec3(st.x, -1.0, -st.y),
        vec3(st.x, -st.y, 1.0), vec3(-st.x, -st.y, -1.0));
    color = textureLod(texels, toward[face], float(level));
}`;

const camera = new OrthographicCamera();
const quad = new Mesh(new PlaneGeometry(1, 1));
quad.frustumCulled = false;
const scene = new Scene();
scene.add(quad);

window.offers = () => renderer.getContext().getSupportedExtensions();

window.show = async (name) => {
    const texture = await loader.loadAsync(`/files/${name}.ktx2`);
    texture.minFilter = NearestMipmapNearestFilter;
    texture.magFilter = NearestFilter;
    const isCube = texture.isCubeTexture === true;
    const faces = isCube ? 6 : 1;
    const levels = isCube ? texture.image[0].mipmaps : texture.mipmaps;
    const material = new RawShaderMaterial({
        glslVersion: GLSL3,
        vertexShader,
        fragmentShader: isCube ? cube : flat,
        depthTest: false,
        uniforms: { texels: { value: texture }, level: { value: 0 }, face: { value: 0 }, size: { value: 1 } },
    });
    quad.material = material;
    for (let level = 0; level < levels.length; ++level) {
        const { width, height } = levels[level];
        const target = new WebGLRenderTarget(width, height, { type: FloatType, depthBuffer: false });
        renderer.setRenderTarget(target);
        for (let face = 0; face < faces; ++face) {
            Object.assign(material.uniforms.level, { value: level });
            Object.assign(material.uniforms.face, { value: face });
            Object.assign(material.uniforms.size, { value: width });
            renderer.render(scene, camera);
            const drawn = new Float32Array(4 * width * height);
            renderer.readRenderTargetPixels(target, 0, 0, width, height, drawn);
            const query = `name=${name}&level=${level}&face=${face}&width=${width}&height=${height}`;
            await fetch(`/shown?${query}`, { method: "POST", body: drawn });
        }
        target.dispose();
    }
    const error = renderer.getContext().getError();
    material.dispose();
    texture.dispose();
    return { levels: levels.length, faces, error, colorSpace: texture.colorSpace };
};

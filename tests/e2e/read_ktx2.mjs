// node read_ktx2.mjs FILE.ktx2...: what npm ktx-parse reads, as JSON {file: {vkFormat, width, height, faces,
// levels: bytes, digests: SHA-256 of what each holds ...}}; Zstandard is inflated by three.js's decoder.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const modules = process.env.PARADIZE_NODE_MODULES;
const manifest = JSON.parse(readFileSync(`${modules}/ktx-parse/package.json`, "utf8"));
const { read } = await import(pathToFileURL(`${modules}/ktx-parse/${manifest.main}`));

let decoder = null;
async function inflate(data, size) {
    if (decoder === null) {
        const { ZSTDDecoder } = await import(
            pathToFileURL(`${modules}/three/examples/jsm/libs/zstddec.module.js`)
        );
        decoder = new ZSTDDecoder();
        await decoder.init();
    }
    return decoder.decode(data, size);
}

const results = {};
for (const file of process.argv.slice(2)) {
    const container = read(new Uint8Array(readFileSync(file)));
    const levels = [];
    for (const level of container.levels) {
        const packed = container.supercompressionScheme === 2;
        levels.push(packed ? await inflate(level.levelData, level.uncompressedByteLength) : level.levelData);
    }
    results[file] = {
        vkFormat: container.vkFormat,
        typeSize: container.typeSize,
        scheme: container.supercompressionScheme,
        width: container.pixelWidth,
        height: container.pixelHeight,
        faces: container.faceCount,
        levels: levels.map((data) => data.byteLength),
        digests: levels.map((data) => createHash("sha256").update(data).digest("hex")),
        descriptor: container.dataFormatDescriptor[0],
        orientation: container.keyValue.KTXorientation,
    };
}
console.log(JSON.stringify(results));

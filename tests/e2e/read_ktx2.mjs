// node read_ktx2.mjs FILE.ktx2...: what npm ktx-parse reads, as JSON {file: {vkFormat, width, height, faces, levels}}.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const modules = process.env.PARADIZE_NODE_MODULES;
const manifest = JSON.parse(readFileSync(`${modules}/ktx-parse/package.json`, "utf8"));
const { read } = await import(pathToFileURL(`${modules}/ktx-parse/${manifest.main}`));

const results = {};
for (const file of process.argv.slice(2)) {
    const container = read(new Uint8Array(readFileSync(file)));
    results[file] = {
        vkFormat: container.vkFormat,
        width: container.pixelWidth,
        height: container.pixelHeight,
        faces: container.faceCount,
        levels: container.levels.map((level) => level.levelData.byteLength),
    };
}
console.log(JSON.stringify(results));

// node mikktspace.mjs RUNS FILE...: the tangents that npm mikktspace makes of each file, written to FILE.out.
// A file: float32 positions (9 a triangle), normals (9), texture coordinates (6), unindexed, one after the other.
// Printed: JSON {FILE: milliseconds of each of RUNS calls}, taken around the call alone.
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";

const modules = process.env.PARADIZE_NODE_MODULES;
const { generateTangents } = createRequire(import.meta.url)(`${modules}/mikktspace`);

const times = {};
for (const file of process.argv.slice(3)) {
    const bytes = readFileSync(file);
    const values = new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));
    const triangles = values.length / 24;
    const positions = values.slice(0, triangles * 9);
    const normals = values.slice(triangles * 9, triangles * 18);
    const uvs = values.slice(triangles * 18);
    let tangents = null;
    times[file] = [];
    for (let run = 0; run < Number(process.argv[2]); ++run) {
        const start = performance.now();
        tangents = generateTangents(positions, normals, uvs);
        times[file].push(performance.now() - start);
    }
    writeFileSync(`${file}.out`, tangents);
}
console.log(JSON.stringify(times));

// node meshoptimizer.mjs FILE VERTICES WEIGHTS TARGET...: levels of detail by simplifyWithUpdate of npm's meshoptimizer.
// FILE: float32 positions (3 a vertex), float32 attributes (as many a vertex as WEIGHTS, numbers between commas), uint32
// indices. Level K is made of the one before and written to FILE.K: positions, attributes, indices.
// Printed: JSON [milliseconds of the processor of each call], taken around the call alone.
import { readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { MeshoptSimplifier } = await import(pathToFileURL(`${process.env.PARADIZE_NODE_MODULES}/meshoptimizer/index.js`));
await MeshoptSimplifier.ready;

const [file, count, list, ...targets] = process.argv.slice(2);
const vertices = Number(count);
const weights = list.split(",").map(Number);
const bytes = readFileSync(file);
const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
const positions = new Float32Array(data, 0, vertices * 3);
const attributes = new Float32Array(data, vertices * 12, vertices * weights.length);
let indices = new Uint32Array(data, vertices * (12 + 4 * weights.length));
const times = [];
targets.forEach((target, level) => {
    const start = process.cpuUsage();
    const [found] = MeshoptSimplifier.simplifyWithUpdate(
        indices, positions, 3, attributes, weights.length, weights, null, 3 * Number(target), 0.25, ["ErrorAbsolute"],
    );
    const { user, system } = process.cpuUsage(start);
    times.push((user + system) / 1e3);
    indices = indices.slice(0, found);
    writeFileSync(`${file}.${level}`, Buffer.concat([positions, attributes, indices].map((part) =>
        Buffer.from(part.buffer, part.byteOffset, part.byteLength))));
});
console.log(JSON.stringify(times));

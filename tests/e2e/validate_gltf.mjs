// node validate_gltf.mjs FILE.glb...: what the Khronos glTF-Validator says, as JSON {file: {errors, warnings, messages}}.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

const require = createRequire(`${process.env.PARADIZE_NODE_MODULES}/`);
const validator = require("gltf-validator");

const results = {};
for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(readFileSync(file)));
    const { numErrors: errors, numWarnings: warnings, messages } = report.issues;
    results[file] = { errors, warnings, messages: messages.slice(0, 20) };
}
console.log(JSON.stringify(results));

// Prints the licence text of every package that a bundle holds: node licenses.mjs FOLDER (with meta.json and node_modules).
import { existsSync, readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";

const folder = process.argv[2];
const { outputs } = JSON.parse(readFileSync(join(folder, "meta.json"), "utf8"));
const packages = new Set();
for (const { inputs } of Object.values(outputs)) {
  for (const [file, { bytesInOutput }] of Object.entries(inputs)) {
    const name = file.match(/.*node_modules\/((?:@[^/]+\/)?[^/]+)/);
    if (name && bytesInOutput > 0) packages.add(name[0]);
  }
}
for (const path of [...packages].sort()) {
  const { name, version, license } = JSON.parse(readFileSync(join(folder, path, "package.json"), "utf8"));
  const file = readdirSync(join(folder, path)).find((entry) => /^licen[cs]e/i.test(entry));
  const text = file && existsSync(join(folder, path, file)) ? readFileSync(join(folder, path, file), "utf8").trim() : `Licence: ${license}`;
  console.log(`${name} ${version} (${license})\n\n${text}\n\n${"-".repeat(78)}\n`);
}

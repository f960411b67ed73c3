// Runs blobs in Node and prints, for each, the SHA-256 of its waveforms and periods, the rows, and
// the processor time: node web/run.mjs reluctance.wasm SECONDS BLOB...
import { createHash } from "node:crypto";
import { readFile } from "node:fs/promises";
import { load } from "./reluctance.js";

const [module, seconds, ...blobs] = process.argv.slice(2);
const core = await load(readFile(module));
for (const file of blobs) {
  const unit = core.create(await readFile(file)), hash = createHash("sha256");
  unit.start();
  const start = process.cpuUsage();
  let rows = 0;
  for (let there = false; !there;) {
    there = unit.advance(Number(seconds));
    for (const table of ["waveform", "period"]) {
      const taken = unit.take(table);
      rows += taken.length / unit.names(table).length;
      hash.update(new Uint8Array(taken.buffer, taken.byteOffset, taken.byteLength));
    }
  }
  const used = process.cpuUsage(start);
  unit.free();
  console.log(hash.digest("hex"), rows, ((used.user + used.system) * 1e-6).toFixed(4));
}

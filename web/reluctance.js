// The C interface (include/srm/c_api/reluctance.h) over WebAssembly, for pages, workers and Node.
//
//   const core = await load(fetch("reluctance.wasm"));
//   const unit = core.create(blob);          // Uint8Array of `reluctance export blob`
//   unit.set("parameter", "control.law.i_band", 0.5);
//   unit.start();
//   unit.advance(0.02);                      // true: there; false: take rows, and call again
//   unit.get("waveform", "tau");
//   unit.free();

export const PARTS = { drive: 0, stage: 1, controller: 2 };
export const TABLES = {
  parameter: 0, input: 1, waveform: 2, period: 3, last_period: 4, measurement: 5, order: 6, leg: 7,
  states: 8,
};
const MORE = 1;

/** The core from the bytes of its module, or from a response or promise of one. */
export async function load(source) {
  let bytes = await source;
  if (typeof Response !== "undefined" && bytes instanceof Response) bytes = await bytes.arrayBuffer();
  // What the C++ library imports is called only when it ends the program.
  const stop = new Proxy({}, { get: (_, name) => () => { throw new Error(`core: ${String(name)}`); } });
  const module = await WebAssembly.compile(bytes);
  const imports = Object.fromEntries(WebAssembly.Module.imports(module).map(i => [i.module, stop]));
  const { exports } = await WebAssembly.instantiate(module, imports);
  exports._initialize();
  return new Core(exports);
}

/** A module of the core; units are made from blobs. */
export class Core {
  constructor(exports) {
    this.exports = exports;
    this.scratch = exports.malloc(16); // results of single values
    this.encoder = new TextEncoder();
    this.decoder = new TextDecoder();
  }

  create(blob, part = "drive") {
    const at = this.copied(blob);
    try {
      this.check(this.exports.srm_create(at, blob.length, PARTS[part], this.scratch));
    } finally {
      this.exports.free(at);
    }
    return new Unit(this, this.view().getUint32(this.scratch, true));
  }

  /** The memory grows, and is another object then: views are made anew. */
  view() { return new DataView(this.exports.memory.buffer); }
  doubles(at, count) { return new Float64Array(this.exports.memory.buffer, at, count); }

  copied(bytes) {
    const at = this.exports.malloc(Math.max(bytes.length, 1));
    if (at === 0) throw new Error("core: out of memory");
    new Uint8Array(this.exports.memory.buffer, at, bytes.length).set(bytes);
    return at;
  }

  text(at) {
    const bytes = new Uint8Array(this.exports.memory.buffer, at);
    return this.decoder.decode(bytes.slice(0, bytes.indexOf(0)));
  }

  /** A state of a drive in a word, and the status of its fault in words. */
  modeText(mode) { return this.text(this.exports.srm_mode_text(mode)); }
  faultText(status) { return this.text(this.exports.srm_fault_text(status)); }

  /** Throws what went wrong in words. */
  check(status) {
    if (status < 0) throw new Error(this.text(this.exports.srm_last_error()));
    return status;
  }
}

/** A drive, a power stage or a controller. */
export class Unit {
  constructor(core, handle) {
    this.core = core;
    this.handle = handle;
    this.known = {}; // names of a table to indices
    this.buffer = 0;
    this.room = 0; // doubles in the buffer
  }

  free() {
    this.core.exports.free(this.buffer);
    this.core.check(this.core.exports.srm_free(this.handle));
  }

  start() { this.core.check(this.core.exports.srm_start(this.handle)); }
  reset() { this.core.check(this.core.exports.srm_reset(this.handle)); }
  sample() { this.core.check(this.core.exports.srm_sample(this.handle)); }

  /** The names of a table, in the order of its values. */
  names(table) { return [...this.indices(table).keys()]; }

  get(table, name) { return this.read(table)[this.index(table, name)]; }

  set(table, name, value) {
    const { core } = this;
    core.check(core.exports.srm_set(this.handle, TABLES[table], this.index(table, name), value));
  }

  /** All values of a table. */
  read(table) {
    const { core } = this, count = this.indices(table).size;
    const at = this.space(count);
    core.check(core.exports.srm_read(this.handle, TABLES[table], at, count));
    return core.doubles(at, count).slice();
  }

  write(table, values) {
    const { core } = this, at = this.space(values.length);
    core.doubles(at, values.length).set(values);
    core.check(core.exports.srm_write(this.handle, TABLES[table], at, values.length));
  }

  /** Runs to time t [s]. False: rows wait, or many steps were taken; call again. */
  advance(t) {
    const { core } = this;
    return core.check(core.exports.srm_advance(this.handle, t, core.scratch)) !== MORE;
  }

  /** The time that the last `advance` reached [s]. */
  get reached() { return this.core.view().getFloat64(this.core.scratch, true); }

  /** Recorded rows, one after the other: a view that lasts until the next call. */
  take(table) {
    const { core } = this, columns = this.indices(table).size;
    const capacity = table === "waveform" ? 20000 : 1000;
    const at = this.space(columns * capacity);
    core.check(core.exports.srm_take(this.handle, TABLES[table], at, capacity, core.scratch + 8));
    return core.doubles(at, columns * core.view().getUint32(core.scratch + 8, true));
  }

  /** The state as bytes, for `restore`. */
  save() {
    const { core } = this;
    core.check(core.exports.srm_state_size(this.handle, core.scratch + 8));
    const size = core.view().getUint32(core.scratch + 8, true);
    const at = this.space(Math.ceil(size / 8));
    core.check(core.exports.srm_save(this.handle, at, size));
    return new Uint8Array(core.exports.memory.buffer, at, size).slice();
  }

  restore(bytes) {
    const { core } = this, at = core.copied(bytes);
    try {
      core.check(core.exports.srm_restore(this.handle, at, bytes.length));
    } finally {
      core.exports.free(at);
    }
  }

  index(table, name) {
    const found = this.indices(table).get(name);
    if (found === undefined) throw new Error(`core: no ${table} has the name ${name}`);
    return found;
  }

  indices(table) {
    if (this.known[table]) return this.known[table];
    const { core } = this, found = new Map();
    core.check(core.exports.srm_count(this.handle, TABLES[table], core.scratch));
    const count = core.view().getInt32(core.scratch, true);
    for (let j = 0; j < count; ++j) {
      core.check(core.exports.srm_name(this.handle, TABLES[table], j, core.scratch));
      found.set(core.text(core.view().getUint32(core.scratch, true)), j);
    }
    return this.known[table] = found;
  }

  /** Room for so many doubles. */
  space(count) {
    if (count > this.room) {
      this.core.exports.free(this.buffer);
      this.buffer = this.core.exports.malloc(8 * count);
      if (this.buffer === 0) throw new Error("core: out of memory");
      this.room = count;
    }
    return this.buffer;
  }
}

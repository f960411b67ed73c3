// The core in a worker: runs a drive, keeps its waveforms, and answers with what a picture needs.
import { blocks, envelope, lower } from "./envelope.js";
import { figures, phases } from "./figures.js";
import { load } from "./reluctance.js";

const DRAWN = /^(tau|tau_ref|i_\d|i_ref_\d|leg_\d)$/; // over time
const ready = load(fetch("reluctance.wasm"));
const blobs = new Map();
let newest = 0; // the run that was asked for last
let run = null; // the waveforms that are there

const answers = { run: simulate, window: seen, at: instant, event, loop };

self.onmessage = async ({ data }) => {
  if (data.type === "run") newest = data.id;
  try {
    const answer = await answers[data.type](data);
    self.postMessage({ type: data.type, id: data.id, ...(answer ?? { none: true }) });
  } catch (fault) {
    self.postMessage({ type: "fault", id: data.id, text: String(fault.message ?? fault) });
  }
};

/** Runs a drive with some of its parameters changed; a newer run ends it. */
async function simulate({ id, drive, sets, until }) {
  const core = await ready;
  if (!blobs.has(drive.name)) {
    const answer = await fetch(`data/${drive.name}.srm`);
    if (!answer.ok) throw new Error(`data/${drive.name}.srm: ${answer.status}`);
    blobs.set(drive.name, new Uint8Array(await answer.arrayBuffer()));
  }
  const unit = core.create(blobs.get(drive.name));
  try {
    for (const [name, value] of sets) unit.set("parameter", name, value);
    unit.start();
    const names = unit.names("waveform"), period = unit.names("period");
    const parts = [], rows = [], states = [];
    const started = performance.now();
    let paused = started;
    for (let there = false; !there;) {
      there = unit.advance(until);
      parts.push(unit.take("waveform").slice());
      if (drive.supervised) states.push(...entered(unit, core));
      const ends = unit.take("period");
      for (let j = 0; j < ends.length; j += period.length) {
        rows.push(Array.from(ends.subarray(j, j + period.length)));
      }
      if (performance.now() - paused > 30) {
        await new Promise(resolve => setTimeout(resolve)); // a newer run may have been asked for
        if (id !== newest) return null;
        paused = performance.now();
      }
    }
    parts.push(unit.read("waveform"));
    rows.push(Array.from(unit.read("period")));
    run = { drive, names, until, ...columns(parts, names) };
    return {
      until,
      points: run.t.length,
      wall: (performance.now() - started) * 1e-3,
      figures: figures(rows, period, drive),
      period: pitch(rows, period, drive.N_r),
      states,
    };
  } finally {
    unit.free();
  }
}

/** The states that a drive has entered, with their faults in words. */
function entered(unit, core) {
  const names = unit.names("states"), rows = unit.take("states"), found = [];
  for (let j = 0; j < rows.length; j += names.length) {
    const state = Object.fromEntries(names.map((name, c) => [name, rows[j + c]]));
    found.push({ ...state, mode: core.modeText(state.mode), text: core.faultText(state.status) });
  }
  return found;
}

/** The waveforms column by column. */
function columns(parts, names) {
  const width = names.length, count = parts.reduce((n, part) => n + part.length, 0) / width;
  const values = names.map(name => name === "t" ? new Float64Array(count) : new Float32Array(count));
  let row = 0;
  for (const part of parts) {
    for (let j = 0; j < part.length; j += width, ++row) {
      for (let c = 0; c < width; ++c) values[c][row] = part[j + c];
    }
  }
  const of = Object.fromEntries(names.map((name, c) => [name, values[c]]));
  const known = {};
  for (const name of names) if (DRAWN.test(name)) known[name] = blocks(of[name]);
  return { t: of.t, of, known };
}

/** Length of the last electrical period [s]; 0 without one. */
function pitch(rows, names, N_r) {
  const t = names.indexOf("t"), angle = names.indexOf("theta_m");
  const speed = (rows.at(-1)[angle] - rows[0][angle]) / (rows.at(-1)[t] - rows[0][t]);
  return Math.abs(speed) > 1e-6 ? 2 * Math.PI / (N_r * Math.abs(speed)) : 0;
}

/** Envelopes of the waveforms in a window of time. */
function seen({ from, to, columns: width }) {
  if (!run) return null;
  const series = {}, start = performance.now();
  for (const name of run.names) {
    if (!DRAWN.test(name)) continue;
    const held = /^(leg|i_ref|tau_ref)/.test(name);
    series[name] = envelope(run.t, run.of[name], run.known[name], from, to, width, held);
  }
  return { from, to, series, took: performance.now() - start };
}

/** All values at an instant. */
function instant({ t }) {
  if (!run) return null;
  const j = Math.max(0, Math.min(lower(run.t, t + 1e-12) - 1, run.t.length - 1));
  const n = Math.min(j + 1, run.t.length - 1);
  const part = run.t[n] > run.t[j] ? Math.max(0, Math.min(1, (t - run.t[j]) / (run.t[n] - run.t[j]))) : 0;
  const values = {};
  for (const name of run.names) {
    const of = run.of[name], held = /^(leg|i_ref|tau_ref|u_\d)/.test(name);
    values[name] = held ? of[j] : of[j] + part * (of[n] - of[j]);
  }
  return { t, values };
}

/** The next switching event after an instant, or the one before it. */
function event({ t, forward }) {
  if (!run) return null;
  const legs = phases("leg", run.names).map(name => run.of[name]);
  const step = forward ? 1 : -1;
  const moment = 1e-9;
  for (let j = lower(run.t, t); j > 0 && j < run.t.length; j += step) {
    const apart = forward ? run.t[j] - t : t - run.t[j];
    if (apart > moment && legs.some(leg => leg[j] !== leg[j - 1])) return { t: run.t[j] };
    if (j === 1 && !forward) break;
  }
  return { t };
}

/** Flux linkage over current of phase a in the last electrical period. */
function loop({ period }) {
  if (!run) return null;
  const start = period > 0 ? lower(run.t, run.until - period) : 0;
  return { i: run.of.i_0.slice(start), psi: run.of.psi_0.slice(start) };
}

// The page: what was chosen goes to the core in the worker; its answers become pictures and figures.
import { columnsOf, LEFT, RIGHT } from "./chart.js";
import { drawCurrents, drawCursor, drawLegs, drawLoop, drawTorque } from "./charts.js";
import { Core } from "./core.js";
import { fromToml, toToml } from "./drivefile.js";
import { LESSONS } from "./lessons.js";
import { drawMachine } from "./machine.js";
import { chosen, fromLink, lookFromLink, moved, nearest, settings, toLink } from "./model.js";
import { options, showFigures, showStates, sliders } from "./panel.js";

const $ = id => document.getElementById(id);
const core = new Core(text => tell(text, true));
let drives, drive, model, lesson = 0;
let ran = null; // answer of the last run
let view = null; // window of time { from, to }
let seen = null; // envelopes of the window
let loop = null, here = null; // energy loop; values at the cursor
let t = 0, playing = false, last = 0, asking = false, remembering = 0;

function tell(text, fault = false) {
  $("status").textContent = text;
  $("status").classList.toggle("fault", fault);
}

// ---- what was chosen

/** look: what to see of the run, as a link has it. */
function choose(next, look = null) {
  model = next;
  drive = drives.find(d => d.name === model.drive);
  const machines = [...new Set(drives.map(d => d.machine))];
  options($("machine"), machines.map(m => [m, m]), drive.machine);
  const own = drives.filter(d => d.machine === drive.machine);
  options($("law"), own.map(d => [d.name, d.title]), drive.name);
  if (![...$("until").options].some(o => Number(o.value) === model.until)) {
    $("until").append(new Option(`${model.until} s`, model.until));
  }
  $("until").value = String(model.until);
  sliders($("sliders"), drive, model, (key, j) => {
    model.at[key] = j;
    simulate(true);
  });
  if (look) play(false);
  return simulate(false, look);
}

/** Puts what is chosen, and what is seen of it, into the address. */
function remember(look = true) {
  clearTimeout(remembering);
  remembering = 0;
  const seen = look && view ? { ...view, t, slow: $("slow").value, playing } : null;
  history.replaceState(null, "", `#${toLink(drive, model, seen)}`);
}

/** The same soon: a browser refuses an address a frame. */
function rememberSoon() {
  if (!remembering) remembering = setTimeout(remember, 250);
}

async function simulate(keepView, look = null) {
  remember(false);
  const off = moved(drive, model).filter(c => c.off_design);
  $("design").hidden = !off.length;
  $("design").textContent = off.length
    ? `The law keeps what was computed for ${off.map(c => `${c.given} ${c.unit}`).join(", ")}; `
      + "`reluctance run` computes it anew for the drive file."
    : "";
  const asked = drive;
  const answer = await core.ask("run", { drive: bare(drive), sets: settings(drive, model), until: model.until });
  if (!answer) return;
  ran = answer;
  showFigures($("figures"), ran.figures, limit());
  showStates($("states"), ran.states, to);
  const span = ran.states.length ? ran.until : ran.period > 0 ? Math.min(2 * ran.period, ran.until) : Math.min(0.02, ran.until);
  if (!keepView || !view || view.to > ran.until || view.drive !== asked.name) {
    view = { from: ran.until - span, to: ran.until, drive: asked.name };
    t = view.from + 0.25 * span;
  }
  if (look) {
    view = { ...view, from: look.from, to: Math.min(look.to, ran.until) };
    t = look.t;
    if ([...$("slow").options].some(o => o.value === look.slow)) $("slow").value = look.slow;
    play(look.playing);
  }
  loop = await core.ask("loop", { period: ran.period });
  await refresh();
  await point();
  remember();
  tell(`${ran.points.toLocaleString("en")} points of ${ran.until} s in ${ran.wall.toFixed(2)} s; `
    + `key figures over ${ran.figures.periods} electrical periods`
    + (ran.figures.beyond_map > 0 ? "; the peak current lies beyond the flux map" : ""));
  document.body.dataset.ran = String(Number(document.body.dataset.ran ?? 0) + 1);
}

/** What the worker needs of a drive. */
function bare({ name, N_r, n_phases, R, i_known, follows_torque, supervised }) {
  return { name, N_r, n_phases, R, i_known, follows_torque, supervised };
}

/** The limit of the operating point; null where another one was chosen. */
function limit() {
  const point = ["load.speed_rpm", "reference.tau_Nm", "converter.u_dc_V"];
  const elsewhere = moved(drive, model).some(c => point.includes(c.key));
  const known = drive.limit;
  $("limit-note").textContent = !known ? "No torque reference, so no limit to compare with."
    : `Limit under any controller at ${known.speed_rpm} rpm, ${known.tau_ref_Nm} N m, ${known.u_dc_V} V`
      + (elsewhere ? ": not shown, since the operating point was changed (`reluctance limit` computes it)." : ".");
  return known && !elsewhere ? known : null;
}

/** What the address of the page says. */
function fromAddress() {
  const text = location.hash.slice(1), next = fromLink(text, drives);
  return choose(next, lookFromLink(text, next.until));
}

// ---- pictures

async function refresh() {
  if (!ran) return null;
  const answer = await core.ask("window", { ...view, columns: columnsOf($("torque")) });
  if (!answer) return null;
  seen = answer;
  const start = performance.now();
  drawTorque($("torque"), seen, drive.follows_torque);
  const references = drive.n_phases && ["torque_sharing", "pwm_current"].includes(drive.law);
  drawCurrents($("currents"), seen, drive.n_phases, references);
  drawLegs($("legs"), seen, drive.n_phases);
  document.body.dataset.window = `${view.from} ${view.to}`;
  rememberSoon();
  drawCursor($("cursor"), t, seen, ran.states);
  return { worker: seen.took, draw: performance.now() - start };
}

async function point() {
  const answer = await core.ask("at", { t });
  if (!answer || !seen || !loop) return;
  here = { ...answer.values, most: Math.max(ran.figures.i_peak, 1e-6) };
  if (!playing) rememberSoon();
  drawCursor($("cursor"), t, seen, ran.states);
  drawMachine($("section"), drive, here);
  drawLoop($("loop"), loop, drive.curves, here);
  const currents = Array.from({ length: drive.n_phases }, (_, k) => `${"abcd"[k]} ${here[`i_${k}`].toFixed(1)} A`);
  const legs = Array.from({ length: drive.n_phases }, (_, k) => ({ 1: "+", 0: "0", "-1": "−" })[here[`leg_${k}`]]);
  const angle = ((here.theta_m * drive.N_r * 180 / Math.PI) % 360 + 360) % 360;
  const state = ran.states.findLast(s => s.t <= t);
  $("reading").textContent = `${(t * 1e3).toFixed(4)} ms · ${angle.toFixed(1)}° el. · ${here.tau.toFixed(2)} N m · `
    + `${currents.join(", ")} · legs ${legs.join(" ")}`
    + (state ? ` · ${state.mode}${state.status ? `: ${state.text}` : ""}` : "");
}

/** Another window of time, kept within the run. */
function look(from, to) {
  const width = Math.min(Math.max(to - from, 2e-6), ran.until);
  const start = Math.min(Math.max(from, 0), ran.until - width);
  view = { ...view, from: start, to: start + width };
  return refresh();
}

function zoom(factor, around = t) {
  const centre = around < view.from || around > view.to ? (view.from + view.to) / 2 : around;
  return look(centre - (centre - view.from) * factor, centre + (view.to - centre) * factor);
}

const pan = part => look(view.from + part * (view.to - view.from), view.to + part * (view.to - view.from));

// ---- time

function play(on) {
  playing = on;
  $("play").textContent = on ? "Pause" : "Play";
  $("play").setAttribute("aria-pressed", String(on));
  if (ran) rememberSoon();
  if (on) { last = performance.now(); requestAnimationFrame(step); }
}

async function step(now) {
  if (!playing) return;
  const passed = Math.min(now - last, 100) * 1e-3;
  last = now;
  if (seen && !asking) {
    t += passed / Number($("slow").value);
    if (t > view.to || t < view.from) t = view.from + (t - view.from) % (view.to - view.from);
    if (t < view.from) t = view.from;
    asking = true;
    point().finally(() => { asking = false; });
  }
  requestAnimationFrame(step);
}

async function toEvent(forward) {
  if (!ran) return;
  play(false);
  const answer = await core.ask("event", { t, forward });
  if (answer) await to(answer.t);
}

async function to(instant) {
  t = instant;
  const width = view.to - view.from;
  if (t < view.from || t > view.to) await look(t - width / 2, t + width / 2);
  await point();
}

// ---- lessons, files, links

function teach(j) {
  lesson = Math.min(Math.max(j, 0), LESSONS.length - 1);
  const { title, text, look: see, drive: name, at } = LESSONS[lesson];
  $("lesson-title").textContent = `Lesson ${lesson + 1} of ${LESSONS.length}: ${title}`;
  $("lesson-text").textContent = text.replace(/\s+/g, " ");
  $("lesson-look").textContent = see;
  $("lesson-back").disabled = lesson === 0;
  $("lesson-next").disabled = lesson === LESSONS.length - 1;
  const start = chosen(drives.find(d => d.name === name));
  for (const control of drives.find(d => d.name === name).controls) {
    if (control.key in at) start.at[control.key] = nearest(control, at[control.key]);
  }
  return start;
}

async function copied(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    tell(`${what} is in the clipboard`);
  } catch {
    tell(`the browser gives no clipboard; ${what}: ${text}`);
  }
}

function connect() {
  window.studio = { look }; // for tests of the frame rate
  $("machine").onchange = () => choose(chosen(drives.find(d => d.machine === $("machine").value)));
  $("law").onchange = () => choose(chosen(drives.find(d => d.name === $("law").value)));
  $("until").onchange = () => { model.until = Number($("until").value); simulate(false); };
  $("reset").onclick = () => choose(chosen(drive));
  $("link").onclick = () => { remember(); copied(location.href, "the link"); };
  $("slow").onchange = rememberSoon;
  $("copy").onclick = () => copied(toToml(drive, model), "the drive file");
  $("load").onclick = () => $("file").click();
  $("file").onchange = async () => {
    const [file] = $("file").files;
    if (!file) return;
    try {
      const { model: next, note } = fromToml(await file.text(), drives);
      await choose(next);
      tell(`${file.name}: ${note}`);
    } catch (fault) {
      tell(`${file.name}: ${fault.message}`, true);
    }
    $("file").value = "";
  };
  $("lesson-back").onclick = () => choose(teach(lesson - 1));
  $("lesson-next").onclick = () => choose(teach(lesson + 1));
  $("play").onclick = () => play(!playing);
  $("event-back").onclick = () => toEvent(false);
  $("event-next").onclick = () => toEvent(true);
  $("zoom-in").onclick = () => zoom(0.5);
  $("zoom-out").onclick = () => zoom(2);
  $("pan-back").onclick = () => pan(-0.25);
  $("pan-next").onclick = () => pan(0.25);
  $("whole").onclick = () => look(0, ran.until);
  $("controls").onsubmit = event => event.preventDefault();
  const keys = {
    " ": () => play(!playing), ArrowLeft: () => toEvent(false), ArrowRight: () => toEvent(true),
    "+": () => zoom(0.5), "=": () => zoom(0.5), "-": () => zoom(2),
    PageUp: () => pan(-0.25), PageDown: () => pan(0.25), Home: () => look(0, ran.until),
  };
  $("plots").onkeydown = event => {
    if (!ran || !keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  };
  const timeAt = event => {
    const box = $("torque").getBoundingClientRect();
    const part = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
    return view.from + Math.min(Math.max(part, 0), 1) * (view.to - view.from);
  };
  const follow = event => { if (view && event.buttons === 1) { t = timeAt(event); point(); } };
  $("plots").onpointerdown = follow;
  $("plots").onpointermove = follow;
  $("plots").onwheel = event => {
    if (!ran || !event.ctrlKey) return; // the wheel alone scrolls the page
    event.preventDefault();
    zoom(event.deltaY > 0 ? 1.25 : 0.8, timeAt(event));
  };
  const redraw = async () => { await refresh(); await point(); };
  addEventListener("resize", redraw);
  addEventListener("hashchange", fromAddress);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
}

try {
  const answer = await fetch("data/drives.json");
  if (!answer.ok) throw new Error(`data/drives.json: ${answer.status}`);
  drives = await answer.json();
  connect();
  const first = teach(0);
  if (location.hash.length > 1) await fromAddress(); else await choose(first);
} catch (fault) {
  tell(String(fault.message ?? fault), true);
}

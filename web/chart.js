// One chart on a canvas: envelopes of waveforms over time, axes with round numbers, a cursor above.

export const LEFT = 52, RIGHT = 10, TOP = 8, BOTTOM = 22; // of the frame [px]

let colours = null;
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { colours = null; });

/** Colours of the page as they are now, light or dark. */
export function theme() { return colours ??= read(); }

function read() {
  const style = getComputedStyle(document.documentElement);
  const of = name => style.getPropertyValue(`--${name}`).trim();
  return {
    text: of("soft"), grid: of("grid"), accent: of("accent"), ink: of("ink"), panel: of("panel"),
    phases: ["a", "b", "c", "d"].map(k => of(`phase-${k}`)),
  };
}

/** A canvas in device pixels; drawing goes on in CSS pixels. */
export function prepared(canvas) {
  const ratio = window.devicePixelRatio || 1, { clientWidth: w, clientHeight: h } = canvas;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, w, h);
  g.font = "11px system-ui, sans-serif";
  return { g, w, h };
}

/** Round numbers over a span, about so many. */
export function ticks(low, high, about) {
  const raw = (high - low) / about, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].find(x => x * power >= raw) * power;
  const found = [];
  for (let j = Math.ceil(low / step - 1e-9); j * step <= high + 1e-9 * step; ++j) found.push(j * step);
  return { found, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

/** Least and greatest value over envelopes, with a margin. */
export function span(envelopes, floor = Infinity) {
  let low = floor === Infinity ? Infinity : floor, high = -Infinity;
  for (const one of envelopes) for (const v of one) { if (v < low) low = v; if (v > high) high = v; }
  if (!(high > low)) { low -= 1; high = low + 2; }
  const margin = 0.06 * (high - low);
  return [low === floor ? low : low - margin, high + margin];
}

/** Frame, grid and numbers; returns where time and value lie. */
export function frame({ g, w, h }, colours, [from, to], [low, high], valueTicks = true) {
  const x = t => LEFT + (t - from) / (to - from) * (w - LEFT - RIGHT);
  const y = v => h - BOTTOM - (v - low) / (high - low) * (h - TOP - BOTTOM);
  g.strokeStyle = colours.grid;
  g.fillStyle = colours.text;
  g.lineWidth = 1;
  g.beginPath();
  const across = ticks(from * 1e3, to * 1e3, Math.max(3, (w - LEFT) / 110));
  g.textAlign = "center";
  for (const ms of across.found) {
    const at = Math.round(x(ms * 1e-3)) + 0.5;
    g.moveTo(at, TOP);
    g.lineTo(at, h - BOTTOM);
    g.fillText(ms.toFixed(across.digits), Math.min(at, w - 16), h - 7);
  }
  g.textAlign = "left";
  g.fillText("ms", 2, h - 7);
  if (valueTicks) {
    const up = ticks(low, high, Math.max(2, h / 45));
    g.textAlign = "right";
    for (const v of up.found) {
      const at = Math.round(y(v)) + 0.5;
      g.moveTo(LEFT, at);
      g.lineTo(w - RIGHT, at);
      g.fillText(v.toFixed(up.digits), LEFT - 6, at + 4);
    }
  }
  g.stroke();
  return { x, y };
}

/** An envelope, at least a line's width high; dashed by leaving columns out. A dense one is drawn
 * column by column on whole pixels: the outline of many peaks takes the browser several frames. */
export function trace(g, one, y, colour, { dashed = false, width = 1.5 } = {}) {
  g.fillStyle = colour;
  const columns = one.length / 2, half = width / 2;
  if (!dashed && isDense(one, y)) {
    for (let c = 0; c < columns; ++c) {
      const top = Math.round(y(one[2 * c + 1]) - half), bottom = Math.round(y(one[2 * c]) + half);
      g.fillRect(LEFT + c, top, 1, bottom - top);
    }
    return;
  }
  g.beginPath();
  const area = (start, end) => {
    for (let c = start; c < end; ++c) g.lineTo(LEFT + c + 0.5, y(one[2 * c + 1]) - half);
    for (let c = end - 1; c >= start; --c) g.lineTo(LEFT + c + 0.5, y(one[2 * c]) + half);
    g.closePath();
  };
  if (!dashed) area(0, columns);
  for (let c = 0; dashed && c < columns; c += 7) {
    g.moveTo(LEFT + c + 0.5, y(one[2 * c + 1]) - half);
    area(c, Math.min(c + 4, columns));
  }
  g.fill();
}

/** True where an envelope is higher than a line in most of its columns. */
function isDense(one, y) {
  let tall = 0;
  for (let c = 0; c < one.length; c += 2) if (y(one[c]) - y(one[c + 1]) > 3) ++tall;
  return tall > one.length / 4;
}

/** Pixel columns of a canvas's frame. */
export function columnsOf(canvas) {
  return Math.max(50, Math.floor(canvas.clientWidth - LEFT - RIGHT));
}

// The three charts over time: torque, phase currents, leg states; and the cursor that is over all.
import { BOTTOM, LEFT, RIGHT, TOP, frame, prepared, span, theme, trace } from "./chart.js";

const LETTERS = "abcd";

export function drawTorque(canvas, seen, follows) {
  const colours = theme(), on = prepared(canvas), { tau, tau_ref } = seen.series;
  const shown = follows ? [tau, tau_ref] : [tau];
  const { y } = frame(on, colours, [seen.from, seen.to], span(shown));
  if (follows) trace(on.g, tau_ref, y, colours.text, { dashed: true, width: 1 });
  trace(on.g, tau, y, colours.accent);
}

export function drawCurrents(canvas, seen, n_phases, references) {
  const colours = theme(), on = prepared(canvas);
  const own = Array.from({ length: n_phases }, (_, k) => seen.series[`i_${k}`]);
  const { y } = frame(on, colours, [seen.from, seen.to], span(own, 0));
  on.g.save();
  on.g.beginPath();
  on.g.rect(LEFT, TOP, on.w - LEFT - RIGHT, on.h - TOP - BOTTOM);
  on.g.clip();
  own.forEach((one, k) => {
    if (references) {
      trace(on.g, seen.series[`i_ref_${k}`], y, colours.phases[k], { dashed: true, width: 1 });
    }
    trace(on.g, one, y, colours.phases[k]);
  });
  on.g.restore();
}

/** Magnetize above the line, demagnetize below it, freewheel on it. */
export function drawLegs(canvas, seen, n_phases) {
  const colours = theme(), on = prepared(canvas), { g } = on;
  frame(on, colours, [seen.from, seen.to], [0, n_phases], false);
  const each = (on.h - TOP - BOTTOM) / n_phases;
  for (let k = 0; k < n_phases; ++k) {
    const one = seen.series[`leg_${k}`], middle = TOP + each * (k + 0.5), half = 0.38 * each;
    g.fillStyle = colours.phases[k];
    g.fillText(LETTERS[k], LEFT - 14, middle + 4);
    g.fillRect(LEFT, Math.round(middle), on.w - LEFT - RIGHT, 1);
    for (let c = 0; c < one.length / 2; ++c) {
      const top = Math.max(one[2 * c + 1], 0), bottom = Math.min(one[2 * c], 0);
      const from = Math.round(middle - half * top), to = Math.round(middle - half * bottom);
      if (to > from) g.fillRect(LEFT + c, from, 1, to - from);
    }
  }
}

/** Lines at an instant and where a drive enters a state, on the canvas that lies over the charts. */
export function drawCursor(canvas, t, { from, to }, states) {
  const colours = theme(), { g, w, h } = prepared(canvas);
  const line = (at, colour) => {
    if (at < from || at > to) return;
    const x = LEFT + (at - from) / (to - from) * (w - LEFT - RIGHT);
    g.strokeStyle = colour;
    g.beginPath();
    g.moveTo(x, TOP);
    g.lineTo(x, h - BOTTOM);
    g.stroke();
  };
  for (const { t: entered, status } of states) line(entered, status ? colours.phases[1] : colours.text);
  line(t, colours.ink);
}

let kept = { loop: null, key: "", picture: null }; // what stays while the point moves

/** Flux linkage over current with the magnetisation curves; a point where the cursor is. */
export function drawLoop(canvas, loop, curves, here) {
  const colours = theme(), on = prepared(canvas), { g, w, h } = on;
  const key = `${canvas.width} ${canvas.height} ${colours.ink}`;
  let most = 0, flux = 0;
  for (const v of loop.i) if (v > most) most = v;
  for (const v of loop.psi) if (v > flux) flux = v;
  most = 1.15 * Math.max(most, 1e-6);
  flux = 1.15 * Math.max(flux, 1e-9);
  const x = i => LEFT + i / most * (w - LEFT - RIGHT), y = v => h - BOTTOM - v / flux * (h - TOP - BOTTOM);
  if (kept.loop !== loop || kept.key !== key) {
    still(on, loop, curves, colours, most, flux, x, y);
    const picture = document.createElement("canvas");
    picture.width = canvas.width;
    picture.height = canvas.height;
    picture.getContext("2d").drawImage(canvas, 0, 0);
    kept = { loop, key, picture };
  } else {
    g.drawImage(kept.picture, 0, 0, w, h);
  }
  if (here) {
    g.fillStyle = colours.ink;
    g.beginPath();
    g.arc(x(here.i_0), y(here.psi_0), 4, 0, 7);
    g.fill();
  }
}

function still({ g, w, h }, loop, curves, colours, most, flux, x, y) {
  g.save();
  g.beginPath();
  g.rect(LEFT, TOP, w - LEFT - RIGHT, h - TOP - BOTTOM);
  g.clip();
  g.strokeStyle = colours.grid;
  g.fillStyle = colours.text;
  curves.psi.forEach((psi, n) => {
    g.beginPath();
    psi.forEach((v, j) => j ? g.lineTo(x(curves.i[j]), y(v)) : g.moveTo(x(curves.i[j]), y(v)));
    g.stroke();
    const j = curves.i.findIndex(i => i > 0.9 * most);
    if (j > 0 && psi[j] < flux) g.fillText(`${curves.deg[n]}°`, x(0.9 * most), y(psi[j]) - 3);
  });
  g.beginPath();
  for (let j = 0; j < loop.i.length; ++j) g.lineTo(x(loop.i[j]), y(loop.psi[j]));
  g.globalAlpha = 0.18;
  g.fillStyle = colours.phases[0];
  g.fill();
  g.globalAlpha = 1;
  g.strokeStyle = colours.phases[0];
  g.lineWidth = 1.5;
  g.stroke();
  g.restore();
  g.fillStyle = colours.text;
  g.textAlign = "right";
  g.fillText(`${(most / 1.15).toPrecision(3)} A`, x(most / 1.15), h - 7);
  g.fillText((flux / 1.15).toPrecision(2), LEFT - 6, y(flux / 1.15) + 4);
  g.fillText("Wb", LEFT - 6, TOP + 10);
  g.textAlign = "left";
  g.fillText("0", LEFT, h - 7);
}

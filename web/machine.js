// The machine in cross-section: stator poles with their coils, the rotor at its angle, and the poles
// of a phase lit with its current.
import { prepared, theme } from "./chart.js";

export function drawMachine(canvas, drive, values) {
  const colours = theme(), { g, w, h } = prepared(canvas);
  const R = 0.47 * Math.min(w, h), { N_s, N_r, n_phases } = drive;
  g.translate(w / 2, h / 2);
  ring(g, R, 0.84 * R, colours.grid);
  for (let j = 0; j < N_s; ++j) {
    // At electrical angle 0 a phase's poles face gaps of the rotor: phase k is 2 pi k/m later.
    const k = ((Math.round(N_r * j / N_s * n_phases) % n_phases) + n_phases) % n_phases;
    const lit = Math.min(1, Math.max(0, values ? values[`i_${k}`] / values.most : 0));
    g.save();
    g.rotate(2 * Math.PI * j / N_s);
    const half = 0.26 * Math.PI / N_s * 2 * 0.62 * R;
    g.fillStyle = colours.grid;
    g.fillRect(0.62 * R, -half, 0.26 * R, 2 * half);
    g.fillStyle = colours.phases[k];
    g.globalAlpha = 0.12 + 0.88 * lit;
    g.fillRect(0.62 * R, -half, 0.24 * R, 2 * half);
    g.fillRect(0.68 * R, -1.5 * half, 0.14 * R, 3 * half); // the coil
    g.globalAlpha = 1;
    g.restore();
    const angle = 2 * Math.PI * j / N_s;
    g.fillStyle = colours.ink;
    g.textAlign = "center";
    g.fillText("abcd"[k], 0.92 * R * Math.cos(angle), 0.92 * R * Math.sin(angle) + 4);
  }
  g.save();
  g.rotate((values?.theta_m ?? 0) + Math.PI / N_r);
  g.fillStyle = colours.text;
  for (let n = 0; n < N_r; ++n) {
    g.rotate(2 * Math.PI / N_r);
    const half = 0.28 * Math.PI / N_r * 2 * 0.6 * R;
    g.fillRect(0.2 * R, -half, 0.39 * R, 2 * half);
  }
  g.restore();
  g.fillStyle = colours.text;
  disc(g, 0.34 * R);
  g.fillStyle = colours.panel;
  disc(g, 0.12 * R);
}

function disc(g, radius) {
  g.beginPath();
  g.arc(0, 0, radius, 0, 2 * Math.PI);
  g.fill();
}

function ring(g, outer, inner, colour) {
  g.fillStyle = colour;
  g.beginPath();
  g.arc(0, 0, outer, 0, 2 * Math.PI);
  g.arc(0, 0, inner, 0, 2 * Math.PI, true);
  g.fill();
}

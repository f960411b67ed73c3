// What the visitor has chosen: a drive, a value for each of its controls, the length of the run.
// A plain object, so that a link, a lesson and a drive file can hold it.

/** A drive as its example has it. */
export function chosen(drive) {
  const at = {};
  for (const control of drive.controls) at[control.key] = control.values.indexOf(control.given);
  return { drive: drive.name, at, until: drive.until };
}

/** Nearest of a control's values, as an index. */
export function nearest(control, value) {
  const same = control.values.indexOf(value);
  if (same >= 0) return same;
  const position = v => v === null ? -1e9 : v;
  let best = 0;
  control.values.forEach((v, j) => {
    const apart = Math.abs(position(v) - position(value));
    if (apart < Math.abs(position(control.values[best]) - position(value))) best = j;
  });
  return best;
}

/** The parameters to set, by name. */
export function settings(drive, model) {
  const sets = [];
  for (const control of drive.controls) {
    const j = model.at[control.key];
    if (control.values[j] === control.given) continue;
    for (const [name, values] of Object.entries(control.sets)) sets.push([name, values[j]]);
  }
  return sets;
}

/** The controls that are not where the example has them. */
export function moved(drive, model) {
  return drive.controls.filter(control => control.values[model.at[control.key]] !== control.given);
}

/** As the part of a link after #. look: { from, to, t, slow, playing } of what is seen, or null. */
export function toLink(drive, model, look) {
  const parts = [["drive", model.drive], ["until", model.until]];
  for (const control of moved(drive, model)) {
    parts.push([control.key, control.values[model.at[control.key]] ?? "none"]);
  }
  if (look) {
    const short = v => Number(v.toPrecision(9));
    parts.push(["from", short(look.from)], ["to", short(look.to)], ["at", short(look.t)]);
    parts.push(["slow", look.slow]);
    if (look.playing) parts.push(["play", 1]);
  }
  return new URLSearchParams(parts).toString();
}

/** From a link; what it does not say is as in the example. */
export function fromLink(text, drives) {
  const given = new URLSearchParams(text);
  const drive = drives.find(d => d.name === given.get("drive")) ?? drives[0];
  const model = chosen(drive);
  for (const control of drive.controls) {
    const value = given.get(control.key);
    if (value === null) continue;
    if (control.values.includes(value)) {
      model.at[control.key] = control.values.indexOf(value);
    } else if (value === "none" || Number.isFinite(Number(value))) {
      model.at[control.key] = nearest(control, value === "none" ? null : Number(value));
    }
  }
  const until = Number(given.get("until"));
  if (until > 0 && until <= 2) model.until = until;
  return model;
}

/** What is seen of the run, from a link; null where it does not say. */
export function lookFromLink(text, until) {
  const given = new URLSearchParams(text), number = key => Number(given.get(key) ?? NaN);
  const from = number("from"), to = number("to"), t = number("at");
  if (!(from >= 0 && to - from >= 1e-6 && to <= until * (1 + 1e-9))) return null;
  return { from, to, t: t >= 0 && t <= until ? t : from, slow: given.get("slow"), playing: given.has("play") };
}

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

/** As the part of a link after #. */
export function toLink(drive, model) {
  const parts = [["drive", model.drive], ["until", model.until]];
  for (const control of moved(drive, model)) {
    parts.push([control.key, control.values[model.at[control.key]] ?? "none"]);
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
    if (value === "none" || Number.isFinite(Number(value))) {
      model.at[control.key] = nearest(control, value === "none" ? null : Number(value));
    }
  }
  const until = Number(given.get("until"));
  if (until > 0 && until <= 2) model.until = until;
  return model;
}

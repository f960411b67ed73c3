// The controls of a drive as labelled sliders, and its key figures as a table.

/** Fills a select with [value, text] pairs. */
export function options(select, pairs, value) {
  select.replaceChildren(...pairs.map(([v, text]) => new Option(text, v)));
  select.value = value;
}

/** One slider for each control; `change` is told its key and the index of the value. */
export function sliders(place, drive, model, change) {
  place.replaceChildren(...drive.controls.map(control => {
    const row = document.createElement("label"), top = document.createElement("span");
    const output = document.createElement("output"), input = document.createElement("input");
    row.className = "row";
    top.className = "top";
    top.append(control.label, output);
    Object.assign(input, { type: "range", min: 0, max: control.values.length - 1, step: 1 });
    input.value = model.at[control.key];
    input.dataset.key = input.id = row.htmlFor = control.key;
    input.title = control.key;
    const show = () => {
      const value = control.values[input.value];
      output.textContent = shownValue(control, value);
      input.setAttribute("aria-valuetext", shownValue(control, value));
      row.classList.toggle("moved", value !== control.given);
    };
    input.addEventListener("input", () => { show(); change(control.key, Number(input.value)); });
    show();
    row.append(top, input);
    return row;
  }));
}

export function shownValue(control, value) {
  const ideal = ["sensing.adc_bits", "sensing.encoder_counts", "converter.dead_time_us"];
  if (value === 0 && ideal.includes(control.key)) return "ideal";
  return `${String(value).replaceAll("_", " ")} ${control.unit}`;
}

const percent = v => v === null || v === undefined ? "–" : `${(100 * v).toFixed(2)} %`;
const number = (unit, digits) => v => v === null || v === undefined ? "–" : `${v.toFixed(digits)} ${unit}`;

// Key, label, how it is shown, and its counterpart of `reluctance limit`.
const ROWS = [
  ["tau_mean", "Mean torque", number("N m", 3), limit => limit.tau_ref_Nm],
  ["tau_ref_mean", "Mean reference", number("N m", 3)],
  ["torque_ripple_pp", "Ripple, peak to peak", percent, limit => limit.ripple_free ? 0 : null],
  ["torque_ripple_rms", "Ripple, rms", percent, limit => limit.ripple_free ? 0 : null],
  ["torque_error_rms", "Torque error, rms", percent, limit => limit.tau_error_rms_Nm / Math.abs(limit.tau_ref_Nm)],
  ["f_switch", "Switching frequency", v => `${(v / 1e3).toFixed(2)} kHz`],
  ["i_rms", "Rms phase current", number("A", 2), limit => limit.i_rms_A],
  ["i_peak", "Peak phase current", number("A", 2), limit => limit.i_peak_A],
  ["i_cap_rms", "Rms dc-link capacitor current", number("A", 2)],
  ["p_cu", "Copper loss", number("W", 1), limit => limit.p_cu_W],
  ["p_dev", "Device conduction loss", number("W", 1)],
  ["p_mech", "Mechanical power", number("W", 1)],
  ["p_in", "Power from the dc link", number("W", 1)],
  ["efficiency", "Efficiency", percent],
];

/** A state that a drive has entered, in words; a fault with its evidence. */
export function stateText({ t, mode, status, text, phase, value, limit }) {
  const of = phase >= 0 ? `, phase ${"abcd"[phase]}` : "";
  const numbers = limit !== 0 ? `: ${value.toPrecision(4)}, limit ${limit.toPrecision(4)}` : "";
  return `${(t * 1e3).toFixed(2)} ms ${mode}` + (status ? `: ${text} (status ${status}${of}${numbers})` : "");
}

/** The states that a drive has entered; each leads there. */
export function showStates(list, states, go) {
  list.hidden = !states.length;
  list.replaceChildren(...states.map(state => {
    const item = document.createElement("li"), button = document.createElement("button");
    button.type = "button";
    button.textContent = stateText(state);
    for (const name of ["t", "mode", "status"]) item.dataset[name] = state[name];
    button.onclick = () => go(state.t);
    item.append(button);
    return item;
  }));
}

/** The key figures, and beside them the limit where it holds. */
export function showFigures(table, figures, limit) {
  table.tBodies[0].replaceChildren(...ROWS.map(([key, label, form, of]) => {
    const row = document.createElement("tr"), head = document.createElement("th");
    head.scope = "row";
    head.textContent = label;
    const own = document.createElement("td"), bound = document.createElement("td");
    own.dataset.figure = key;
    own.dataset.value = figures[key];
    own.textContent = form(figures[key]);
    bound.textContent = limit && of ? form(of(limit)) : "";
    row.append(head, own, bound);
    return row;
  }));
}

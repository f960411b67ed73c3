// Drive files: the present choice as TOML, and the keys that the page's controls cover out of one.
import { chosen, moved, nearest } from "./model.js";

/** The drive file of what the page shows. */
export function toToml(drive, model) {
  const tables = structuredClone(drive.tables);
  for (const control of moved(drive, model)) {
    const [section, key] = control.key.split(".");
    const value = control.values[model.at[control.key]];
    tables[section] ??= {};
    if (value === null) delete tables[section][key]; else tables[section][key] = value;
  }
  tables.simulation = { ...tables.simulation, until_s: model.until };
  const { machine, ...rest } = tables;
  const lines = ["# Written by the studio.", `machine = ${text(machine)}`];
  for (const [section, table] of Object.entries(rest)) {
    const keys = Object.entries(table).filter(([, value]) => value !== null);
    if (keys.length) lines.push("", `[${section}]`, ...keys.map(([key, value]) => `${key} = ${text(value)}`));
  }
  return lines.join("\n") + "\n";
}

function text(value) {
  return Array.isArray(value) ? `[${value.map(text).join(", ")}]` : JSON.stringify(value);
}

/** Tables of a drive file: plain values, one a line. Throws a line that says what it cannot read. */
export function parse(content) {
  const tables = {};
  let table = tables;
  content.split(/\r?\n/).forEach((raw, j) => {
    const line = raw.replace(/^((?:[^"'#]|"[^"]*"|'[^']*')*)#.*$/, "$1").trim();
    if (!line) return;
    const head = /^\[([\w-]+)\]$/.exec(line), pair = /^([\w-]+)\s*=\s*(.+)$/.exec(line);
    if (head) table = tables[head[1]] ??= {};
    else if (pair) table[pair[1]] = value(pair[2], j + 1);
    else throw new Error(`line ${j + 1} is not read here: ${line.slice(0, 40)}`);
  });
  return tables;
}

function value(given, line) {
  if (/^'[^']*'$/.test(given)) return given.slice(1, -1);
  const plain = /^[+-]?[\d_.]+(e[+-]?\d+)?$/i.test(given) ? given.replaceAll("_", "").replace("+", "") : given;
  if (/^[+-]?\.?\d/.test(plain) && Number.isFinite(Number(plain))) return Number(plain);
  try {
    return JSON.parse(plain.replace(/,\s*\]/g, "]"));
  } catch {
    throw new Error(`line ${line}: the value ${given.slice(0, 40)} is not read here`);
  }
}

/** The nearest choice of the page, and in words what the file says that the page cannot show. */
export function fromToml(content, drives) {
  const tables = parse(content);
  const law = tables.control?.law;
  const same = drives.filter(d => d.tables.machine === tables.machine && d.law === law);
  if (!same.length) {
    throw new Error(`the page has no drive with machine ${tables.machine ?? "?"} and law ${law ?? "?"}`);
  }
  const drive = same[0], model = chosen(drive), left = [];
  const sections = new Set([...Object.keys(tables), ...Object.keys(drive.tables)]);
  for (const section of sections) {
    if (typeof tables[section] !== "object" && typeof drive.tables[section] !== "object") continue;
    const given = tables[section] ?? {}, own = drive.tables[section] ?? {};
    for (const key of new Set([...Object.keys(given), ...Object.keys(own)])) {
      const name = `${section}.${key}`, control = drive.controls.find(c => c.key === name);
      if (name === "simulation.until_s") {
        model.until = Math.min(given[key] ?? drive.until, 2);
      } else if (control && key in given) {
        model.at[name] = nearest(control, given[key]);
        const taken = control.values[model.at[name]];
        if (taken !== given[key]) left.push(`${name} = ${given[key]} (nearest here: ${taken})`);
      } else if (key in given && JSON.stringify(given[key]) !== JSON.stringify(own[key])) {
        left.push(`${name} = ${JSON.stringify(given[key])}`);
      } else if (!(key in given) && !control && own[key] !== null) {
        left.push(`${name} stays ${JSON.stringify(own[key])}`);
      }
    }
  }
  return { model, note: left.length ? `Not as in the file: ${left.join("; ")}` : "The page shows the whole file." };
}

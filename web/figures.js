// Key figures of a run from its period rows: as python/reluctance/drive/run/kpis.py, which explains them.

/** Rows are arrays of numbers; names are those of the table `period`. */
export function figures(rows, names, drive) {
  const column = Object.fromEntries(names.map((name, j) => [name, j]));
  const of = (row, name) => row[column[name]];
  const [window, periods] = evaluated(rows, of, drive.N_r);
  const first = window[0], last = window[window.length - 1], inside = window.slice(1);
  const rise = name => of(last, name) - of(first, name);
  const duration = rise("t");
  const mean = name => rise(name) / duration;
  const least = name => Math.min(...inside.map(row => of(row, name)));
  const most = name => Math.max(...inside.map(row => of(row, name)));
  const tau = mean("tau"), tau_ref = drive.follows_torque ? mean("tau_ref") : null;
  const squared = phases("i_squared", names).map(rise);
  const p_cu = drive.R * squared.reduce((a, b) => a + b, 0) / duration;
  const p_in = mean("E_dc"), p_mech = mean("E_mech");
  const omega = mean("theta_m");
  const error = mean("error_squared");
  const lost = rise("E_dc") - rise("E_winding");
  return {
    tau_mean: tau,
    tau_ref_mean: tau_ref,
    torque_ripple_pp: ratio(most("tau_max") - least("tau_min"), tau),
    torque_ripple_rms: ratio(deviation(mean("tau_squared"), tau), tau),
    torque_error_rms: ratio(Math.sqrt(error), tau_ref),
    i_rms: Math.sqrt(Math.max(...squared) / duration),
    i_peak: most("i_peak"),
    i_cap_rms: deviation(mean("i_cap_squared"), mean("i_cap")),
    p_cu,
    p_dev: Math.abs(lost) > 1e-10 * Math.abs(rise("E_dc")) ? lost / duration : 0,  // else rounding
    p_mech,
    p_in,
    efficiency: efficiency(p_mech, p_in),
    f_switch: mean("turn_ons") / (2 * drive.n_phases),
    speed_mean: omega,
    beyond_map: Math.max(0, 1 - drive.i_known / most("i_peak")),
    periods,
  };
}

/** Names of a column's phases. */
export function phases(name, names) {
  return names.filter(n => n.startsWith(`${name}_`) && /^\d+$/.test(n.slice(name.length + 1)));
}

/** The rows of the whole periods in the second half, and how many those are. */
function evaluated(rows, of, N_r) {
  const turns = row => of(row, "theta_m") * N_r / (2 * Math.PI);
  const end = of(rows[rows.length - 1], "t"), moment = 1e-9 * end;
  const whole = rows.filter((row, j) => {
    const before = j > 0 ? of(rows[j - 1], "t") : -Infinity;
    return Math.abs(turns(row) - Math.round(turns(row))) < 1e-6 && of(row, "t") - before > moment;
  });
  const late = whole.filter(row => of(row, "t") >= end / 2 - moment);
  const ends = late.length >= 2 ? late : whole.slice(-2);
  const [a, b] = [ends[0], ends[ends.length - 1]];
  if (ends.length < 2 || Math.abs(turns(b) - turns(a)) < 0.5) return [rows, 0];
  return [rows.slice(rows.indexOf(a), rows.indexOf(b) + 1), ends.length - 1];
}

function efficiency(p_mech, p_in) {
  if (p_mech > 0 && p_mech <= p_in) return p_mech / p_in;
  return p_mech <= p_in && p_in < 0 ? p_in / p_mech : null;
}

function deviation(squared, mean) {
  return Math.sqrt(Math.max(squared - mean * mean, 0));
}

function ratio(part, whole) {
  return whole && part < 100 * Math.abs(whole) ? part / Math.abs(whole) : null;
}

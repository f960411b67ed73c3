// Least and greatest value of a waveform in each pixel column: what a chart needs of any number of
// points.

/** First index whose time is at least t. */
export function lower(times, t) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < t) low = middle + 1; else high = middle;
  }
  return low;
}

const BLOCK = 64; // points whose least and greatest value are known

/** Least and greatest value of each block of points: with them a column of many is quick. */
export function blocks(values) {
  const count = Math.floor(values.length / BLOCK), out = new Float32Array(2 * count);
  for (let b = 0; b < count; ++b) {
    let least = Infinity, greatest = -Infinity;
    for (let j = b * BLOCK; j < (b + 1) * BLOCK; ++j) {
      if (values[j] < least) least = values[j];
      if (values[j] > greatest) greatest = values[j];
    }
    out[2 * b] = least;
    out[2 * b + 1] = greatest;
  }
  return out;
}

/** [least, greatest] of each column one after the other; a column without a point continues the
 * waveform: between its neighbours, or held where `held`. */
export function envelope(times, values, known, from, to, columns, held) {
  const out = new Float32Array(2 * columns), width = (to - from) / columns;
  let j = lower(times, from);
  const last = times.length - 1;
  const at = t => { // value at an instant; j is the first point not before it
    if (j <= 0) return values[0];
    if (j > last) return values[last];
    if (held || times[j] === times[j - 1]) return values[j - 1];
    return values[j - 1] + (values[j] - values[j - 1]) * (t - times[j - 1]) / (times[j] - times[j - 1]);
  };
  let before = at(from);
  for (let c = 0; c < columns; ++c) {
    const end = from + width * (c + 1);
    let least = before, greatest = before;
    while (j <= last && times[j] < end) {
      if (j % BLOCK === 0 && j + BLOCK <= last && times[j + BLOCK - 1] < end) {
        const b = j / BLOCK;
        if (known[2 * b] < least) least = known[2 * b];
        if (known[2 * b + 1] > greatest) greatest = known[2 * b + 1];
        j += BLOCK;
        continue;
      }
      const v = values[j++];
      if (v < least) least = v;
      if (v > greatest) greatest = v;
    }
    before = at(end);
    if (!held) { least = Math.min(least, before); greatest = Math.max(greatest, before); }
    out[2 * c] = least;
    out[2 * c + 1] = greatest;
  }
  return out;
}

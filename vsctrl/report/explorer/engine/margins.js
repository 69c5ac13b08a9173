// Margins of a loop transfer function L(ω) = [re, im] on a band, every crossing refined to rounding.

const EDGE = 1e-12; // what is nearer to 1 is 1
const LEAST = 0.01; // the band ends where |L| has fallen below this

// Samples of L by rising ω, so close that neither |L| nor its phase changes much between two.
function sampledBand(L, low, high, late) {
  const points = [];
  const add = (w) => { const v = L(w); points.push([w, v[0], v[1]]); };
  const ratio = Math.pow(10, 1 / 16);
  for (let w = low; w < high; w = Math.min(w * ratio, w + (late ? 0.4 / late : Infinity))) {
    add(w);
    if (points.length > 20000) throw new NoAnswer("The delays turn L too often at these numbers.");
  }
  add(high);
  const out = [points[0]];
  const refine = (a, b, depth) => {
    const size = Math.hypot(a[1], a[2]);
    const turn = Math.abs(angleBetween([a[1], a[2]], [b[1], b[2]]));
    const grows = Math.abs(Math.log(Math.hypot(b[1], b[2]) / size));
    if (depth < 14 && (turn > 0.4 || grows > 0.5 || Number.isNaN(turn + grows))) {
      const w = Math.sqrt(a[0] * b[0]);
      const v = L(w);
      const middle = [w, v[0], v[1]];
      refine(a, middle, depth + 1);
      refine(middle, b, depth + 1);
    } else out.push(b);
  };
  for (let i = 1; i < points.length; i++) refine(points[i - 1], points[i], 0);
  return out;
}

// Where f(ω) is 0 between a and b, which it has with different signs.
function zeroBetween(f, a, b) {
  let fa = f(a);
  let fb = f(b);
  for (let i = 0; i < 200 && Math.abs(b - a) > 2e-16 * (Math.abs(a) + Math.abs(b)); i++) {
    let x = i % 3 === 2 ? (a + b) / 2 : b - (fb * (b - a)) / (fb - fa);
    if (!(x > Math.min(a, b) && x < Math.max(a, b))) x = (a + b) / 2;
    if (x === a || x === b) break;
    const fx = f(x);
    if (fx === 0) return x;
    if (fx > 0 === fb > 0) { b = x; fb = fx; } else { a = b; fa = fb; b = x; fb = fx; }
    if (fa > 0 === fb > 0) [a, fa] = [b, fb]; // never reached: the signs stay different
  }
  return Math.abs(fa) < Math.abs(fb) ? a : b;
}

// The derivative of f with respect to ln ω.
function slope(f, w) {
  const h = 2e-3;
  const at = (k) => f(w * Math.exp(k * h));
  return (45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + (at(3) - at(-3))) / (60 * h);
}

// Where f, whose samples are given, is 0; also where it only dips past 0 between three of them.
function zerosOf(f, w, values, counts) {
  const out = [];
  for (let i = 1; i < w.length; i++) {
    const [a, b] = [values[i - 1], values[i]];
    if (a === 0 && i === 1) out.push(w[0]);
    if (b === 0) { out.push(w[i]); continue; }
    if (a * b < 0) { if (counts(i)) out.push(zeroBetween(f, w[i - 1], w[i])); continue; }
    const c = values[i + 1];
    if (i + 1 < w.length && b * c > 0 && Math.abs(b) <= Math.abs(a) && Math.abs(b) <= Math.abs(c)) {
      const top = extremum(f, w[i - 1], w[i + 1]);
      if (top && f(top) * b < 0)
        out.push(zeroBetween(f, w[i - 1], top), zeroBetween(f, top, w[i + 1]));
    }
  }
  return out;
}

function extremum(f, a, b) {
  const rate = (w) => slope(f, w);
  return rate(a) * rate(b) < 0 ? zeroBetween(rate, a, b) : null;
}

const turnFrom = (v) => Math.atan2(-v[1], -v[0]); // of −1

// [ω, gain factor] where L crosses the negative real axis.
function phaseCrossings(L, band) {
  const turns = band.map((p) => turnFrom([p[1], p[2]]));
  const passes = (i) => Math.abs(turns[i] - turns[i - 1]) < 3;
  const out = [];
  for (const x of zerosOf((w) => turnFrom(L(w)), band.map((p) => p[0]), turns, passes)) {
    const v = L(x);
    const size = Math.hypot(v[0], v[1]);
    // At a zero or a pole on the axis L turns by half a turn in one place, where it is rounding.
    if (Math.abs(v[1]) < 1e-6 * size && v[0] < 0) out.push([x, 1 / size]);
  }
  return out;
}

// The margins. `limits`: L at ω = 0 and ∞, [re, im], or null where there is none that is finite;
// `stable`: no unstable root.
function marginsOf(L, band, limits, stable) {
  const w = band.map((point) => point[0]);
  const log = (x) => { const v = L(x); return Math.log(Math.hypot(v[0], v[1])); };
  const gainAt = zerosOf(log, w, band.map((p) => Math.log(Math.hypot(p[1], p[2]))), () => true)
    .filter((x) => Math.abs(log(x)) < 1e-6);
  const turn = (x) => turnFrom(L(x));
  const crossings = phaseCrossings(L, band);
  [0, Infinity].forEach((end, i) => {
    const limit = limits[i];
    if (limit && limit[0] < 0 && limit[1] === 0) crossings.push([end, -1 / limit[0]]);
  });
  const factors = crossings.map(([, f]) => (Math.abs(f - 1) < EDGE ? 1 : f));
  const phases = gainAt.map(turn);
  const delays = phases.map((phase, i) => {
    if (Math.abs(phase) < EDGE) return 0;
    const room = ((phase % (2 * Math.PI)) + 2 * Math.PI) % (2 * Math.PI);
    return (room - (stable ? 0 : 2 * Math.PI)) / gainAt[i];
  });
  const least = (list) => list.reduce((a, b) => (Math.abs(b) < Math.abs(a) ? b : a), Infinity);
  const peak = peakOf(L, w, band, limits);
  return {
    gain: Math.min(...factors.filter((f) => f >= 1)),
    gain_down: Math.max(0, ...factors.filter((f) => f < 1)),
    phase: least(phases),
    delay: least(delays),
    peak_sensitivity: peak[1],
    peak_frequency: peak[0],
    gain_crossings: gainAt.map((x, i) => [x, phases[i]]),
    phase_crossings: crossings,
  };
}

// (ω, value) of the largest 1/|1 + L|, the ends of the band and the limits beyond them included.
function peakOf(L, w, band, limits) {
  const distance = (x) => { const v = L(x); return Math.hypot(1 + v[0], v[1]); };
  const found = band.map((p) => Math.hypot(1 + p[1], p[2]));
  const candidates = [[w[0], found[0]], [w[w.length - 1], found[w.length - 1]]];
  const lowest = Math.min(...found);
  for (let i = 1; i + 1 < w.length; i++)
    if (found[i] <= found[i - 1] && found[i] <= found[i + 1] && found[i] < 1.2 * lowest + 1e-12) {
      const at = extremum((x) => distance(x) ** 2, w[i - 1], w[i + 1]) ?? w[i];
      candidates.push([at, distance(at)]);
    }
  [0, Infinity].forEach((end, i) => {
    if (limits[i]) candidates.push([end, Math.hypot(1 + limits[i][0], limits[i][1])]);
  });
  const best = candidates.reduce((a, b) => (b[1] < a[1] ? b : a));
  return [best[0], 1 / best[1]];
}

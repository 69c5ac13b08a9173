// The twin in z: signals held over a period T, everything else continuous, delays of any length.
//
// Cut at what is held, the diagram is channels P from held signals to sampled ones; each is a chain
// of states with the numbers of its Δ, moved over a period by matrix exponentials. The computer
// gives each held signal as a filter of a sampled one. Nothing is approximated.

const METHODS = { forward: [1, 0, 1], backward: [1, 1, 0], tustin: [2, 1, 1] };

// (d, g) of θ = d T − g, 0 ≤ g < T: what is delayed by θ is g after the sample k − d.
function ago(theta, period) {
  const ratio = theta / period;
  const whole = Math.round(ratio);
  if (Math.abs(ratio - whole) < 1e-9 * Math.max(1, whole)) return [whole, 0];
  const d = Math.ceil(ratio);
  return [d, d * period - theta];
}

// One channel: x[k+1] = A x[k] + B u[k] and y[k] = Σ C_d x[k−d] + D_d u[k−d].
class Chain {
  constructor(N, D, period) {
    if (D.some(({ tau }) => tau))
      throw new NoAnswer("The hold does not cut every loop with a delay, so this has no finite twin in z.");
    const n = degree(D);
    this.hidden = hiddenAtZero(N, D);
    if (degree(N) > n)
      throw new NoAnswer("A held signal would be differentiated: let the computer run that block.");
    const den = D[0].c.map((x) => x / D[0].c[n]);
    let rate = 1 / period;
    den.slice(0, n).forEach((x, k) => {
      if (x) rate = Math.max(rate, Math.pow(Math.abs(x), 1 / (n - k)));
    });
    // States scaled so that the companion matrix is about `rate` throughout.
    const flow = zeros(n + 1, n + 1);
    for (let i = 0; i + 1 < n; i++) flow[i][i + 1] = rate;
    for (let k = 0; k < n; k++) flow[n - 1][k] = -den[k] * Math.pow(rate, k - n + 1);
    if (n) flow[n - 1][n] = Math.pow(rate, 1 - n);
    const moved = (g) => exponential(flow.map((row) => row.map((x) => x * g)));
    const whole = moved(period);
    this.n = n;
    this.A = whole.slice(0, n).map((row) => row.slice(0, n));
    this.B = whole.slice(0, n).map((row) => row[n]);
    this.taps = new Map();
    for (const { tau, c } of N) {
      const [d, g] = ago(tau, period);
      const through = (c[n] ?? 0) / D[0].c[n];
      const row = Array.from({ length: n }, (_, k) =>
        ((c[k] ?? 0) / D[0].c[n] - through * den[k]) * Math.pow(rate, k));
      const E = moved(g);
      const tap = this.tap(d);
      for (let i = 0; i < n; i++) {
        for (let k = 0; k < n; k++) tap.C[k] += row[i] * E[i][k];
        tap.D += row[i] * E[i][n];
      }
      // An input is the same anywhere in its period.
      this.tap(d).D += through;
    }
    this.longest = Math.max(0, ...this.taps.keys());
  }

  tap(d) {
    if (!this.taps.has(d)) this.taps.set(d, { C: new Float64Array(this.n), D: 0 });
    return this.taps.get(d);
  }

  // What acts on y[k] through u[k] at once.
  get direct() {
    return this.taps.get(0)?.D ?? 0;
  }

  // P(z).
  at(z) {
    let sum = [0, 0];
    if (!this.taps.size) return sum;
    const x = this.states(z);
    for (const [d, { C, D }] of this.taps) {
      let re = D;
      let im = 0;
      for (let k = 0; k < this.n; k++) { re += C[k] * x[k][0]; im += C[k] * x[k][1]; }
      sum = cadd(sum, d ? cmul([re, im], z.power(-d)) : [re, im]);
    }
    return sum;
  }

  // (zI − A)⁻¹ B.
  states(z) {
    const [re, im] = z.value;
    if (!this.n) return [];
    if (this.n === 1) return [cdiv([this.B[0], 0], [re - this.A[0][0], im])];
    const A = this.A.map((row, i) => Array.from(row, (x, j) => (i === j ? [re - x, im] : [-x, 0])));
    return solvedComplex(A, this.B.map((value) => [value, 0])).x;
  }

  // det(I − A/z), whose zeros in z are this chain's poles.
  characteristic(z) {
    const w = z.power(-1);
    const M = this.A.map((row, i) =>
      Array.from(row, (x, j) => [(i === j ? 1 : 0) - x * w[0], -x * w[1]]));
    return solvedComplex(M, this.B.map(() => [0, 0])).det;
  }
}

// A point z = r e^{jφ} and its powers.
class Polar {
  constructor(r, angle) {
    this.log = Math.log(r);
    this.angle = angle;
    this.value = this.power(1);
  }

  power(d) {
    const size = this.log ? Math.exp(d * this.log) : 1;
    return [size * Math.cos(d * this.angle), size * Math.sin(d * this.angle)];
  }
}

// A filter b/a in q = 1/z that the computer runs: of a block by a method, or of a plain hold.
function discretised({ num, den }, method, period) {
  const order = Math.max(...num.map(([k]) => k), ...den.map(([k]) => k));
  const [a, b, c] = METHODS[method];
  const inQ = (side) => {
    const out = [];
    for (const [k, tau, value] of side) {
      const [late, after] = ago(tau, period);
      if (after) throw new NoAnswer("A block in the computer is late by a fraction of the period.");
      let poly = [value * Math.pow(a, k) * Math.pow(period, order - k)];
      for (let i = 0; i < order; i++) {
        const [u, v] = i < k ? [1, -1] : [b, c];
        poly = [...poly, 0].map((x, j) => u * x + (j ? v * poly[j - 1] : 0));
      }
      poly.forEach((x, d) => { out[d + late] = (out[d + late] ?? 0) + x; });
    }
    return Array.from(out, (x) => x ?? 0);
  };
  const [over, under] = [inQ(num), inQ(den)];
  if (!under[0]) throw new NoAnswer("A block in the computer would need a sample of the future.");
  return { b: over.map((x) => x / under[0]), a: under.map((x) => x / under[0]) };
}

const inverseSeries = (c, z) => c.reduce((sum, x, d) => {
  if (!d) return [sum[0] + x, sum[1]];
  const w = z.power(-d);
  return [sum[0] + x * w[0], sum[1] + x * w[1]];
}, [0, 0]);

class Sampled {
  // `channel(i, j)`: [N, Δ] from held signal j to sampled signal i; `filters`: one for each.
  constructor(channel, filters, period) {
    this.period = period;
    this.filters = filters;
    const q = filters.length;
    this.chains = Array.from({ length: q }, (_, i) =>
      Array.from({ length: q }, (_, j) => new Chain(...channel(i, j), period)));
  }

  // I − P F restricted to the rows and columns from `first`, and the column of P that drives it.
  equations(z, first) {
    const F = this.filters.map(({ b, a }) => cdiv(inverseSeries(b, z), inverseSeries(a, z)));
    const P = this.chains.map((row) => row.map((chain) => chain.at(z)));
    const index = F.map((_, i) => i).filter((i) => i >= first);
    const matrix = index.map((i) => index.map((j) => csub([i === j ? 1 : 0, 0], cmul(P[i][j], F[j]))));
    return { P, F, matrix };
  }

  // L(z) of the return difference 1 + L, broken at the hold.
  L(z) {
    const { P, F, matrix } = this.equations(z, 1);
    let sum = P[0][0];
    if (matrix.length) {
      const { x } = solvedComplex(matrix, P.slice(1).map((row) => row[0]));
      x.forEach((value, j) => { sum = cadd(sum, cmul(cmul(P[0][j + 1], F[j + 1]), value)); });
    }
    return [-sum[0], -sum[1]];
  }

  // The closed loop's poles on or outside the unit circle; NaN where one is on it.
  get unstable() {
    let size = 0;
    const own = [];
    this.chains.flat().forEach((chain) => {
      size += chain.n + chain.longest;
      if (chain.n) own.push(chain);
    });
    this.filters.forEach(({ a, b }) => { size += a.length + b.length; });
    const hidden = own.reduce((sum, chain) => sum + chain.hidden, 0);
    const marginal = own.filter((chain) => outside(chain) > chain.hidden);
    if (marginal.length > 1)
      throw new NoAnswer("Several ways round this sampled loop integrate or are unstable; see the report's numbers.");
    const f = (angle) => {
      const z = new Polar(1 - 1e-12, angle);
      let value = solvedComplex(this.equations(z, 0).matrix, this.filters.map(() => [0, 0])).det;
      own.forEach((chain) => { value = cmul(value, chain.characteristic(z)); });
      this.filters.forEach(({ a }) => { value = cmul(value, inverseSeries(a, z)); });
      return value;
    };
    const turned = turnOf((u) => f(Math.PI * 1e-9 + u), Math.PI * (1 - 2e-9), () => 0.8 / size);
    // f is a polynomial in 1/z: going round by rising angle it turns back once for each zero outside.
    return turned === null ? NaN : Math.round(-turned / Math.PI) - hidden;
  }

  margins() {
    const top = Math.PI / this.period;
    const L = (w) => this.L(new Polar(1, w * this.period));
    let low = 1e-4 * top;
    for (let i = 0; i < 4; i++) {
      const [a, b] = [L(low), L(low / 2)].map((v) => Math.hypot(...v));
      const power = Math.round(Math.log2(b / a));
      if (power > 0) low = Math.min(low, 0.01 * low * Math.pow(a, 1 / power));
      if (low < 1e-8 * top) { low = 1e-8 * top; break; }
    }
    const unstable = this.unstable;
    const late = Math.max(...this.chains.flat().map((chain) => chain.longest)) * this.period;
    const band = sampledBand(L, low, top * (1 - 1e-12), late);
    const end = this.L(new Polar(1, Math.PI));
    const start = this.L(new Polar(1, 0));
    const limits = [start, [end[0], 0]].map((v) => (Number.isFinite(v[0]) && Math.abs(v[0]) < 1e9 ? [v[0], 0] : null));
    const found = marginsOf(L, band, limits, unstable === 0);
    const crossings = found.phase_crossings.filter(([w]) => w < top * (1 - 1e-9) || w === Infinity);
    const factors = crossings.map(([, f]) => f);
    found.phase_crossings = crossings.map(([w, f]) => [Math.min(w, top), f]);
    found.gain = Math.min(...factors.filter((f) => f > 1));
    found.gain_down = Math.max(0, ...factors.filter((f) => f < 1));
    if (unstable === 0 && Math.abs(end[0]) >= 1) found.delay = Math.min(found.delay, this.period);
    return { ...found, unstable, stable: unstable === 0 };
  }

  // y[k] of samples u[k] of an input: `into[i]` are the ways from it to the sampled signals, `out`
  // the one to the output, `ways[j]` those from the held signals to the output.
  run(into, out, ways, u) {
    const q = this.filters.length;
    const live = [];
    const started = (chain) => { live.push({ chain, x: [], u: [] }); return live[live.length - 1]; };
    const loop = this.chains.map((row) => row.map(started));
    const [drive, direct, shown] = [into.map(started), started(out), ways.map(started)];
    const asked = this.filters.map(() => []);
    const held = this.filters.map(() => []);
    const y = [];
    for (let k = 0; k < u.length; k++) {
      live.forEach((one) => one.x.push(k ? stepped(one, k) : new Array(one.chain.n).fill(0)));
      drive.forEach((one) => one.u.push(u[k]));
      direct.u.push(u[k]);
      // a = past + D h and h = b₀ a + past: what acts at once is solved for.
      const past = loop.map((row, i) =>
        row.reduce((sum, one) => sum + output(one, k, false), output(drive[i], k, true)));
      const kept = this.filters.map(({ b, a }, j) => {
        let sum = 0;
        for (let d = 1; d < b.length && d <= k; d++) sum += b[d] * asked[j][k - d];
        for (let d = 1; d < a.length && d <= k; d++) sum -= a[d] * held[j][k - d];
        return sum;
      });
      const D = loop.map((row) => row.map((one) => one.chain.direct));
      const right = past.map((value, i) => D[i].reduce((sum, x, j) => sum + x * kept[j], value));
      const matrix = D.map((row, i) => row.map((x, j) => (i === j ? 1 : 0) - x * this.filters[j].b[0]));
      solved(matrix, right).forEach((value, i) => asked[i].push(value));
      for (let j = 0; j < q; j++) {
        held[j].push(kept[j] + this.filters[j].b[0] * asked[j][k]);
        loop.forEach((row) => row[j].u.push(held[j][k]));
        shown[j].u.push(held[j][k]);
      }
      y.push(shown.reduce((sum, one) => sum + output(one, k, true), output(direct, k, true)));
    }
    return y;
  }
}

// How many poles of a chain are on or outside the unit circle.
function outside(chain) {
  const f = (angle) => chain.characteristic(new Polar(1 - 1e-7, angle));
  const turned = turnOf(f, Math.PI, () => 0.5 / (1 + chain.n));
  return turned === null ? chain.n : Math.round(-turned / Math.PI);
}

function stepped({ chain, x, u }, k) {
  const last = x[k - 1];
  return chain.A.map((row, i) => {
    let sum = chain.B[i] * u[k - 1];
    for (let j = 0; j < chain.n; j++) sum += row[j] * last[j];
    return sum;
  });
}

function output({ chain, x, u }, k, whole) {
  let sum = 0;
  for (const [d, { C, D }] of chain.taps) {
    if (d > k) continue;
    for (let i = 0; i < chain.n; i++) sum += C[i] * x[k - d][i];
    if (d || whole) sum += D * u[k - d];
  }
  return sum;
}

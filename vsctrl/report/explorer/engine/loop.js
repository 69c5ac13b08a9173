// A loop as data from Python, and its numbers at any values of its parameters.

class Loop {
  constructor(data) {
    const side = (terms) => terms.map(([k, late, tree]) => [k, late, compiled(tree)]);
    this.data = data;
    this.delays = data.delays.map(compiled);
    this.blocks = data.blocks.map(({ num, den }) => ({ num: side(num), den: side(den) }));
  }

  // The loop at values of its parameters, an object of numbers in SI by their names.
  at(values) {
    return new LoopAt(this, { ...this.data.values, ...values });
  }
}

class LoopAt {
  constructor(loop, values) {
    this.loop = loop;
    this.values = values;
    this.blocks = blocksAt(loop, values);
    this.kept = new Map();
  }

  // What was worked out once for these values.
  once(name, make) {
    if (!this.kept.has(name)) this.kept.set(name, make());
    return this.kept.get(name);
  }

  channel([num, den]) {
    return [multipliedOut(num, this.blocks), multipliedOut(den, this.blocks)];
  }

  // N and Δ of L = N/Δ.
  get opened() {
    return this.once("opened", () => {
      const [N, D] = this.channel(this.loop.data.loop);
      return [plus([], N, -1), D];
    });
  }

  // L(jω) as [re, im].
  L(w) {
    const [N, D] = this.opened;
    return cdiv(valueAt(N, 0, w), valueAt(D, 0, w));
  }

  // The roots of the closed loop right of the imaginary axis; NaN where one is on it.
  get unstable() {
    return this.once("unstable", () => {
      const [N, D] = this.opened;
      return unstableRoots(plus(D, N)) - hiddenAtZero(N, D);
    });
  }

  get margins() {
    return this.once("margins", () => {
      const [N, D] = this.opened;
      const unstable = this.unstable;
      const stable = unstable === 0;
      if (!N.length)
        return { gain: Infinity, gain_down: 0, phase: Infinity, delay: Infinity, peak_sensitivity: 1,
          peak_frequency: 0, gain_crossings: [], phase_crossings: [], unstable, stable };
      const band = this.band;
      const L = (w) => this.L(w);
      const start = atZero(N, D);
      const fall = degree(D) - degree(N);
      const limits = [
        start.power < 0 ? null : [start.power ? 0 : start.factor, 0],
        fall ? [0, 0] : [leading(N) / leading(D), 0],
      ];
      const found = marginsOf(L, band, limits, stable);
      if (fall && (found.gain === Infinity || found.peak_sensitivity < 1 / (1 - LEAST)))
        this.beyond(found, band[band.length - 1][0]);
      if (stable && !fall && Math.abs(limits[1][0]) >= 1 - EDGE) found.delay = 0;
      return { ...found, unstable, stable };
    });
  }

  // Samples of L in the band where it matters.
  get band() {
    return this.once("band", () => {
      const [N, D] = this.opened;
      const fall = degree(D) - degree(N);
      if (fall < 0) throw new NoAnswer("L grows with the frequency: a filter is missing in the loop.");
      if (!fall && [...N, ...D].some(({ tau }) => tau))
        throw new NoAnswer("L lets high frequencies through a delay, which the explorer does not follow.");
      const rates = [...corners(N), ...corners(D)].filter((x) => x > 0 && x < Infinity);
      let low = 1e-3 * Math.min(...rates, 1e3);
      let high = 10 * Math.max(...rates, 1e-3);
      if (!rates.length) [low, high] = [1e-3, 10];
      const start = atZero(N, D);
      if (start.power) low = Math.min(low, 1e-2 * Math.pow(Math.abs(start.factor), -1 / start.power));
      const late = [...N, ...D].reduce((most, { tau }) => Math.max(most, tau), 0);
      for (let i = 0; fall && i < 40 && Math.hypot(...this.L(high)) > LEAST; i++) high *= 1.5;
      return sampledBand((w) => this.L(w), low, high, late);
    });
  }

  // The gain margin and the peak where no crossing and no peak within the band are beyond doubt:
  // both are looked for in ever longer stretches, until |L| is nowhere large enough beyond. Where
  // delays nearly cancel it ripples far out.
  beyond(found, start) {
    const [N, D] = this.opened;
    const late = [...N, ...D].reduce((most, { tau }) => Math.max(most, tau), 0);
    const L = (w) => this.L(w);
    for (let from = start, i = 0; i < (late ? 8 : 12); i++) {
      const matters = Math.min(1 / found.gain, 1 - 1 / found.peak_sensitivity);
      let most = 0;
      for (let k = 0; k <= 2000; k++) most = Math.max(most, Math.hypot(...L(from * (1 + k / 2000))));
      if (found.gain < Infinity && (!late || most <= matters)) break;
      const to = late ? from + (4 * Math.PI * 2 ** i) / late : from * 10;
      const band = sampledBand(L, from, to, late);
      const factors = phaseCrossings(L, band).map(([, factor]) => factor);
      found.gain = Math.min(found.gain, ...factors.filter((f) => f >= 1));
      const [w, peak] = peakOf(L, band.map((point) => point[0]), band, [null, null]);
      if (peak > found.peak_sensitivity) Object.assign(found, { peak_sensitivity: peak, peak_frequency: w });
      from = to;
    }
  }

  // Where the loop would become unstable (or stable again) if one parameter were moved alone: from
  // a stable loop the next value above, from an unstable one the next below; Infinity for none.
  limit(name, unstable = (at) => at.unstable) {
    const value = this.values[name];
    const at = (x) => {
      try { return unstable(this.loop.at({ ...this.values, [name]: x })); } catch { return NaN; }
    };
    const stable = at(value) === 0;
    if (!(value > 0)) return NaN;
    const ratio = stable ? 1.25 : 0.8;
    let inner = value;
    for (let i = 0; i < 40; i++) {
      let outer = inner * ratio;
      if ((at(outer) === 0) !== stable) {
        for (let k = 0; k < 60 && Math.abs(outer - inner) > 1e-15 * outer; k++) {
          const middle = (inner + outer) / 2;
          if ((at(middle) === 0) === stable) inner = middle; else outer = middle;
        }
        return (inner + outer) / 2;
      }
      inner = outer;
    }
    return stable ? Infinity : NaN;
  }

  // The limit by way of the margins where L is proportional to the parameter, as to a gain.
  gainLimit(name) {
    if (!this.isGain(name)) return this.limit(name);
    return this.limitOf(this.margins, name, (at) => at.unstable);
  }

  sampledLimit(name) {
    const own = (at) => at.sampled.unstable;
    if (!this.isGain(name)) return this.limit(name, own);
    return this.limitOf(this.sampledMargins, name, own);
  }

  limitOf(margins, name, unstable) {
    const value = this.values[name];
    if (margins.stable) return value * margins.gain;
    const lower = margins.phase_crossings.map(([, f]) => f).filter((f) => f < 1).sort((a, b) => b - a);
    for (const factor of lower) {
      const below = this.loop.at({ ...this.values, [name]: value * factor * (1 - 1e-6) });
      if (unstable(below) === 0) return value * factor;
    }
    return NaN;
  }

  isGain(name) {
    return this.once(`gain ${name}`, () => {
      const other = this.loop.at({ ...this.values, [name]: 1.5 * this.values[name] });
      return [0.37, 2.9].every((w) => {
        const rate = w / (this.values[this.loop.data.scale] || 1);
        const [a, b] = [this.L(rate), other.L(rate)];
        return Math.hypot(b[0] - 1.5 * a[0], b[1] - 1.5 * a[1]) < 1e-9 * Math.hypot(...a);
      });
    });
  }

  // The response of shown channel `index` to tᵖ/p!.
  response(index, power, horizon) {
    return this.once(`response ${index} ${power} ${horizon}`, () =>
      new Response(...this.channel(this.loop.data.shown[index].channel), power, horizon));
  }

  // (H − 1)/s at s = 0 of a channel H: the steady error behind a ramp of slope 1; ±Infinity.
  rampError(index) {
    const [N, D] = this.channel(this.loop.data.shown[index].channel);
    const [n, d] = [taylor(N, 2), taylor(D, 2)];
    if (!d[0]) return NaN;
    const gap = n[0] / d[0] - 1;
    if (Math.abs(gap) > 1e-12) return gap * Infinity;
    return (n[1] - d[1]) / d[0];
  }

  get sampled() {
    return this.once("sampled", () => {
      const { sampled } = this.loop.data;
      const period = this.values[sampled.period];
      const filters = sampled.filters.map((one) =>
        one ? discretised(this.blocks[one.block], one.method, period) : { a: [1], b: [1] });
      return new Sampled((i, j) => this.channel(sampled.loop[i][j]), filters, period);
    });
  }

  get sampledMargins() {
    return this.once("sampled margins", () => this.sampled.margins());
  }

  // The samples of a shown channel to tᵖ/p!, from t = 0.
  sampledResponse(index, power, count) {
    return this.once(`samples ${index} ${power} ${count}`, () => {
      const { sampled } = this.loop.data;
      const period = this.values[sampled.period];
      const u = Array.from({ length: count }, (_, k) => (power ? k * period : 1));
      const chain = (pair) => new Chain(...this.channel(pair), period);
      const { into, out, ways } = sampled.shown[index];
      return this.sampled.run(into.map(chain), chain(out), ways.map(chain), u);
    });
  }
}

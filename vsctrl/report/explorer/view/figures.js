// The figures that follow the sliders: Bode, Nyquist, step and ramp.

const TURN = 180 / Math.PI;

class Bode {
  constructor(parent, range) {
    const x = { ...range, log: true, label: "ω, rad/s" };
    this.size = new Plot(parent, { title: "|L|", height: 210, x, y: { low: 1e-3, high: 1e2, log: true, label: "" } });
    this.phase = new Plot(parent, { title: "phase of L", height: 210, x,
      y: { low: -360, high: 0, label: "degrees", ticks: [-360, -270, -180, -90, 0] } });
    this.range = range;
  }

  // `between`: frequencies (rad/s) at which L bends, beside those that are drawn anyway.
  draw(L, twin, period, between) {
    this.one("one", L, this.range.high, between);
    if (twin) this.one("two", twin, Math.min(this.range.high, Math.PI / period), []);
    this.size.curve("mark", [[this.range.low, 1], [this.range.high, 1]]);
    this.phase.curve("mark", [[this.range.low, -180], [this.range.high, -180]]);
  }

  one(name, L, high, between) {
    const size = [];
    const phase = [];
    let last = null;
    let turned = 0;
    for (const w of frequencies(this.range.low, high, between)) {
      const value = L(w);
      if (last) turned += angleBetween(last, value);
      else turned = startOf(value);
      last = value;
      size.push([w, Math.hypot(value[0], value[1])]);
      phase.push([w, turned * TURN]);
    }
    this.size.curve(name, size);
    this.phase.curve(name, phase);
  }

  describe(margins) {
    const at = margins.gain_crossings[0];
    this.size.describe(`Bode plot: |L| over the frequency; gain margin ${shown(margins.gain)}.`);
    this.phase.describe(`Bode plot: phase of L over the frequency; phase margin ${shown(margins.phase * TURN)} degrees` +
      (at ? ` at ${shown(at[0])} rad/s.` : "."));
  }
}

// From low to high, evenly on a logarithmic axis, and those between.
function frequencies(low, high, between) {
  const out = between.filter((w) => w > low && w < high);
  for (let i = 0; i <= 200; i++) out.push(low * Math.pow(high / low, i / 200));
  return out.sort((a, b) => a - b);
}

// The phase at the left end, between −270° and 90°.
function startOf(value) {
  const angle = Math.atan2(value[1], value[0]);
  return angle > Math.PI / 2 + 1e-9 ? angle - 2 * Math.PI : angle;
}

class Nyquist {
  constructor(parent) {
    this.plot = new Plot(parent, { title: "Nyquist plot of L", height: 320,
      x: { low: -2.4, high: 1.2, label: "real part" }, y: { low: -1.4, high: 1.1, label: "imaginary part" } });
    const circle = [];
    for (let i = 0; i <= 90; i++) circle.push([Math.cos(i * Math.PI / 45), Math.sin(i * Math.PI / 45)]);
    this.plot.curve("mark", circle);
    made("circle", { cx: this.plot.px(-1), cy: this.plot.py(0), r: 4, class: "critical" }, this.plot.inside);
    made("text", { x: this.plot.px(-1) - 8, y: this.plot.py(0) - 8, "text-anchor": "end" }, this.plot.inside, "−1");
  }

  draw(L, twin, range, period, between) {
    this.plot.curve("one", frequencies(range.low, range.high, between).map(L));
    const high = Math.min(range.high, Math.PI / period);
    if (twin) this.plot.curve("two", frequencies(range.low, high, []).map(twin));
  }

  describe(margins) {
    this.plot.describe(`Nyquist plot of L: it passes −1 at a distance of ${shown(1 / margins.peak_sensitivity)}.`);
  }
}

// A response over time: continuous as a line, samples held between the instants.
class Course {
  constructor(parent, { title, horizon, unit, factor, tracks, size, scale, label, level }) {
    Object.assign(this, { horizon, factor, tracks, size, scale, level });
    this.title = title;
    this.plot = new Plot(parent, { title, height: 230,
      x: { low: 0, high: horizon / factor, label: `t, ${unit}` }, y: { low: 0, high: 1, label } });
  }

  draw(response, samples, period, power) {
    const ref = (t) => (this.tracks ? (power ? t : 1) : 0);
    const line = [];
    for (let i = 0; response && i <= 240; i++) {
      const t = (this.horizon * i) / 240;
      line.push([t / this.factor, this.scale * (response.at(t) - ref(t))]);
    }
    const stairs = (samples ?? []).map((y, k) => [(k * period) / this.factor, this.scale * (y - ref(k * period))]);
    this.fit([...line, ...stairs].map(([, y]) => y));
    this.plot.curve("one", line);
    this.plot.curve("two", stairs, { stairs: true });
    this.plot.curve("mark", [[0, this.goal], [this.horizon / this.factor, this.goal]]);
  }

  // Axes that hold what settles; what runs away is cut, not shown as a wall.
  fit(values) {
    const sorted = values.filter(Number.isFinite).sort((a, b) => a - b);
    const cut = Math.max(3 * this.size, 1e-12);
    const low = Math.max(Math.min(this.goal, sorted[0] ?? 0), this.goal - cut);
    const high = Math.min(Math.max(this.goal, sorted[sorted.length - 1] ?? 1), this.goal + cut);
    const room = 0.08 * Math.max(high - low, 1e-9 * cut, this.size * 1e-3);
    this.cut = sorted.length > 0 && (sorted[0] < low - room || sorted[sorted.length - 1] > high + room);
    Object.assign(this.plot.y, { low: low - room, high: high + room });
    this.plot.axes();
  }

  get goal() { return this.level ?? 0; }

  describe(words) { this.plot.describe(`${this.title}: ${words}${this.cut ? " It runs off the axes." : ""}`); }
}

// One explorer: its controls on one side, what they do to the loop on the other.

const WORDS = {
  gain: ["gain margin", (m) => (m.gain < Infinity ? `× ${shown(m.gain)}` : "no limit")],
  phase: ["phase margin", (m) => (m.phase < Infinity ? `${shown(m.phase * TURN)}°` : "no limit")],
  delay: ["delay margin", (m, factor, unit) => (m.delay < Infinity ? `${shown(m.delay / factor)} ${unit}` : "no limit")],
  peak: ["peak of |1/(1 + L)|", (m) => shown(m.peak_sensitivity)],
};

class Explorer {
  constructor(root) {
    this.root = root;
    this.data = JSON.parse(root.querySelector("script").textContent);
    this.loop = new Loop(this.data.model);
    this.start = { ...this.data.model.values };
    this.sampled = Boolean(this.data.model.sampled);
    this.layout();
    const given = Address.read(root.id);
    if (given) {
      this.sliders.forEach((one) => { if (given[one.key] !== undefined) one.set(given[one.key]); });
      root.scrollIntoView();
    }
    root.hidden = false;
    this.draw();
    addEventListener("hashchange", () => this.follow());
  }

  // Take the values of an address that was opened while the page was there.
  follow() {
    const given = Address.read(this.root.id);
    if (!given) return;
    this.sliders.forEach((one) => one.set(given[one.key] ?? one.initial));
    this.draw();
  }

  layout() {
    const { data, root } = this;
    const box = made("div", { class: "controls", id: `${root.id}-controls`, role: "group", "aria-label": "Numbers to move" }, root);
    const changed = () => this.changed();
    this.sliders = data.sliders.map((spec) => new Slider(box, spec, changed));
    this.named = new Map(this.sliders.map((one) => [one.key, one]));
    const reset = made("button", { type: "button", class: "reset" }, box, "Reset");
    reset.addEventListener("click", () => {
      this.sliders.forEach((one) => one.set(one.initial));
      this.changed();
    });
    this.said = made("p", { class: "said", role: "status" }, root);
    this.table = made("div", { class: "numbers" }, root);
    if (this.sampled) {
      const key = made("p", { class: "key" }, root);
      for (const [name, words] of [["one", "continuous in time"], ["two", "sampled, held over the period"]]) {
        const mark = made("svg", { viewBox: "0 0 30 8", width: 30, height: 8, "aria-hidden": "true" }, key);
        made("path", { d: "M0 4H30", class: name }, mark);
        made("span", {}, key, ` ${words} `);
      }
    }
    const figures = made("div", { class: "figures" }, root);
    const cell = () => made("div", {}, figures);
    const chart = data.chart && data.chart.map((key) => this.named.get(key));
    if (chart) this.chart = new Chart(cell(), ...chart, (x, y) => {
      chart[0].set(x);
      chart[1].set(y);
      this.changed();
    });
    this.nyquist = new Nyquist(cell());
    this.bode = new Bode(cell(), data.range);
    const courses = cell();
    const common = { horizon: data.horizon, unit: data.time.unit, factor: data.time.factor };
    this.courses = data.model.shown.length ? [
      new Course(courses, { ...common, title: `Step of 1 in ${data.model.shown[0].input}`, label: data.model.shown[0].output,
        tracks: false, size: 1, scale: 1, level: data.ramp.tracks ? 1 : 0 }),
      new Course(courses, { ...common, title: data.ramp.title, label: data.ramp.label,
        tracks: data.ramp.tracks, size: data.ramp.size, scale: data.ramp.scale }),
    ] : [];
    if (data.challenges) this.layoutChallenges();
  }

  layoutChallenges() {
    const box = made("div", { class: "challenges" }, this.root);
    made("p", { class: "title" }, box, "Three to try");
    const list = made("ol", {}, box);
    this.challenges = CHALLENGES.filter((one) => one.applies(this.start)).map((one) => {
      const item = made("li", {}, list, one.text);
      return { one, why: made("p", { class: "why", role: "status" }, item) };
    });
  }

  get values() {
    return { ...this.start, ...Object.fromEntries(this.sliders.map((one) => [one.key, one.value])) };
  }

  // Drawn once a frame, however often the sliders report.
  changed() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
      Address.write(this.root.id, this.sliders);
    });
  }

  // A question's answer; what the engine cannot answer is kept as a sentence.
  asked(make) {
    try { return make(); } catch (error) {
      if (!(error instanceof NoAnswer)) throw error;
      this.refused ??= error.message;
      return null;
    }
  }

  draw() {
    this.refused = null;
    this.at = this.asked(() => this.loop.at(this.values));
    if (!this.at) { this.say([this.refused]); return; }
    const { at, data } = this;
    const period = this.sampled ? at.values[data.model.sampled.period] : null;
    const margins = this.asked(() => at.margins);
    const twin = this.sampled ? this.asked(() => at.sampled) : null;
    const twins = twin && this.asked(() => at.sampledMargins);
    const L = (w) => at.L(w);
    const sampledL = twin && ((w) => twin.L(new Polar(1, w * period)));
    const between = margins ? at.band.map((point) => point[0]) : [];
    this.bode.draw(L, sampledL, period, between);
    this.nyquist.draw(L, sampledL, data.range, period, between);
    if (margins) { this.bode.describe(margins); this.nyquist.describe(margins); }
    this.courses.forEach((course, power) => {
      const response = this.asked(() => at.response(0, power, data.horizon));
      const count = period ? Math.floor(data.horizon / period + 1e-9) + 1 : 0;
      const samples = twin && count < 4000 ? this.asked(() => at.sampledResponse(0, power, count)) : null;
      course.draw(response, samples, period, power);
      course.describe(response ? `the last value is ${shown(response.at(data.horizon))}.` : "no answer.");
    });
    this.tabulate(margins, twins);
    this.say(this.verdict(margins, twins));
    this.judge();
    if (this.chart) {
      this.chart.place(at.values);
      const kinds = [{ class: "one", unstable: (x) => x.unstable }];
      if (twin) kinds.push({ class: "two", unstable: (x) => x.sampled.unstable });
      this.chart.update(this.loop, at.values, (this.kinds ??= kinds));
      this.chart.plot.describe(`Stability chart; ${this.chart.point.getAttribute("aria-label")}`);
    }
  }

  verdict(margins, twins) {
    const out = [];
    const state = (m) => (m.stable ? "stable" : Number.isNaN(m.unstable) ? "on the edge of stability"
      : `unstable (${m.unstable} root${m.unstable === 1 ? "" : "s"})`);
    if (margins && twins && margins.stable !== twins.stable)
      out.push(`In continuous time it is ${state(margins)}, but sampled ${state(twins)}.`);
    else if (margins ?? twins) out.push(`It is ${state(margins ?? twins)}${margins && twins ? ", and so it is as sampled" : ""}.`);
    if (this.data.ramp.steady) {
      const error = this.asked(() => this.at.rampError(0));
      if (margins?.stable && Number.isFinite(error)) {
        const mm = 1e3 * SPEED * error;
        out.push(Math.abs(mm) < 0.005 ? "On a reference that moves at 4 cm/s the camera is where it should be."
          : `On a reference that moves at 4 cm/s the camera is ${shown(Math.abs(mm), 3)} mm ${mm > 0 ? "ahead" : "behind"}.`);
      }
    }
    if (this.refused) out.push(this.refused);
    return out;
  }

  say(sentences) {
    const text = sentences.join(" ");
    if (this.said.textContent !== text) this.said.textContent = text;
    this.said.classList.toggle("bad", text.includes("unstable"));
  }

  tabulate(margins, twins) {
    const first = this.sliders[0];
    const { unit, factor } = this.data.time;
    const limits = [
      margins && this.asked(() => this.at.gainLimit(first.key)),
      twins && this.asked(() => this.at.sampledLimit(first.key)),
    ];
    const both = [margins, ...(this.sampled ? [twins] : [])];
    const cell = (m, text) => `<td>${m ? (m.stable ? text(m) : "–") : "?"}</td>`;
    const rows = Object.values(WORDS).map(([name, text]) =>
      `<tr><th scope="row">${name}</th>${both.map((m) => cell(m, (x) => text(x, factor, unit))).join("")}</tr>`);
    const limit = both.map((m, i) => `<td>${m && limits[i] !== null ? (limits[i] < Infinity ? first.text(limits[i]) : limits[i] === Infinity ? "no limit" : "–") : "?"}</td>`);
    const head = `<tr><th scope="col">closed loop</th><th scope="col">continuous</th>${this.sampled ? '<th scope="col">sampled</th>' : ""}</tr>`;
    const body = `<thead>${head}</thead><tbody>${rows.join("")}<tr><th scope="row"></th>${limit.join("")}</tr></tbody>`;
    const table = made("table");
    table.innerHTML = body;
    table.tBodies[0].rows[rows.length].cells[0].textContent = `stable up to ${first.name}`;
    this.table.replaceChildren(table);
  }

  judge() {
    (this.challenges ?? []).forEach(({ one, why }) => {
      const text = this.asked(() => one.solved(this.at, this.start)) ?? "";
      if (why.textContent !== text) why.textContent = text;
      why.parentElement.classList.toggle("solved", Boolean(text));
    });
  }
}

const explorers = [...document.querySelectorAll("[data-explorer]")].map((root) => new Explorer(root));
globalThis.vsctrl = Object.freeze({ Loop, Polar, explorers });

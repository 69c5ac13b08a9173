// Where the loop is stable over two parameters, worked out a row at a time while nothing else waits,
// and the point that can be dragged in it.

const ROWS = 36;
const COLUMNS = 24;

class Chart {
  constructor(parent, x, y, moved) {
    const axis = (s) => ({ low: s.low / s.factor, high: s.high / s.factor, log: s.log, label: s.unit ? `${s.name}, ${s.unit}` : s.name });
    this.x = x;
    this.y = y;
    this.frame = made("div", { class: "chart" }, parent);
    const yAxis = axis(y);
    this.plot = new Plot(this.frame, { title: "Where it is stable", height: 320, x: axis(x), y: yAxis });
    this.point = made("button", { type: "button", class: "point" }, this.frame);
    this.moved = moved;
    this.listen();
  }

  listen() {
    const at = (event) => {
      const { left, top, width } = this.plot.svg.getBoundingClientRect();
      const zoom = this.plot.width / width;
      this.moved(
        this.plot.valueAtX((event.clientX - left) * zoom) * this.x.factor,
        this.plot.valueAtY((event.clientY - top) * zoom) * this.y.factor);
    };
    this.frame.addEventListener("pointerdown", (event) => {
      this.frame.setPointerCapture(event.pointerId);
      this.dragging = true;
      at(event);
      this.point.focus();
      event.preventDefault();
    });
    this.frame.addEventListener("pointermove", (event) => { if (this.dragging) at(event); });
    for (const end of ["pointerup", "pointercancel"])
      this.frame.addEventListener(end, () => { this.dragging = false; });
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    this.point.addEventListener("keydown", (event) => {
      const step = steps[event.key];
      if (!step) return;
      event.preventDefault();
      const scale = event.shiftKey ? 40 : 8;
      this.moved(this.x.moved(step[0] * scale), this.y.moved(step[1] * scale));
    });
  }

  place(values) {
    const [a, b] = [values[this.x.key] / this.x.factor, values[this.y.key] / this.y.factor];
    const { left, right, top, bottom } = this.plot.box;
    const u = Math.max(left, Math.min(right, this.plot.px(a)));
    const v = Math.max(top, Math.min(bottom, this.plot.py(b)));
    this.point.style.left = `${(100 * u) / this.plot.width}%`;
    this.point.style.top = `${(100 * v) / this.plot.height}%`;
    this.point.setAttribute("aria-label",
      `Operating point: ${this.x.words(values[this.x.key])}, ${this.y.words(values[this.y.key])}. Arrow keys move it.`);
  }

  // Begin anew where the parameters that the axes do not show have changed.
  update(loop, values, kinds) {
    const rest = { ...values, [this.x.key]: 0, [this.y.key]: 0 };
    const key = JSON.stringify(rest);
    if (key === this.key) return;
    this.key = key;
    clearTimeout(this.timer);
    const queue = [];
    for (const kind of kinds) for (let r = 0; r <= ROWS; r++) queue.push([kind, r]);
    const rows = new Map(kinds.map((kind) => [kind, []]));
    const work = () => {
      const begun = performance.now();
      while (queue.length && performance.now() - begun < 8) {
        const [kind, r] = queue.shift();
        rows.get(kind)[r] = this.row(loop, values, kind, this.y.at(r / ROWS));
        if (r === ROWS) this.fill(kind.class, rows.get(kind));
      }
      this.done = !queue.length;
      if (queue.length) this.timer = setTimeout(work, 4);
    };
    this.done = false;
    this.timer = setTimeout(work, 120);
  }

  // The stretches [from, to] of x over which the loop is stable at one y.
  row(loop, values, kind, y) {
    const stable = (x) => {
      try { return kind.unstable(loop.at({ ...values, [this.x.key]: x, [this.y.key]: y })) === 0; } catch { return false; }
    };
    const edge = (a, b, at) => {
      for (let i = 0; i < 9; i++) { const m = (a + b) / 2; if (stable(m) === at) a = m; else b = m; }
      return (a + b) / 2;
    };
    const out = [];
    let before = null;
    for (let i = 0; i <= COLUMNS; i++) {
      const x = this.x.at(i / COLUMNS);
      const now = stable(x);
      if (now && before === null) out.push([x, x]);
      if (before !== null && now !== before.now) {
        const at = edge(before.x, x, before.now);
        if (now) out.push([at, x]); else out[out.length - 1][1] = at;
      }
      if (now) out[out.length - 1][1] = x;
      before = { x, now };
    }
    return out;
  }

  fill(name, rows) {
    let area = "";
    let edges = "";
    const px = (x) => this.plot.px(x / this.x.factor).toFixed(2);
    const py = (r) => this.plot.py(this.y.at(r / ROWS) / this.y.factor).toFixed(2);
    for (let r = 0; r < ROWS; r++) {
      const [a, b] = [rows[r], rows[r + 1]];
      const [u, v] = [py(r), py(r + 1)];
      if (a.length !== b.length) continue;
      a.forEach(([from, to], i) => {
        area += `M${px(from)} ${u}L${px(to)} ${u}L${px(b[i][1])} ${v}L${px(b[i][0])} ${v}Z`;
        if (to < this.x.high) edges += `M${px(to)} ${u}L${px(b[i][1])} ${v}`;
        if (from > this.x.low) edges += `M${px(from)} ${u}L${px(b[i][0])} ${v}`;
      });
    }
    this.plot.shape(`area ${name}`, area);
    this.plot.shape(name, edges);
  }
}

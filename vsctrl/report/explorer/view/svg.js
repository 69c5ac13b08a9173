// Figures as SVG elements: axes once, curves as often as the numbers change.

const SVG = "http://www.w3.org/2000/svg";

function made(tag, attributes = {}, parent = null, text = "") {
  const html = ["svg", "g", "path", "text", "rect", "circle", "line", "clipPath", "defs"];
  const element = html.includes(tag) ? document.createElementNS(SVG, tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text) element.textContent = text;
  parent?.append(element);
  return element;
}

const minus = (text) => text.replace(/^-/, "−").replace("e-", "e−");

// Three to four digits, in plain decimals where that is short.
function shown(x, digits = 4) {
  if (x === Infinity) return "no limit";
  if (!Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  const rounded = +x.toPrecision(digits);
  return minus(size >= 1e5 || size < 1e-3 ? rounded.toExponential() : String(rounded));
}

// Round numbers from low to high, about `count` of them.
function ticks(low, high, count) {
  const raw = (high - low) / count;
  const power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = [1, 2, 2.5, 5, 10].map((x) => x * power).find((x) => x >= raw * 0.999);
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) out.push(+(k * step).toPrecision(12));
  return out;
}

// Powers of ten, and 2 and 5 times these where there would be few.
function decades(low, high) {
  const factors = high / low < 200 ? [1, 2, 5] : [1];
  const out = [];
  for (let k = Math.floor(Math.log10(low)) - 1; k <= Math.log10(high); k++)
    for (const f of factors) {
      const value = f * Math.pow(10, k);
      if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) out.push(+value.toPrecision(6));
    }
  return out;
}

// Axes in a box of 420 by `height`; `x`, `y`: {low, high, log, label, ticks}.
class Plot {
  constructor(parent, { title, height = 250, x, y }) {
    this.width = 420;
    this.height = height;
    this.box = { left: 52, right: 410, top: 28, bottom: height - 42 };
    this.x = x;
    this.y = y;
    this.svg = made("svg", { viewBox: `0 0 ${this.width} ${height}`, role: "img" }, parent);
    made("text", { x: this.box.left, y: 17, class: "title" }, this.svg, title);
    this.grid = made("g", { class: "grid" }, this.svg);
    const id = `clip${Plot.number = (Plot.number ?? 0) + 1}`;
    const clip = made("clipPath", { id }, made("defs", {}, this.svg));
    const { left, right, top, bottom } = this.box;
    made("rect", { x: left, y: top, width: right - left, height: bottom - top }, clip);
    this.inside = made("g", { "clip-path": `url(#${id})` }, this.svg);
    this.curves = new Map();
    this.axes();
  }

  // x, y in the figure's own units, kept near the box so that no path is out of all bounds.
  px(value) { return this.place(value, this.x, this.box.left, this.box.right); }

  py(value) { return this.place(value, this.y, this.box.bottom, this.box.top); }

  place(value, axis, from, to) {
    const f = axis.log ? Math.log : (z) => z;
    const share = (f(value) - f(axis.low)) / (f(axis.high) - f(axis.low));
    return from + Math.max(-3, Math.min(4, share)) * (to - from);
  }

  valueAtX(px) { return this.value(px, this.x, this.box.left, this.box.right); }

  valueAtY(py) { return this.value(py, this.y, this.box.bottom, this.box.top); }

  value(p, axis, from, to) {
    const share = Math.max(0, Math.min(1, (p - from) / (to - from)));
    if (axis.log) return axis.low * Math.pow(axis.high / axis.low, share);
    return axis.low + share * (axis.high - axis.low);
  }

  axes() {
    const key = JSON.stringify([this.x, this.y]);
    if (key === this.drawn) return;
    this.drawn = key;
    this.grid.replaceChildren();
    const { left, right, top, bottom } = this.box;
    const tick = (axis, count) => axis.ticks ?? (axis.log ? decades(axis.low, axis.high) : ticks(axis.low, axis.high, count));
    for (const value of tick(this.x, 5)) {
      const at = this.px(value).toFixed(1);
      made("path", { d: `M${at} ${top}V${bottom}` }, this.grid);
      made("text", { x: at, y: bottom + 15, "text-anchor": "middle" }, this.grid, shown(value, 3));
    }
    for (const value of tick(this.y, 4)) {
      const at = this.py(value).toFixed(1);
      made("path", { d: `M${left} ${at}H${right}` }, this.grid);
      made("text", { x: left - 6, y: +at + 4, "text-anchor": "end" }, this.grid, shown(value, 3));
    }
    made("path", { d: `M${left} ${top}V${bottom}H${right}`, class: "frame" }, this.grid);
    made("text", { x: (left + right) / 2, y: bottom + 33, "text-anchor": "middle" }, this.grid, this.x.label);
    made("text", { x: right, y: 17, "text-anchor": "end" }, this.grid, this.y.label);
  }

  // A curve through points [x, y]; NaN breaks it; `stairs` holds each value to the next point.
  curve(name, points, { stairs = false } = {}) {
    if (!this.curves.has(name)) this.curves.set(name, made("path", { class: name }, this.inside));
    let d = "";
    let pen = false;
    for (const [x, y] of points) {
      if (!Number.isFinite(x) || Number.isNaN(y)) { pen = false; continue; }
      const [u, v] = [this.px(x).toFixed(2), this.py(y).toFixed(2)];
      d += pen ? (stairs ? `H${u}V${v}` : `L${u} ${v}`) : `M${u} ${v}`;
      pen = true;
    }
    this.curves.get(name).setAttribute("d", d);
  }

  shape(name, d) {
    if (!this.curves.has(name)) this.curves.set(name, made("path", { class: name }, this.inside));
    this.curves.get(name).setAttribute("d", d);
  }

  describe(text) { this.svg.setAttribute("aria-label", text); }
}

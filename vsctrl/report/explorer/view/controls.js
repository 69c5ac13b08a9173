// Sliders, each with its label, its value in words and its place in the address of the page.

const STEPS = 1000;

class Slider {
  // key, name, unit, factor (SI per unit shown), low, high, value (SI), log, meaning
  constructor(parent, spec, changed) {
    Object.assign(this, spec);
    this.initial = spec.value;
    const row = made("div", { class: "slider" }, parent);
    const id = `${parent.id}-${this.key}`;
    const label = made("label", { for: id }, row, this.name);
    if (this.meaning) made("span", { class: "meaning" }, label, ` ${this.meaning}`);
    this.input = made("input", { type: "range", id, min: 0, max: STEPS, step: 1 }, row);
    this.output = made("output", { for: id }, row);
    this.input.addEventListener("input", () => {
      this.set(this.at(this.input.value / STEPS));
      changed();
    });
    this.set(this.initial);
  }

  // The value at a share of the way, to four digits.
  at(share) {
    const { low, high, log } = this;
    const value = log ? low * Math.pow(high / low, share) : low + share * (high - low);
    return +(value / this.factor).toPrecision(4) * this.factor;
  }

  // Where a value stands between low and high.
  share(value) {
    const { low, high, log } = this;
    return log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  }

  // The value so many steps from here.
  moved(steps) {
    const share = Math.max(0, Math.min(1, this.share(this.value) + steps / STEPS));
    return steps ? this.at(share) : this.value;
  }

  set(value) {
    this.value = Math.max(this.low, Math.min(this.high, value));
    this.input.value = Math.round(this.share(this.value) * STEPS);
    this.output.textContent = this.text(this.value);
    this.input.setAttribute("aria-valuetext", this.text(this.value));
  }

  text(value) { return `${shown(value / this.factor)}${this.unit ? ` ${this.unit}` : ""}`; }

  words(value) { return `${this.name} ${this.text(value)}`; }
}

// The state in the page's address, #e1-explorer?lam=2.5&tau=0.08, which a link can carry.
const Address = {
  read(id) {
    const [name, query] = location.hash.slice(1).split("?");
    if (name !== id || !query) return null;
    const out = {};
    for (const [key, value] of new URLSearchParams(query))
      if (Number.isFinite(+value)) out[key] = +value;
    return out;
  },

  write(id, sliders) {
    const changed = sliders.filter((one) => one.value !== one.initial);
    const query = new URLSearchParams(changed.map((one) => [one.key, String(one.value)]));
    history.replaceState(null, "", changed.length ? `#${id}?${query}` : `#${id}`);
  },
};

// Quasi-polynomials Q(s) = Σ c sᵏ e^{−sτ}: a list of {tau, c}, c[k] the coefficient of sᵏ, by
// rising τ (s). A channel of the diagram is N/Δ, both sums of products of the blocks' own sides.

const CANCELS = 1e-12; // of the products that are added up, below which their sum is rounding

// The numerators and denominators of all blocks in numbers: lists of [k, tau, c].
function blocksAt(data, p) {
  const delays = data.delays.map((f) => f(p));
  delays.forEach((tau) => {
    if (!(tau >= 0)) throw new NoAnswer("A delay is negative here: that would predict the future.");
  });
  const side = (terms) => terms.map(([k, late, c]) => {
    const tau = late.reduce((sum, [i, n]) => sum + n * delays[i], 0);
    return [k, tau, c(p)];
  });
  return data.blocks.map(({ num, den }) => ({ num: side(num), den: side(den) }));
}

// N or Δ from its terms [factor, blocks whose numerator it holds], others giving their denominator.
function multipliedOut(form, blocks) {
  const sums = new Map();
  for (const [factor, held] of form.terms) {
    let product = [[0, 0, factor, Math.abs(factor)]];
    for (const i of form.used) {
      const side = held.includes(i) ? blocks[i].num : blocks[i].den;
      const next = [];
      for (const [k, tau, value, size] of product)
        for (const [m, late, c] of side)
          next.push([k + m, tau + late, value * c, size * Math.abs(c)]);
      product = next;
    }
    for (const [k, tau, value, size] of product) {
      const key = `${k} ${Math.round(tau * 1e13)}`; // equal delays, whatever order they were added in
      const sum = sums.get(key) ?? [k, tau, 0, 0];
      sums.set(key, [k, sum[1], sum[2] + value, sum[3] + size]);
    }
  }
  const byDelay = new Map();
  for (const [k, tau, value, size] of sums.values()) {
    if (!(Math.abs(value) > CANCELS * size)) continue;
    if (!Number.isFinite(value)) throw new NoAnswer("A block has no finite value at these numbers.");
    const key = Math.round(tau * 1e13);
    if (!byDelay.has(key)) byDelay.set(key, { tau, c: [] });
    byDelay.get(key).c[k] = value;
  }
  const parts = [...byDelay.values()].sort((a, b) => a.tau - b.tau);
  return parts.map(({ tau, c }) => ({ tau, c: Array.from(c, (x) => x ?? 0) }));
}

const degree = (Q) => Q.reduce((top, { c }) => Math.max(top, c.length - 1), -1);

// Q at s = x + jy as [re, im].
function valueAt(Q, x, y) {
  let re = 0;
  let im = 0;
  for (const { tau, c } of Q) {
    let a = 0;
    let b = 0;
    for (let k = c.length - 1; k >= 0; k--) [a, b] = [a * x - b * y + c[k], a * y + b * x];
    if (tau) {
      const size = Math.exp(-x * tau);
      const u = size * Math.cos(y * tau);
      const v = -size * Math.sin(y * tau);
      [a, b] = [a * u - b * v, a * v + b * u];
    }
    re += a;
    im += b;
  }
  return [re, im];
}

const plus = (P, Q, factor = 1) => {
  const out = P.map(({ tau, c }) => ({ tau, c: [...c] }));
  for (const { tau, c } of Q) {
    let own = out.find((part) => Math.abs(part.tau - tau) <= 1e-13 * Math.max(tau, 1));
    if (!own) out.push((own = { tau, c: [] }));
    c.forEach((x, k) => { own.c[k] = (own.c[k] ?? 0) + factor * x; });
    own.c = Array.from(own.c, (x) => x ?? 0);
  }
  return out.sort((a, b) => a.tau - b.tau).map(({ tau, c }) => ({ tau, c: trimmed(c) }))
    .filter(({ c }) => c.length);
};

function trimmed(c) {
  let end = c.length;
  while (end && c[end - 1] === 0) end--;
  return c.slice(0, end);
}

// The first `count` Taylor coefficients of Q at s = 0, and the sizes of what was added up to them.
function taylor(Q, count) {
  const value = new Array(count).fill(0);
  const size = new Array(count).fill(0);
  for (const { tau, c } of Q)
    for (let m = 0; m < count; m++) {
      let power = 1; // (−τ)^{m−k}/(m−k)!
      for (let k = m; k >= 0; k--) {
        if (c[k]) { value[m] += c[k] * power; size[m] += Math.abs(c[k] * power); }
        power *= -tau / (m - k + 1);
      }
    }
  return value.map((x, m) => (Math.abs(x) > 1e-11 * size[m] ? x : 0));
}

// N/Δ → factor · s^power as s → 0.
function atZero(N, D) {
  const count = degree(N) + degree(D) + 6;
  const num = taylor(N, count);
  const den = taylor(D, count);
  const n = num.findIndex((x) => x !== 0);
  const d = den.findIndex((x) => x !== 0);
  return n < 0 ? { power: 0, factor: 0 } : { power: n - d, factor: num[n] / den[d] };
}

// How many roots at 0 both sides have, as of a moving average: no signal shows them.
function hiddenAtZero(N, D) {
  const count = degree(N) + degree(D) + 6;
  const order = (Q) => taylor(Q, count).findIndex((x) => x !== 0);
  return N.length ? Math.max(0, Math.min(order(N), order(D))) : 0;
}

// The sizes of the corners of Q (rad/s): roots of its coefficients' ratios, and inverse delays.
function corners(Q) {
  const out = [];
  const top = degree(Q);
  const size = new Array(top + 1).fill(0);
  for (const { tau, c } of Q) {
    if (tau) out.push(1 / tau);
    c.forEach((x, k) => { size[k] += Math.abs(x); });
  }
  for (let k = 0; k <= top; k++)
    for (let m = k + 1; m <= top; m++)
      if (size[k] && size[m]) out.push(Math.pow(size[k] / size[m], 1 / (m - k)));
  return out;
}

// How many roots of 1 + L lie right of the imaginary axis, by how often a function turns along it.

const MOST_STEPS = 40000;

// The turn of arg f along u in [0, end], f(u) = [re, im]; null where a root is on the way.
// `longest(u)` bounds a step; steps shrink until f turns by little between two points.
function turnOf(f, end, longest) {
  let u = 0;
  let value = f(0);
  let turned = 0;
  let step = longest(0);
  for (let i = 0; u < end; i++) {
    if (i > MOST_STEPS) throw new NoAnswer("The loop turns too often to be followed at these numbers.");
    step = Math.min(step, longest(u), end - u);
    const next = f(u + step);
    const half = f(u + step / 2);
    const first = angleBetween(value, half);
    const second = angleBetween(half, next);
    // A straight way turns alike on both halves; one that passes a root near by does not.
    if (Math.abs(first) + Math.abs(second) > 0.8 || Math.abs(first - second) > 0.3) {
      if (step < 1e-11 * Math.max(u, end * 1e-6)) return null;
      step /= 2;
      continue;
    }
    turned += first + second;
    u += step;
    value = next;
    step *= 2;
  }
  return turned;
}

const angleBetween = (a, b) => Math.atan2(b[1] * a[0] - b[0] * a[1], a[0] * b[0] + a[1] * b[1]);

// The roots of a retarded quasi-polynomial right of the axis; NaN where one is on it.
function unstableRoots(Q) {
  const n = degree(Q);
  if (n < 0) return NaN;
  const lead = leading(Q);
  if (n === 0) return Q.length === 1 ? 0 : NaN;
  let rate = 0;
  let slow = Infinity;
  for (let k = 0; k < n; k++) {
    const size = Q.reduce((sum, { c }) => sum + Math.abs(c[k] ?? 0), 0) / Math.abs(lead);
    if (size) {
      rate = Math.max(rate, Math.pow(n * size, 1 / (n - k)));
      slow = Math.min(slow, Math.pow(size, 1 / (n - k)));
    }
  }
  if (!rate) return NaN; // sⁿ: its roots are at 0
  const late = Q[Q.length - 1].tau;
  const line = -1e-12 / Math.max(1, late); // what is nearer to the axis counts as on it
  const far = 4 * rate;
  const most = (w) => Math.min(Math.max(w / 2, slow / 4), late ? 1 / late : Infinity);
  const turned = turnOf((w) => valueAt(Q, line, w), far, most);
  if (turned === null) return NaN;
  // From there on only sⁿ turns: what is left to n quarter turns.
  const end = valueAt(Q, line, far);
  const power = [Math.cos((n * Math.PI) / 2) * lead, Math.sin((n * Math.PI) / 2) * lead];
  return Math.round(((n * Math.PI) / 2 - turned - angleBetween(end, power)) / Math.PI);
}

// The coefficient of the highest power of s. Errors: `NoAnswer` where a delayed one is as high.
function leading(Q) {
  const n = degree(Q);
  const high = Q.filter(({ c }) => c.length === n + 1);
  if (high.length !== 1 || high[0].tau !== 0)
    throw new NoAnswer(
      "This loop feeds a derivative of its own past back (it is neutral or advanced), which the " +
      "explorer does not follow; the report's own numbers do.");
  return high[0].c[n];
}

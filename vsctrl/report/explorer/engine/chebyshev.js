// Chebyshev points of one degree: interpolation, integration, and how well they resolve a function.

const DEGREE = 16;
const POINTS = Array.from({ length: DEGREE + 1 }, (_, i) => -Math.cos((Math.PI * i) / DEGREE));
const WEIGHTS = POINTS.map((_, i) => (i % 2 ? -1 : 1) * (i === 0 || i === DEGREE ? 0.5 : 1));

// The row of weights that gives f(x) from its values at the points, −1 ≤ x ≤ 1.
function interpolation(x) {
  const at = POINTS.indexOf(x);
  if (at >= 0) return POINTS.map((_, i) => (i === at ? 1 : 0));
  const parts = POINTS.map((point, i) => WEIGHTS[i] / (x - point));
  const sum = parts.reduce((a, b) => a + b, 0);
  return parts.map((part) => part / sum);
}

function interpolated(values, x) {
  let above = 0;
  let below = 0;
  for (let i = 0; i <= DEGREE; i++) {
    const gap = x - POINTS[i];
    if (gap === 0) return values[i];
    above += (WEIGHTS[i] / gap) * values[i];
    below += WEIGHTS[i] / gap;
  }
  return above / below;
}

// values → Chebyshev coefficients, (DEGREE + 1)².
const TO_COEFFICIENTS = POINTS.map((_, k) => POINTS.map((_, i) => {
  const share = (k === 0 || k === DEGREE ? 1 : 2) * (i === 0 || i === DEGREE ? 0.5 : 1);
  return (share * Math.cos((Math.PI * k * (DEGREE - i)) / DEGREE)) / DEGREE;
}));

// values → the integral from −1 to each point.
const INTEGRAL = (() => {
  const T = (k, x) => Math.cos(k * Math.acos(Math.max(-1, Math.min(1, x))));
  const primitive = (k, x) => {
    if (k === 0) return x;
    if (k === 1) return (x * x) / 2;
    return (T(k + 1, x) / (k + 1) - T(k - 1, x) / (k - 1)) / 2;
  };
  const ofBasis = POINTS.map((x) => POINTS.map((_, k) => primitive(k, x) - primitive(k, -1)));
  return times(ofBasis, TO_COEFFICIENTS);
})();

// The powers of INTEGRAL, as many as were asked for so far.
const INTEGRALS = [identity(DEGREE + 1)];
function integral(times_) {
  while (INTEGRALS.length <= times_) INTEGRALS.push(times(INTEGRAL, INTEGRALS[INTEGRALS.length - 1]));
  return INTEGRALS[times_];
}

// The time response of a channel N/Δ to u(t) = tᵖ/p! from t = 0, delays exact.
//
// y is the impulse response of N/(Δ s^{p+1}), whose observer form has one delayed signal, y itself:
//     xₖ' = xₖ₋₁ − Σ_τ a_{kτ} y(t − τ),   y = xₙ₋₁,   x jumps by the coefficients b of N.
// It is integrated piece by piece between the times to which a jump is carried by sums of delays;
// on a piece y is a polynomial through Chebyshev points, so that repeated integration leaves one
// linear system of DEGREE + 1 unknowns however high the order is. What y(t − τ) needs of the piece
// itself is part of that system.

const RESOLVED = 1e-13; // of the largest value so far, the last coefficients of a piece
const WEAK = 1e-15; // a jump that no piece would show
const MOST_PIECES = 3000;

class Response {
  constructor(N, D, power, horizon) {
    const late = leading(D);
    const n = (this.n = degree(D) + power + 1);
    if (degree(N) >= n)
      throw new NoAnswer("This signal answers with an impulse, which has no picture.");
    // Time in units in which the rates are about 1.
    let rate = 1 / horizon;
    for (const { c } of D)
      c.forEach((x, k) => {
        const down = degree(D) - k;
        if (x && down) rate = Math.max(rate, Math.pow(Math.abs(x / late), 1 / down));
      });
    this.unit = 1 / rate;
    const scaled = (Q, shift) => Q.map(({ tau, c }) => ({
      tau: tau * rate,
      c: Array.from({ length: n + 1 }, (_, k) =>
        (c[k - shift] ?? 0) / late * Math.pow(rate, k - shift - degree(D))),
    }));
    this.a = scaled(D, power + 1).map(({ tau, c }) => ({ tau, c: c.slice(0, n) }));
    this.now = this.a.find(({ tau }) => tau === 0)?.c ?? new Array(n).fill(0);
    this.past = this.a.filter(({ tau }) => tau > 0);
    // u = tᵖ/p!, so that y is counted in unitᵖ.
    this.size = Math.pow(this.unit, power);
    this.b = scaled(N, 0).map(({ tau, c }) => ({ tau, c: c.slice(0, n) }));
    this.horizon = horizon * rate;
    this.longest = this.horizon / 2;
    this.kinks();
    this.integrate();
  }

  // The times at which y or a derivative of it jumps, with the jumps of x.
  kinks() {
    const reach = Math.min(this.longest, 6);
    const queue = [];
    const at = (t) => {
      let own = queue.find((one) => Math.abs(one.t - t) < 1e-11 * (1 + t));
      if (!own) {
        own = { t, x: new Array(this.n).fill(0), w: [] };
        let i = queue.length;
        while (i && queue[i - 1].t > t) i--;
        queue.splice(i, 0, own);
      }
      return own;
    };
    for (const { tau, c } of this.b) {
      if (tau >= this.horizon) continue;
      const own = at(tau);
      c.forEach((x, k) => { own.x[k] += x; });
    }
    let largest = 0;
    for (let i = 0; i < queue.length; i++) {
      if (i > MOST_PIECES) throw new NoAnswer("Too many delays jump here to be followed.");
      const one = queue[i];
      const y = this.jumps(one);
      let weight = 0;
      for (let m = 0, f = 1; m < y.length; f *= reach / ++m) weight = Math.max(weight, Math.abs(y[m]) * f);
      largest = Math.max(largest, weight);
      if (i && weight < WEAK * largest) { one.weak = !one.x.some((x) => x); continue; }
      for (const { tau, c } of this.past)
        if (one.t + tau < this.horizon) at(one.t + tau).w.push({ c, y });
    }
    this.breaks = queue.filter((one) => !one.weak);
  }

  // The jumps of y and its derivatives where x jumps and delayed jumps arrive.
  jumps({ x, w }) {
    let own = [...x];
    const y = [own[this.n - 1]];
    for (let m = 0; m < DEGREE; m++) {
      own = own.map((_, k) => {
        let slope = (k ? own[k - 1] : 0) - this.now[k] * y[m];
        for (const arrived of w) slope -= arrived.c[k] * arrived.y[m];
        return slope;
      });
      y.push(own[this.n - 1]);
    }
    return y;
  }

  integrate() {
    this.pieces = [];
    let x = new Array(this.n).fill(0);
    let start = 0;
    let length = Math.min(2, this.longest);
    let scale = 1e-300;
    let next = 0;
    while (start < this.horizon * (1 - 1e-12)) {
      while (next < this.breaks.length && this.breaks[next].t <= start + 1e-11 * (1 + start)) {
        this.breaks[next].x.forEach((jump, k) => { x[k] += jump; });
        next++;
      }
      const stop = next < this.breaks.length ? Math.min(this.breaks[next].t, this.horizon) : this.horizon;
      let h = (stop - start) / Math.max(1, Math.ceil(((stop - start) / length) * (1 - 1e-9)));
      let piece;
      for (;;) {
        piece = this.piece(start, h, x);
        const size = Math.max(scale, ...piece.y.map(Math.abs));
        if (!(size < 1e250)) throw new NoAnswer("It grows beyond all numbers.");
        let rough = 0;
        for (let k = DEGREE - 2; k <= DEGREE; k++) {
          let sum = 0;
          for (let i = 0; i <= DEGREE; i++) sum += TO_COEFFICIENTS[k][i] * piece.y[i];
          rough = Math.max(rough, Math.abs(sum));
        }
        if (rough <= RESOLVED * size || h < 1e-9 * this.horizon || piece.rounding * 1e-15 > rough) {
          scale = size;
          break;
        }
        h /= 2;
      }
      this.pieces.push(piece);
      if (this.pieces.length > MOST_PIECES) throw new NoAnswer("It changes too fast to be followed.");
      x = piece.x;
      start = Math.abs(start + h - stop) < 1e-9 * h ? stop : start + h;
      length = Math.min(this.longest, Math.max(2 * h, length));
      if (h < length / 4) length = 2 * h;
    }
  }

  // What depends on the length h of a piece only: the rows that interpolate within it, the integrals
  // G = Σ_k (hS)^{n−k} c_k of each delayed y, and the matrix of the equations
  //     y = Σ_k (hS)^{n−1−k} xₖ(a) − G₀ y − Σ_τ G_τ (known + own y).
  prepared(h) {
    if (this.cache?.h === h) return this.cache;
    const K = DEGREE + 1;
    const t = POINTS.map((point) => ((point + 1) * h) / 2);
    const summed = (c) => {
      const G = zeros(K, K);
      for (let k = 0; k < this.n; k++) {
        if (!c[k]) continue;
        const S = integral(this.n - k);
        const factor = c[k] * Math.pow(h / 2, this.n - k);
        for (let i = 0; i < K; i++) for (let j = 0; j < K; j++) G[i][j] += factor * S[i][j];
      }
      return G;
    };
    const matrix = summed(this.now);
    for (let i = 0; i < K; i++) matrix[i][i] += 1;
    const late = this.past.map(({ tau, c }) => {
      const own = t.map((at) => (at - tau > 1e-12 * h ? interpolation((2 * (at - tau)) / h - 1) : null));
      const G = summed(c);
      for (let l = 0; l < K; l++)
        if (own[l])
          for (let i = 0; i < K; i++)
            for (let j = 0; j < K; j++) matrix[i][j] += G[i][l] * own[l][j];
      return { tau, own, G, nudge: Math.min(1e-9 * h, 1e-3 * tau) };
    });
    this.cache = { h, t, matrix, late };
    return this.cache;
  }

  // y at the points of [start, start + h] and x at its end.
  piece(start, h, x) {
    const K = DEGREE + 1;
    const { t, matrix, late } = this.prepared(h);
    const right = new Float64Array(K);
    let rounding = 0;
    for (let k = 0; k < this.n; k++) {
      const S = integral(this.n - 1 - k);
      const factor = x[k] * Math.pow(h / 2, this.n - 1 - k);
      if (factor)
        for (let i = 0; i < K; i++) {
          let sum = 0;
          for (let j = 0; j < K; j++) sum += S[i][j];
          right[i] += factor * sum;
          rounding = Math.max(rounding, Math.abs(factor * sum));
        }
    }
    const known = late.map(({ tau, own, G, nudge }) => {
      const values = new Float64Array(K);
      for (let i = 0; i < K; i++) {
        if (own[i]) continue;
        const seen = start - tau + Math.min(Math.max(t[i], nudge), h - nudge);
        if (seen > 0) values[i] = this.within(seen, start - tau + t[i]);
      }
      for (let i = 0; i < K; i++) {
        let sum = 0;
        for (let j = 0; j < K; j++) sum += G[i][j] * values[j];
        right[i] -= sum;
      }
      return values;
    });
    const y = solved(matrix.map((row) => row.slice()), right);
    late.forEach(({ own }, m) => own.forEach((row, i) => {
      if (!row) return;
      let sum = 0;
      for (let j = 0; j < K; j++) sum += row[j] * y[j];
      known[m][i] = sum;
    }));
    return { start, h, y, x: this.states(h, x, y, known), rounding };
  }

  // x at the end of a piece, each state integrated from the one before it.
  states(h, x, y, late) {
    const K = DEGREE + 1;
    const slope = new Float64Array(K);
    const before = new Float64Array(K);
    return x.map((first, k) => {
      for (let i = 0; i < K; i++) slope[i] = before[i] - this.now[k] * y[i];
      this.past.forEach(({ c }, m) => {
        if (c[k]) for (let i = 0; i < K; i++) slope[i] -= c[k] * late[m][i];
      });
      for (let i = 0; i < K; i++) {
        let sum = 0;
        for (let j = 0; j < K; j++) sum += INTEGRAL[i][j] * slope[j];
        before[i] = first + (h / 2) * sum;
      }
      return before[DEGREE];
    });
  }

  // y at `at`, in the piece that holds `seen`.
  within(seen, at) {
    let low = 0;
    let high = this.pieces.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.pieces[middle].start <= seen) low = middle; else high = middle - 1;
    }
    const { start, h, y } = this.pieces[low];
    return interpolated(y, (2 * (at - start)) / h - 1);
  }

  // y at time t (s), the limit from the right at jumps.
  at(t) {
    const scaled = t / this.unit;
    if (scaled < 0) return 0;
    return this.size * this.within(Math.min(scaled * (1 + 1e-12), this.horizon), Math.min(scaled, this.horizon));
  }
}

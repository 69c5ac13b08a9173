// Small dense linear algebra: arrays of rows.

const zeros = (rows, columns) => Array.from({ length: rows }, () => new Float64Array(columns));
const identity = (n) => zeros(n, n).map((row, i) => { row[i] = 1; return row; });

function times(A, B) {
  const out = zeros(A.length, B[0].length);
  for (let i = 0; i < A.length; i++)
    for (let k = 0; k < B.length; k++) {
      const a = A[i][k];
      if (a) for (let j = 0; j < B[0].length; j++) out[i][j] += a * B[k][j];
    }
  return out;
}

// x of A x = b, by elimination with row pivots; A and b are overwritten.
function solved(A, b) {
  const n = A.length;
  for (let k = 0; k < n; k++) {
    let p = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(A[i][k]) > Math.abs(A[p][k])) p = i;
    [A[k], A[p]] = [A[p], A[k]];
    [b[k], b[p]] = [b[p], b[k]];
    for (let i = k + 1; i < n; i++) {
      const f = A[i][k] / A[k][k];
      if (!f) continue;
      for (let j = k + 1; j < n; j++) A[i][j] -= f * A[k][j];
      b[i] -= f * b[k];
    }
  }
  for (let k = n - 1; k >= 0; k--) {
    for (let j = k + 1; j < n; j++) b[k] -= A[k][j] * b[j];
    b[k] /= A[k][k];
  }
  return b;
}

// The same for complex entries [re, im]; also the determinant.
function solvedComplex(A, b) {
  const n = A.length;
  let det = [1, 0];
  for (let k = 0; k < n; k++) {
    let p = k;
    for (let i = k + 1; i < n; i++) if (modulus2(A[i][k]) > modulus2(A[p][k])) p = i;
    if (p !== k) {
      [A[k], A[p]] = [A[p], A[k]];
      [b[k], b[p]] = [b[p], b[k]];
      det = [-det[0], -det[1]];
    }
    det = cmul(det, A[k][k]);
    for (let i = k + 1; i < n; i++) {
      const f = cdiv(A[i][k], A[k][k]);
      for (let j = k + 1; j < n; j++) A[i][j] = csub(A[i][j], cmul(f, A[k][j]));
      b[i] = csub(b[i], cmul(f, b[k]));
    }
  }
  for (let k = n - 1; k >= 0; k--) {
    for (let j = k + 1; j < n; j++) b[k] = csub(b[k], cmul(A[k][j], b[j]));
    b[k] = cdiv(b[k], A[k][k]);
  }
  return { x: b, det };
}

const modulus2 = (a) => a[0] * a[0] + a[1] * a[1];
const cmul = (a, b) => [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
const csub = (a, b) => [a[0] - b[0], a[1] - b[1]];
const cadd = (a, b) => [a[0] + b[0], a[1] + b[1]];
const cdiv = (a, b) => {
  const size = b[0] * b[0] + b[1] * b[1];
  return [(a[0] * b[0] + a[1] * b[1]) / size, (a[1] * b[0] - a[0] * b[1]) / size];
};

// e^A by its Taylor series of A/2ᵏ, squared k times.
function exponential(A) {
  const n = A.length;
  const size = Math.max(1e-300, ...A.map((row) => row.reduce((sum, x) => sum + Math.abs(x), 0)));
  const k = Math.max(0, Math.ceil(Math.log2(size)) + 3);
  const small = A.map((row) => row.map((x) => x / 2 ** k));
  let sum = identity(n);
  let term = identity(n);
  for (let m = 1; m < 16; m++) {
    term = times(term, small).map((row) => row.map((x) => x / m));
    sum = sum.map((row, i) => row.map((x, j) => x + term[i][j]));
  }
  for (let i = 0; i < k; i++) sum = times(sum, sum);
  return sum;
}

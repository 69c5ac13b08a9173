// Three things to try on figure 1; each tells when it is solved, and why.

const LEAD = 1e-4; // m: what is nearer to the reference is on it
const SPEED = 0.04; // m/s of the ramp

const CHALLENGES = [
  {
    text: "Bring the camera onto the moving reference (within 0.1 mm at 4 cm/s) without touching k_ff.",
    applies: (start) => start.k_ff !== undefined,
    solved(at, start) {
      const { values } = at;
      const error = SPEED * at.rampError(0);
      if (values.k_ff !== start.k_ff || at.unstable !== 0 || !(Math.abs(error) < LEAD)) return null;
      if (at.sampledMargins.stable === false) return null;
      return values.kappa === start.kappa
        ? "The steady error is v [τ − (1 − k_ff κ)/(κλ)], and you made both of its terms alike: " +
          "with k_ff κ = 1 that takes a latency of 0, else a gain that fits the latency."
        : `The steady error is v [τ − (1 − k_ff κ)/(κλ)]: with κ = ${shown(values.kappa)} one error ` +
          "hides the other. It is a coincidence of two errors, not a cure; the cure is to compare the " +
          "image with the reference of the same moment.";
    },
  },
  {
    text: "Answer as fast as it can be without oscillating, at the latency and κ there are (continuous loop).",
    applies: (start) => start.tau > 0,
    solved(at, start) {
      const { lam, tau, kappa } = at.values;
      const x = kappa * lam * tau;
      if (tau !== start.tau || kappa !== start.kappa || !(x <= 1 / Math.E && x > 0.97 / Math.E)) return null;
      return `κλτ = ${shown(x)}, and 1/e = ${shown(1 / Math.E)} is where two real roots meet at −1/τ: ` +
        "below it the slower root is slower, above it they leave the axis as a pair that rings.";
    },
  },
  {
    text: "Find a loop that continuous theory calls stable and the computer shakes to pieces.",
    applies: () => true,
    solved(at) {
      if (at.unstable !== 0 || at.sampledMargins.stable !== false) return null;
      return `Theory allows λ up to ${shown(at.gainLimit("lam"))} s⁻¹, the sampled loop ` +
        `${shown(at.sampledLimit("lam"))} s⁻¹: a velocity held over a period acts half a period late on average.`;
    },
  },
];

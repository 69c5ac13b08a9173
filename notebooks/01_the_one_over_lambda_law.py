# %% [markdown]
# # The 1/λ law
#
# Berry, Martinet and Gallice (1997) move a camera along a trajectory by moving its *reference
# image* $s^*(t)$. Their law is
#
# $$T = -\lambda\, L^+ (s - s^*(t)) + L^+ \frac{ds^*}{dt},$$
#
# and they say of it: with the derivative term there is no tracking error, without it the error is
# proportional to $1/\lambda$. Both are true of the loop they draw, and neither of the loop they
# built, whose image is 80 ms old. Here is why, three ways: proved, computed, simulated.

# %%
import control
import numpy as np
import pandas as pd
import sympy as sp

import vsctrl as vs
from vsctrl.symbols import T_s, lam, v

# %% [markdown]
# ## The loop
# Figure 1 of the paper with the latency of its vision system. A diagram is wired by the names of
# its signals, and draws itself.

# %%
vs.figure1

# %% [markdown]
# From the wiring follows the exact transfer function. Notice that the delay stays an exponential.

# %%
vs.figure1.transfer("S_ref", "S")

# %% [markdown]
# ## What can be proved
# The final-value theorem on a reference that moves at speed $v$, κ being the ratio of the true
# image Jacobian to the modelled one:

# %%
error = vs.loop.tracking_error(vs.Ramp(v))
error

# %% [markdown]
# The paper's two statements are two corners of this formula: perfect calibration and no latency.
# With the derivative term,

# %%
vs.loop.tracking_error(vs.Ramp(v), kappa=1, k_ff=1, tau=0)

# %% [markdown]
# and without it

# %%
vs.loop.tracking_error(vs.Ramp(v), kappa=1, k_ff=0, tau=0)

# %% [markdown]
# With the latency the camera *leads* by $v\tau$ when the derivative term is on. The feed-forward
# gain that nulls the error is not 1:

# %%
vs.loop.nulling_feedforward()

# %% [markdown]
# ## What can be computed
# Numbers in: λ = 0.1 per 40 ms sample is 2.5 s⁻¹, the reference moves at 4 cm/s. The margins are
# generous.

# %%
gain = vs.per_sample(0.1, period=0.04)
loop = vs.figure1.at(lam=gain, tau=0.08, ell=1, ell_hat=1, k_ff=1)
loop.open("S_meas").margins()

# %% [markdown]
# The Bode diagram shows where they are. Notice that the phase goes on falling for ever, as that of
# a dead time does.

# %%
vs.plot(loop.open("S_meas"))

# %% [markdown]
# How does the camera get on its reference? A diagram is a block of another one, here of one that
# subtracts the reference. On a ramp of 40 mm/s:

# %%
with_error = vs.Diagram(
    [vs.figure1.block("figure 1", "S_ref -> S"), vs.Sum("E = S - S_ref")],
    inputs=["S_ref"],
    outputs=["E"],
)
on = with_error.at(loop.values)
off = on.with_(k_ff=0)

# %% tags=["thumbnail"]
figure = vs.plots.response(
    on["S_ref", "E"],
    off["S_ref", "E"],
    names=["with the derivative term", "without"],
    signal=vs.Ramp(40),
    t=4,
)
figure.axes[0].set(xlabel="time, s", ylabel="camera − reference, mm")
figure

# %% [markdown]
# Notice the signs. Without the derivative term the camera stays 12.8 mm behind, which is
# $v(1/\lambda - \tau)$; with it, it ends 3.2 mm *ahead*. And notice the first 80 ms, in which the
# law has nothing to go by but the old image. (The dotted line is the reference itself.)
#
# A Padé model agrees in the end, but not on the way. The spread of its error on the ramp without
# the derivative term is small, since a ramp is gentle; [the notebook of block
# diagrams](07_block_diagrams.ipynb) has a step, where it is not.

# %%
t = np.linspace(0, 5, 501)
S = loop.with_(k_ff=0)["S_ref", "S"]
exact = S.response(vs.Ramp(40), t).outputs
spreads = {
    f"Padé of order {order}": float(
        np.ptp(control.forced_response(S.pade(order), t, 40 * t).outputs - exact)
    )
    for order in (1, 2, 4)
}
pd.DataFrame({"spread of the error, mm": spreads}).round(4)

# %% [markdown]
# ## What a camera does
# A pinhole camera with six degrees of freedom looks at the four LEDs of the paper's cube and slides
# along its side. Nothing of the formulas above is known to the simulator.

# %%
run = vs.simulate(vs.paper.sliding())
vs.plot(run)

# %% [markdown]
# The *measured* error is zero while the camera is 3.2 mm ahead: the law compares an old image with
# a new reference. No plot of what the law sees can show it. All cases, four ways each, in
# millimetres along the motion:

# %%
vs.validate(vs.paper.sliding())

# %% [markdown]
# ## How fast it may go
# Continuous-time theory allows λ up to $\pi/(2\kappa\tau)$,

# %%
vs.loop.gain_limit()

# %% [markdown]
# but the velocity is held over a video period $T_s$, and that costs a fifth of it:

# %%
vs.loop.gain_limit(period=T_s)

# %%
limits = {
    "continuous": vs.loop.gain_limit(tau=0.08),
    "sampled every 40 ms": vs.loop.gain_limit(tau=0.08, period=0.04),
}
pd.DataFrame({"gain limit, s⁻¹": limits}).round(3)

# %% [markdown]
# The simulated camera knows which of the two is true. At 15 s⁻¹ it still settles; at 16 s⁻¹, which
# the first would allow, it shakes itself off the target.

# %%
for gain in (15.0, 16.0):
    long = vs.simulate(vs.paper.sliding(lam=gain).with_(duration=60))
    print(f"λ = {gain:g}: {long.status.sentence}")

# %% [markdown]
# ## When the derivative term does harm
# The errors with and without it are equally large at one gain; above it the derivative term makes
# the true error *larger*.

# %%
with_term, without = (abs(vs.loop.tracking_error(vs.Ramp(1), kappa=1, k_ff=k)) for k in (1, 0))
sp.solve(sp.Eq(with_term**2, without**2), lam)[0]

# %% [markdown]
# That is 6.25 s⁻¹ for 80 ms, well within what is stable: nothing warns of it but the true error.

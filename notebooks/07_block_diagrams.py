# %% [markdown]
# # Any loop with dead time
#
# Nothing in this notebook knows of a camera. A process answers late, and a controller is to be
# tuned. From *one* description of the loop follow its transfer function in symbols, its frequency
# response, its margins, its characteristic roots, its time response, its sampled twin, its Padé
# models and its picture, all with the delay exact, and all held to each other.

# %%
import control
import numpy as np
import pandas as pd
import sympy as sp

import vsctrl as vs
from vsctrl.symbols import s

# %% [markdown]
# ## A loop, drawn by its wiring
# A process of first order with dead time θ under PI control. Blocks are joined wherever a signal
# has the same name.

# %%
K_c, T_I, k, T, theta = sp.symbols("K_c T_I k T theta", positive=True)
pi = vs.Diagram(
    [
        vs.Sum("e = r - y"),
        vs.Block("PI", K_c * (1 + 1 / (T_I * s)), "e -> u"),
        vs.Sum("v = u + d"),
        vs.Block("process", k * sp.exp(-theta * s) / (T * s + 1), "v -> y"),
    ],
    inputs=["r", "d"],
    outputs=["y"],
)
pi

# %% [markdown]
# What does a disturbance at the process's input do? Its transfer function, with the delay as it is:

# %%
pi.transfer("d", "y")

# %% [markdown]
# ## Skogestad's rule
# The SIMC rule with its closed-loop time constant equal to θ says $K_c = T/(2kθ)$, $T_I = T$. Its
# author gives the gain margin as 3.14, the phase margin as 61.4°, the peak of S as 1.59 and the
# allowed delay error as 2.14 θ (*J. Process Control* 13, 2003, Table 1). Exactly:

# %%
simc = pi.at(k=1, T=5, theta=1, K_c=2.5, T_I=5)
L = simc.open("y")
L.margins()

# %% [markdown]
# The Bode diagram, up to where the phase has turned five times. It goes on falling for ever, as
# that of a dead time does, and each time it passes an odd multiple of 180° it is a crossing of the
# table above.

# %%
vs.plots.bode(L, omega=(0.01, 30))

# %% [markdown]
# python-control's own functions take the exact response too; its search for margins on 2000
# frequencies agrees with what is above to four digits.

# %%
data = L.frequency_response(np.geomspace(0.01, 20, 2000))
gain, phase, _, _ = control.margin(data)
exact = L.margins()
pd.DataFrame(
    {
        "exact": {"gain margin": exact.gain, "phase margin, degrees": np.degrees(exact.phase)},
        "python-control, by search": {"gain margin": gain, "phase margin, degrees": phase},
    }
).round(3)

# %% [markdown]
# ## What a Padé model gets wrong
# A rational model is good at low frequency and wrong in time: it starts to answer before the dead
# time is over. A model can be asked for by the error that one is ready to accept, and tells it.

# %%
model = simc["r", "y"].pade(tol=1e-3)
print(model.sentence)

# %%
figure = vs.plots.response(
    simc["r", "y"],
    simc["r", "y"].pade(2),
    names=["exact delay", "Padé of order 2"],
    t=6,
)
figure.axes[0].set(xlabel="time, s", ylabel="y, with a unit step in r")
figure

# %% [markdown]
# Notice the first second. Nothing can have happened yet, but the model of order 2 has already moved
# up and down, by

# %%
t = np.linspace(0, 0.99, 100)
moved = np.abs(control.step_response(simc["r", "y"].pade(2), t).outputs).max()
print(f"{moved:.3f} before the dead time is over")

# %% [markdown]
# ## Roots
# There are infinitely many. The rightmost ones decide, and the argument principle certifies that
# none has been missed.

# %%
vs.plot(simc)

# %% [markdown]
# At the right end of both panels: the roots that matter are the slow ones, and the output follows
# them. With $K_c = 9$ two roots are in the right half-plane, and there are no more:

# %%
found = simc.with_(K_c=9).roots_right_of(0)
how = "certified" if found.certified else "not certified"
print(f"{found.count} roots right of the axis, {how}:")
print(*(f"{root:.4f}" for root in found.roots), sep="\n")

# %% [markdown]
# ## How fast may it go?
# The boundary of stability over two parameters is a curve whose points have a root on the imaginary
# axis. It is traced, not guessed from a raster.

# %% tags=["thumbnail"]
vs.plot(simc.stability_chart(K_c=(0.2, 12), theta=(0.1, 3), grid=(18, 12)))

# %% [markdown]
# ## A dead time that is known can be predicted
# A Smith predictor is a block with a delay in it. With the right model the dead time leaves the
# loop; with a model that is off by a fifth the margins shrink.

# %%
theta_hat = sp.Symbol("theta_hat", positive=True)
lag = k / (T * s + 1)
smith = vs.Diagram(
    [
        vs.Sum("e = r - y - y_ahead"),
        vs.Block("PI", K_c * (1 + 1 / (T_I * s)), "e -> u"),
        vs.Block("model", lag * (1 - sp.exp(-theta_hat * s)), "u -> y_ahead"),
        vs.Block("process", lag * sp.exp(-theta * s), "u -> y"),
    ],
    inputs=["r"],
    outputs=["y"],
)
smith

# %%
right = smith.at(k=1, T=5, theta=1, theta_hat=1, K_c=10, T_I=5)
rows = {}
for theta_true in (0.8, 1.0, 1.2, 1.4, 1.6):
    found = right.with_(theta=theta_true).open("u").margins()
    rows[f"θ = {theta_true:g} s"] = {
        "closed loop": "stable" if found.stable else "unstable",
        "gain margin": "no limit" if found.gain == np.inf else f"{found.gain:.3f}",
        "peak of S": f"{found.peak_sensitivity:.3f}",
    }
pd.DataFrame(rows).T

# %% [markdown]
# Notice that four times the gain of the PI loop is no problem as long as the model is right, in
# which case nothing is limited and S has no peak at all; and how fast that goes away. A dead time
# of 1.6 s where 1 s is believed leaves a factor of 1.5.

# %% [markdown]
# ## The same loop, run by a computer
# A zero-order hold at the controller's output. Everything else stays continuous; the dead time may
# be any fraction of the period. What sampling costs:

# %%
rows = {"continuous": {"gain margin": L.margins().gain, "peak of S": L.margins().peak_sensitivity}}
for period in (0.1, 0.3, 1.0):
    held = simc.sampled(period, hold="u").open().margins()
    rows[f"every {period:g} s"] = {
        "gain margin": held.gain,
        "peak of S": held.peak_sensitivity,
    }
pd.DataFrame(rows).T.round(3)

# %% [markdown]
# ## Loops in loops, and blocks from elsewhere
# A diagram is a block of another one, and so is a python-control system.

# %%
speed = vs.Diagram(
    [
        vs.Sum("e = r - speed"),
        vs.Block("gain", K_c, "e -> u"),
        vs.Block("motor", k * sp.exp(-theta * s) / (T * s + 1), "u -> speed"),
    ],
    inputs=["r"],
    outputs=["speed"],
)
position = vs.Diagram(
    [
        vs.Sum("e = goal - x"),
        vs.Block("gain", control.tf([0.4], [1]), "e -> r"),
        speed.block("speed loop", "r -> v"),
        vs.Block("way", 1 / s, "v -> x"),
    ],
    inputs=["goal"],
    outputs=["x"],
)
position

# %%
position.at(k=1, T=5, theta=1, K_c=2.5).open("speed_loop_u").margins()

# %% [markdown]
# ## Starting from somewhere
# The classical delay equation $x' = -x(t - 1)$ with $x = 1$ in the past: at $t = 1$ it is 0, at $t
# = 2$ it is −1/2.

# %%
hayes = vs.Diagram(
    [
        vs.Sum("dx = u - late"),
        vs.Block("integrator", 1 / s, "dx -> x"),
        vs.Block("delay", sp.exp(-s), "x -> late"),
    ],
    inputs=["u"],
    outputs=["x"],
)
t = np.linspace(0, 8, 401)
x = hayes.at()["u", "x"].response(0 * vs.Step(), t, history={"x": 1})
figure = vs.plot(x)
figure.axes[0].set(xlabel="time, s", ylabel="x, 1 in the past")
figure

# %% [markdown]
# By hand $x = 1 - t$ up to 1 s and $x = (t - 1)^2/2 - (t - 1)$ from there to 2 s:

# %%
by_hand = np.where(t < 1, 1 - t, (t - 1) ** 2 / 2 - (t - 1))
wrong = np.abs(x.outputs - by_hand)[t <= 2].max()
print("right to 1e-12" if wrong < 1e-12 else f"wrong by {wrong:g}")

# %% [markdown]
# ## Two inputs, two outputs
# The distillation column of Wood and Berry (1973) under two PI controllers with Luyben's tuning
# (*Ind. Eng. Chem. Process Des. Dev.* 25, 1986).

# %%
T_1, T_2 = sp.Rational("8.29"), sp.Rational("23.6")
gains = {"11": (12.8, 16.7, 1), "12": (-18.9, 21, 3), "21": (6.6, 10.9, 7), "22": (-19.4, 14.4, 3)}
column = vs.Diagram(
    [
        vs.Sum("e1 = r1 - top"),
        vs.Sum("e2 = r2 - bottom"),
        vs.Block("PI 1", sp.Rational("0.375") * (1 + 1 / (T_1 * s)), "e1 -> reflux"),
        vs.Block("PI 2", -sp.Rational("0.075") * (1 + 1 / (T_2 * s)), "e2 -> steam"),
        *[
            vs.Block(f"G{ij}", g * sp.exp(-late * s) / (lag * s + 1), f"{u} -> y{ij}")
            for (ij, (g, lag, late)), u in zip(gains.items(), ["reflux", "steam"] * 2, strict=True)
        ],
        vs.Sum("top = y11 + y12"),
        vs.Sum("bottom = y21 + y22"),
    ],
    inputs=["r1", "r2"],
    outputs=["top", "bottom"],
)
column

# %%
plant = column.at()
figure = vs.plots.step(plant["r1", "top"], plant["r1", "bottom"], t=100)
figure.axes[0].set(xlabel="time, min", ylabel="mol %, with a step in r1")
figure

# %% [markdown]
# Notice that a step of the top composition moves the bottom too, and that both controllers together
# bring it back: the column is stable and, with its integral action, exact in the end.

# %%
static = [abs(plant["r1", output](0)) for output in ("top", "bottom")]
print(f"{plant.unstable_roots} unstable roots; at rest {static[0]:.3f} and {static[1]:.3f}")

# %% [markdown]
# ## Do the faces agree?
# Symbols against numbers, time against the inverse transform, roots against frequency, the sampled
# twin and the Padé models against what they approximate:

# %%
simc.check()

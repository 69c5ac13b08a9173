# %% [markdown]
# # Six degrees of freedom
#
# The formulas of the first notebook are about one number that follows another. Here a pinhole
# camera with six degrees of freedom looks at the four LEDs of the paper's cube, 25 times a second,
# and moves by the law
#
# $$T = -\lambda\,\hat L^+\bigl(s - s^*(t)\bigr) + k_{\mathrm{ff}}\,\hat L^+\frac{ds^*}{dt}.$$
#
# The simulator uses none of those formulas. Where the two agree it is evidence, and where they do
# not there is something to learn about cameras.

# %%
# %matplotlib inline
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import vsctrl as vs
from vsctrl import servo
from vsctrl.report import plots

mpl.rcParams.update(plots.STYLE)
pd.set_option("display.precision", 4)

# %% [markdown]
# ## The slide
# `vs.paper` has the experiments of the paper as scenarios. The first slides along the cube's side
# at 4 cm/s with an image that is 80 ms old. A scenario prints itself in six lines:

# %%
slide = vs.paper.sliding()
slide

# %% [markdown]
# A run of it in four panels: the image, the error that is there and the one that the law was shown,
# the twist, and the lag.

# %% tags=["thumbnail"]
run = vs.simulate(slide)
vs.plot(run)

# %% [markdown]
# Notice the upper right panel. The law was shown an error that vanishes, while the image is 6.82 px
# away from where it should be: the camera is $v\tau = 40\ \mathrm{mm/s} \cdot 80\ \mathrm{ms} =
# 3.2\ \mathrm{mm}$ *ahead*. No plot of measured errors can show this.
#
# The arrays of a run have one row a frame, and are in m, rad, s and px. How it ended:

# %%
end = {
    "lag along the motion, mm": 1e3 * run.lag_along_motion[-1],
    "true error, px": np.linalg.norm(run.error[-1]),
    "error as measured, px": np.linalg.norm(run.measured_error[-1]),
}
pd.DataFrame({"at the end": end}).round(2)

# %% [markdown]
# ## The oscillation and the rotation
# Figures 7 and 8 of the paper swing the camera to and fro with λ = 5 s⁻¹. The waveform is not
# printed. On a triangle the lag is $v(\tau - 1/\lambda) = -4.8$ mm without the derivative term and
# $v\tau = 3.2$ mm with it, as long as the camera does not turn back:

# %%
swings = {
    (waveform, term): vs.simulate(vs.paper.oscillation(waveform, feedforward=term))
    for waveform in ("triangle", "sine")
    for term in (True, False)
}
pd.DataFrame(
    {
        "with the derivative term": {"lag at the end, mm": swings["triangle", True]},
        "without": {"lag at the end, mm": swings["triangle", False]},
    }
).map(lambda swing: 1e3 * swing.lag_along_motion[-1])

# %%
figure = Figure(figsize=(9, 3), layout="constrained")
panels = figure.subplots(1, 2, sharey=True)
for axes, waveform in zip(panels, ("triangle", "sine"), strict=True):
    for term, colour in ((True, plots.WITH), (False, plots.WITHOUT)):
        swing = swings[waveform, term]
        label = "with the derivative term" if term else "without"
        axes.plot(swing.t, 1e3 * swing.lag[:, 0], color=colour, label=label)
    axes.set(title=f"{waveform}, 4 cm/s at λ = 5 s⁻¹", xlabel="t, s")
panels[0].set(ylabel="lag along the camera's x, mm")
figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
figure

# %% [markdown]
# Notice that the triangle's error is constant between the turning points, as the "static error" of
# the paper's figures is, and that of the sine is not. Here the sign is that of the x axis: each
# curve changes sides when the camera turns back.
#
# The rotation of section 4.2 goes around an axis 0.8 m in front of the camera at 0.04 rad/s. The
# camera moves at $\omega d = 32$ mm/s, so that it should lead by $\omega d\tau = 2.56$ mm (to its
# left, −x), and by the angle $\omega\tau = 3.2$ mrad about y:

# %%
turn = vs.paper.rotation()
turned = vs.simulate(turn)
AXES = ["x, mm", "y, mm", "z, mm", "about x, mrad", "about y, mrad", "about z, mrad"]
pd.DataFrame([1e3 * turned.lag[-1]], index=["lag"], columns=AXES).round(3) + 0.0

# %% [markdown]
# ## The lag is a matrix law
# In six degrees of freedom the ratio κ of the true to the modelled Jacobian becomes the matrix $M =
# \hat L^+ L$, and the steady lag of a constant twist $T^*$
#
# $$\xi = \tau\,T^* - (\lambda M)^{-1}\,(I - k_{\mathrm{ff}}\,M)\,T^*.$$
#
# For points whose depths are all believed to be ρ times what they are, $M$ is known in closed form:
# only translations are affected. (`vs.derive` proves it.)

# %%
vs.loop.depth_error_matrix()

# %% [markdown]
# The law, and a run of each experiment with depths that are believed to be 10 % too large, in mm
# and mrad. For the slide they agree to rounding; for the rotation the law is of first order in the
# lag.

# %%
given = {"lam": 2.5, "tau": 0.08, "k_ff": 1}
M = vs.loop.depth_error_matrix(1.1)
lags = []
for scenario in (slide, turn):
    law = vs.loop.steady_lag(vs.figure1, M, scenario.reference.twist(0), **given)
    seen = vs.simulate(scenario.with_(depth_ratio=1.1)).lag[-1]
    lags += [(scenario.name, "matrix law", *(1e3 * law)), (scenario.name, "run", *(1e3 * seen))]
table = pd.DataFrame(lags, columns=["experiment", "by", *AXES]).set_index(["experiment", "by"])
table.round(4) + 0.0

# %% [markdown]
# The slide's 4.6545 mm is $40\,(80\ \mathrm{ms} + (1.1 - 1)/(1.1 \cdot 2.5\ \mathrm{s}^{-1}))$ mm:
# figure 1 with κ = 1.1. The rotation shows what the law leaves out. The reference's twist is not
# quite the same seen from where the camera is, and the image is curved: 0.02 mm and 0.03 mrad here.
#
# `vs.validate_all` looks for all of the theory in the simulator at once: the steady lag, the limit
# of stability, the decay of a small offset, the matrix law along and about all axes, a Bode plot.

# %% tags=["long"]
found = vs.validate_all(slide)
print("all agree" if found.agrees else "they differ")
found.edge

# %% [markdown]
# The Bode plot, measured: a sine of each frequency is asked for, and the error of the camera is
# fitted once it is steady. The circles lie on the loop as sampled. The dotted curves are continuous
# time; they part from it early where the derivative term is on, since they do not know that the
# velocity is held over a frame.

# %% tags=["long"]
vs.plot(found.sine)

# %% [markdown]
# ## What is wrong with cameras: the law or the reference
# A depth error in the *law* changes how strongly it answers, and so the lag. A depth error in the
# *reference* changes what is asked for. If $s^*(t)$ was computed with depths $\hat Z$ and a focal
# length $\hat F$, the image that it shows is that of a camera at $V \cdot \frac{Z}{\hat Z} \cdot
# \frac{\hat F}{F}$. Without latency, with the derivative term:

# %%
ideal = vs.paper.sliding(latency=0.0)
wrong = {
    "no error": {},
    "depths +10 % in the law": {"depth_ratio": 1.1},
    "depths +10 % in the reference": {"reference_depth_ratio": 1.1},
    "focal length +10 % in the law": {"focal_ratio": 1.1},
    "focal length +10 % in the reference": {"reference_focal_ratio": 1.1},
}
runs = {name: vs.simulate(ideal.with_(**fields)) for name, fields in wrong.items()}
pd.DataFrame(
    {
        name: {
            "speed, mm/s": 1e3 * r.twist[-1, 0],
            "lag, mm": 1e3 * r.lag_along_motion[-1],
            "the law sees, px": np.linalg.norm(r.measured_error[-1]),
        }
        for name, r in runs.items()
    }
).T.round(4)

# %%
figure = Figure(figsize=(9, 3.6), layout="constrained")
left, right = figure.subplots(1, 2)
for name, r in list(runs.items())[1:]:
    style = "--" if name.endswith("reference") else "-"
    left.plot(r.t, 1e3 * r.lag_along_motion, style, label=name)
    right.plot(r.t, np.linalg.norm(r.measured_error, axis=1), style, label=name)
left.set(xlabel="t, s", ylabel="lag along the motion, mm", title="where the camera is")
right.set(xlabel="t, s", ylabel="error, px", title="what the law sees")
figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=2)
figure

# %% [markdown]
# Notice the dashed lines. An error in the law costs a constant lag of 1.45 or 1.6 mm, and the law
# sees that something is left. An error in the reference makes the camera slide at 36.4 or 44 mm/s
# for ever, and the law sees *nothing*: camera and reference image agree, about the wrong motion.

# %% [markdown]
# ### Depths that contradict each other
# A common error of 10 % is harmless. Errors of a few per cent that differ from point to point are
# not: they couple sideways motion with rotation, which a flat target right before the camera tells
# apart badly. Let every second depth be too large by the share δ and the others too small, and take
# $M$ in the middle of the slide. At δ = 3 % an eigenvalue μ has crossed to the left half-plane, and
# then no gain is stable.

# %%
alternating = np.array([1.0, -1.0, 1.0, -1.0])
image, depths = run.features[112], run.depths[112]
L = servo.Camera(700, 700).interaction(image, depths)
limits = []
for share in (0.0, 0.01, 0.02, 0.03):
    L_hat = servo.Camera(700, 700).interaction(image, depths * (1 + share * alternating))
    M = np.linalg.pinv(L_hat) @ L
    least = np.linalg.eigvals(M).real.min()
    limits.append((f"{share:.0%}", least, vs.loop.matrix_gain_limit(M, tau=0.08, period=0.04)))
pd.DataFrame(limits, columns=["δ", "least real part of μ", "gain limit, s⁻¹"]).set_index("δ")

# %%
figure = Figure(figsize=(7, 3), layout="constrained")
axes = figure.subplots()
for share in (0.0, 0.01, 0.02, 0.03):
    r = vs.simulate(slide.with_(depth_ratios=1 + share * alternating))
    axes.plot(r.t, 1e3 * np.linalg.norm(r.lag[:, :3], axis=1), label=f"δ = {share:.0%}")
axes.set(xlabel="t, s", ylabel="distance from the reference, mm", yscale="log", ylim=(1, 1e3))
axes.legend()
figure

# %% [markdown]
# Notice the logarithmic scale. With δ = 3 % the camera drifts away by a fifth of a metre, so slowly
# that a short experiment may still look fine, and the run completes: no single frame is wrong.

# %% [markdown]
# ## Which L
# The law may take $\hat L$ at the current image, at the desired one, or the mean of both. For a
# camera that is turned by θ about its optical axis before a still target at the depth Z, the
# textbook answers are
#
# | $\hat L$ | $v_z$ | size of $\omega_z$ |
# |---|---|---|
# | current | $-\lambda Z (1 - \cos\theta)$ | $\lambda \sin\theta$ |
# | desired | $+\lambda Z (1 - \cos\theta)$ | $\lambda \sin\theta$ |
# | mean | $0$ | $2\lambda \tan(\theta/2)$ |
#
# At θ = 120°, Z = 0.8 m and λ = 2.5 s⁻¹ these are −3 m/s, +3 m/s, 0; 2.1651, 2.1651 and 8.6603
# rad/s.

# %%
upright = {"position": (0, 0, -0.925), "euler_xyz_deg": (0, 0, 0), "kind": "hold", "duration": 4.0}
rolled = ideal.with_(**upright, offset=(0, 0, 0, 0, 0, np.radians(120)))
runs = {
    interaction: vs.simulate(rolled.with_(interaction=interaction))
    for interaction in ("current", "desired", "mean")
}
pd.DataFrame(
    {
        name: {
            "v_z, m/s": r.twist[0, 2] + 0.0,
            "ω_z, rad/s": r.twist[0, 5],
            "nearest, m": r.depths.min(),
            "farthest, m": r.depths.max(),
        }
        for name, r in runs.items()
    }
).T.round(4)

# %%
figure = Figure(figsize=(9, 3), layout="constrained")
left, right = figure.subplots(1, 2)
for name, r in runs.items():
    left.plot(r.t, 1e3 * r.depths[:, 0], label=name)
    right.plot(r.t, np.degrees(np.linalg.norm(r.lag[:, 3:], axis=1)), label=name)
left.set(xlabel="t, s", ylabel="depth of the target, mm", title="retreat and advance", xlim=(0, 2))
right.set(xlabel="t, s", ylabel="angle left to turn, degrees", title="rotation", xlim=(0, 2))
right.legend()
figure

# %% [markdown]
# Notice that the camera backs off to 1.70 m with the current matrix, comes as near as 0.23 m with
# the desired one, and stays where it is with the mean, which has a trap of its own. At 180° the
# mean is singular for every target, and for points on a circle about the optical axis, like this
# target's, at 90° as well: then the columns of $V_y$ and $\Omega_x$ are parallel. The run says so:

# %%
quarter = rolled.with_(offset=(0, 0, 0, 0, 0, np.pi / 2), interaction="mean")
print(vs.simulate(quarter).status.sentence)

# %% [markdown]
# ## Features beyond points
# The law may servo on other features of the same image (`law.features`), or on the pose that is
# found from it (`law.scheme = "pose"`). The same roll of 120°, which a law that turns about the
# optical axis alone would begin with $\omega_z = -\lambda\theta = -5.236$ rad/s:

# %%
names = ("points", "polar", "segments", "normalised-segments", "lines", "moments")
choices = {name: {"features": name} for name in names} | {"pose": {"scheme": "pose"}}
runs = {name: vs.simulate(rolled.with_(**fields)) for name, fields in choices.items()}
table = {
    name: {
        "v_z, m/s": r.twist[0, 2],
        "ω_z, rad/s": r.twist[0, 5],
        "farthest, m": r.depths.max(),
        "angle at the end, degrees": np.degrees(np.linalg.norm(r.lag[-1, 3:])),
    }
    for name, r in runs.items()
}
pd.DataFrame(table).T.round(3) + 0.0

# %%
figure = Figure(figsize=(7, 3), layout="constrained")
axes = figure.subplots()
for name in ("points", "segments", "normalised-segments", "polar", "pose"):
    style = ":" if name == "pose" else "-"
    axes.plot(runs[name].t, 1e3 * runs[name].depths[:, 0], style, label=name)
axes.set(xlabel="t, s", ylabel="depth of the target, mm", title="a roll of 120° to undo")
axes.set_xlim(0, 2)
axes.legend()
figure

# %% [markdown]
# Notice that polar coordinates and the pose do not retreat at all, nor do lines and normalised
# segments, since their angles turn with the camera. Segments in pixels retreat by a seventh: least
# squares weighs hundreds of pixels against two radians. The moments do something else. Their angle
# is that of the long axis, which is the same after half a turn, so that they go the *other* way
# round and end upside down, with no error left:

# %%
upside_down = runs["moments"]
print(f"{np.linalg.norm(upside_down.measured_error[-1]):.2f} of error as measured at the end")
print(upside_down.status.sentence)

# %% [markdown]
# On the slide all of them end at the same place, 3.2 mm ahead. The error that latency makes does
# not depend on what is servoed.

# %%
pd.DataFrame(
    {
        name: {"lag, mm": 1e3 * vs.simulate(slide.with_(**fields)).lag_along_motion[-1]}
        for name, fields in choices.items()
    }
).T.round(3)

# %% [markdown]
# ## When something fails
# A failure in the loop is no exception: the run ends with a status, a sentence that says what to
# do, and the frames until then. With an image of 640 × 480 pixels the slide loses two of the LEDs:

# %%
narrow = slide.with_(size_px=(640, 480))
lost = vs.simulate(narrow)
print(f"{lost.status.kind} after {len(lost.t)} frames: {lost.status.sentence}")

# %% [markdown]
# Whether it ends there is up to `[faults]`. A run that goes on keeps the list of what happened.

# %%
for event in vs.simulate(narrow.with_(on_lost="continue")).events:
    print(event.sentence)

# %% [markdown]
# Above the limit of stability the camera shakes itself off the target:

# %%
too_fast = vs.simulate(vs.paper.sliding(lam=16).with_(duration=60))
print(f"{too_fast.status.kind}: {too_fast.status.sentence}")

# %% [markdown]
# What can be known beforehand is refused beforehand, such as the start position that the paper
# prints:

# %%
try:
    slide.with_(position=vs.paper.PRINTED_START)
except vs.InputError as refused:
    print(refused)

# %% [markdown]
# and everything that is wrong is said at once:

# %%
try:
    slide.with_(lam=-3, features="point", duration="long")
except vs.InputError as refused:
    print(refused)

# %% [markdown]
# ## Keeping a run
# A run is written with its scenario, and read back exactly. `to_xarray` gives every array its
# dimensions, units and meaning.

# %%
with tempfile.TemporaryDirectory() as folder:
    run.save(Path(folder) / "slide.npz")
    again = vs.Run.load(Path(folder) / "slide.npz")
print("the same" if again.scenario == slide and (again.pose == run.pose).all() else "not the same")

# %%
data = run.to_xarray()
pd.DataFrame(
    {
        name: {"dimensions": ", ".join(each.dims), "shape": each.shape, **each.attrs}
        for name, each in data.data_vars.items()
    }
).T

# %% [markdown]
# ## A scenario is a file
# Every key carries its meaning and unit. Change it in an editor, or with `with_`, which knows every
# key by its name; `servo.schema()` is a JSON Schema for editors that complete and check.

# %%
text = slide.to_toml()
print(text[: text.index("[calibration]")])

# %% [markdown]
# and it is read back as it was:

# %%
print("the same" if vs.Scenario.from_toml(text) == slide else "not the same")

# %% [markdown]
# # Interaction matrices, proved
#
# How does an image feature $s$ move when the camera moves with the twist $T = (V, \Omega)$? By
# $\dot s = L\,T$. Two well-known toolboxes ship a hand-typed $L$ that is wrong. Here none is typed:
# a feature is *declared*, and its matrix, its reference and its code follow by the chain rule.

# %%
import numpy as np
import pandas as pd
import sympy as sp
from matplotlib.figure import Figure

import vsctrl as vs
from vsctrl import derive
from vsctrl.derive import PIXELS, Camera
from vsctrl.symbols import V_x, d_z, omega

# %% [markdown]
# ## A point
# From one statement, that a still point moves as $\dot p = -V - \Omega \times p$ in the frame of a
# moving camera, follows the matrix of an image point. Its columns are the answers to Vx, Vy, Vz,
# Ωx, Ωy and Ωz; notice that depth divides the first three and none of the others.

# %%
derive.interaction_matrix(derive.Point())

# %% [markdown]
# In pixels, with the focal lengths $F_x$ and $F_y$:

# %%
derive.interaction_matrix(derive.Point(PIXELS))

# %% [markdown]
# Through a lens with radial distortion $k_1$: what a sideways motion does to the abscissa.

# %%
k_1 = sp.Symbol("k_1", real=True)
wide = Camera(focal=(600, 600), centre=(320, 240), distortion=(k_1,))
sp.simplify(derive.interaction_matrix(derive.Point(wide))[0, 0])

# %% [markdown]
# ## Lines, ellipses, moments
# Curves $h(x, y; s) = 0$ that lie in a plane $1/Z = A x + B y + C$ come from a second derivation,
# image moments of any order from a third. A line, by its angle and its distance from the centre:

# %%
derive.interaction_matrix(derive.Line())

# %% [markdown]
# The area of a patch, a moment of order 0. In front of a wall ($A = B = 0$) it grows with $2aC$
# when the camera comes nearer, and no sideways motion changes it:

# %%
derive.interaction_matrix(derive.Area())

# %% [markdown]
# ## Your own feature
# The difference of the depths of two points over their distance in the image, say. Ten lines, most
# of them names.

# %%
x_1, y_1, x_2, y_2 = sp.symbols("x_1 y_1 x_2 y_2", real=True)
z_1, z_2 = sp.symbols("z_1 z_2", positive=True)
slope = derive.Feature(
    "slope",
    expressions=((z_2 - z_1) / (x_2 / z_2 - x_1 / z_1),),
    points=((x_1, y_1, z_1), (x_2, y_2, z_2)),
)
derive.interaction_matrix(slope)

# %% [markdown]
# Numbers come batched, here for a pair of points at a hundred depths. The nearer the points, the
# more the feature answers to the rotation about y; that the rotation is worth more than the
# translation is a matter of units, rad and m.

# %% tags=["thumbnail"]
depths = np.linspace(0.5, 2.0, 100)
L = derive.evaluate(slope, x_1=-0.1, y_1=0.0, z_1=depths, x_2=0.1, y_2=0.0, z_2=1.1 * depths)
figure = Figure(figsize=(7.2, 3), layout="constrained")
axes = figure.subplots()
for column, name in ((0, "Vx, per m"), (2, "Vz, per m"), (4, "Ωy, per rad")):
    axes.plot(depths, L[:, 0, column], label=f"answer to {name}")
axes.set(xlabel="depth of the first point, m", ylabel="rate of the feature, 1/s")
axes.set_title("One row of an interaction matrix, over depth", loc="left")
axes.grid(alpha=0.25)
axes.legend(frameon=False)
figure

# %% [markdown]
# A place where the feature is singular, one point behind the other, is refused in a sentence:

# %%
try:
    derive.evaluate(slope, x_1=0.1, y_1=0.0, z_1=1.0, x_2=0.1, y_2=0.0, z_2=1.0)
except vs.InputError as refused:
    print(refused)

# %% [markdown]
# Its code is printed from the same formulas, for the robot's controller:

# %%
print(derive.emit(slope, "c"))

# %% [markdown]
# Is it right? Move the camera by a little, in both directions, and look: the difference quotient of
# the feature, and what the matrix says.

# %%
first, second = np.array([-0.1, 0.02, 0.8]), np.array([0.15, -0.03, 1.1])
twist, h = np.array([0.2, -0.1, 0.3, 0.05, 0.1, -0.2]), 1e-6
step = np.array([[h], [-h]])
p = first + step * (-twist[:3] - np.cross(twist[3:], first))
q = second + step * (-twist[:3] - np.cross(twist[3:], second))
seen = (q[:, 2] - p[:, 2]) / (q[:, 0] / q[:, 2] - p[:, 0] / p[:, 2])
difference = (seen[0] - seen[1]) / (2 * h)
names = ("x_1", "y_1", "z_1", "x_2", "y_2", "z_2")
L = derive.evaluate(slope, **dict(zip(names, [*first, *second], strict=True)))
pd.DataFrame({"rate of the feature": {"moved": difference, "by the matrix": float((L @ twist)[0])}})

# %% [markdown]
# ## The reference, and its derivative
# The law needs $s^*(t)$ and $ds^*/dt$. The paper gives the first and never the second. For its
# slide (section 4.1):

# %%
slide = derive.translation_reference(derive.Point(PIXELS), V=(V_x, 0, 0))
slide.s_dot

# %% [markdown]
# and for its turn about an axis at the distance $d$ (section 4.2):

# %%
turn = derive.rotation_reference(derive.Point(PIXELS), d=(0, 0, d_z), omega=omega, r=(0, 1, 0), t=0)
turn.s_dot.applyfunc(sp.factor)

# %% [markdown]
# ## The paper, statement by statement
# Every numbered equation is proved, or shown to be an erratum. How many are what:

# %%
claims = derive.ledger()
pd.Series([claim.status for claim in claims]).value_counts().to_frame("statements")

# %% [markdown]
# The errata, each with its place in the paper:

# %%
errata = [claim for claim in claims if claim.status == "erratum"]
for claim in errata:
    print(claim.equation, claim.statement, sep=": ")

# %% [markdown]
# One of them matters to whoever moves a camera around an axis: as printed, the camera is sent the
# wrong way. Its proof runs here, and again whenever it is asked.

# %%
(sign,) = [claim for claim in claims if claim.equation == "(17) V"]
print(sign, sign.prove().explanation, sep="\n")

"""The vocabulary of vsctrl: one table of symbols, in the letters of the paper and of the field.

Every room that speaks SymPy takes its letters from here, so that a formula derived in one room can
be compared with a formula derived in another.
"""

from sympy import Expr as Expr
from sympy import Symbol, symbols

# The loop of figure 1 ------------------------------------------------------------------------
s = Symbol("s")  #: Laplace variable, rad/s
z_plane = Symbol("z")  #: variable of the z-transform, z = exp(s Tₛ)
lam = Symbol("lambda", positive=True)  #: control gain λ, s⁻¹
tau = Symbol("tau", positive=True)  #: latency of the vision system τ, s
ell = Symbol("ell", positive=True)  #: true image Jacobian ℓ
ell_hat = Symbol("ellhat", positive=True)  #: modelled image Jacobian ℓ̂
kappa = Symbol("kappa", positive=True)  #: κ = ℓ/ℓ̂, 1 = perfect calibration
k_ff = Symbol("k_ff", real=True)  #: feed-forward gain, 1 = the paper's law, 0 = no derivative term
T_s = Symbol("T_s", positive=True)  #: video period, s
d = Symbol("d", integer=True, nonnegative=True)  #: latency in samples
omega = Symbol("omega", positive=True)  #: angular frequency or rotation speed, rad/s
v = Symbol("v", positive=True)  #: slope of a ramp reference, 1/s times the unit of the signal
# Of its delay-tolerant variants: what the law believes, knows early or integrates.
tau_hat = Symbol("tauhat", positive=True)  #: modelled latency τ̂ of a Smith predictor, s
h = Symbol("h", positive=True)  #: preview h, how early the reference is known, s
T_i = Symbol("T_i", positive=True)  #: integral time Tᵢ of a PI gain λ(1 + 1/(Tᵢ s)), s
# Of a robot that answers late: after a dead time θ, and with axes of first order 1/(1 + T_a s).
theta = Symbol("theta", positive=True)  #: dead time of the robot θ, s
T_a = Symbol("T_a", positive=True)  #: time constant of its axes, s

# Points, cameras and screws --------------------------------------------------------------------
t = Symbol("t", real=True)  #: time elapsed since t₀ (Δt of the paper), s
x, y = symbols("x y", real=True)  #: point in the camera frame, m
z = Symbol("z", positive=True)  #: depth of the point, m, positive in front of the camera
X, Y = symbols("X Y", real=True)  #: image point, pixels from the principal point
F_x, F_y = symbols("F_x F_y", positive=True)  #: focal lengths, pixels
V_x, V_y, V_z = symbols("V_x V_y V_z", real=True)  #: linear velocity of the camera, m/s
Omega_x, Omega_y, Omega_z = symbols("Omega_x Omega_y Omega_z", real=True)  #: angular, rad/s
r_x, r_y, r_z = symbols("r_x r_y r_z", real=True)  #: unit vector of a rotation axis
# Of a reference motion: where the point was at t₀, and where the axis of eq. 17 is.
x_0, y_0 = symbols("x_0 y_0", real=True)  #: point in the camera frame at t₀, m
z_0 = Symbol("z_0", positive=True)  #: its depth at t₀, m
d_x, d_y, d_z = symbols("d_x d_y d_z", real=True)  #: vector from the camera to the axis, m

#: Keyword → the symbol it means, where that is not the symbol of the same name.
KEYWORDS = {"lam": lam, "ell_hat": ell_hat, "tau_hat": tau_hat}

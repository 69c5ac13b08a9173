"""Closed forms, printed by ``python -m vsctrl.loop.generated``: do not edit."""

from typing import Any

from sympy import LambertW, Rational, Symbol, acos, cos, exp, pi, sin, sqrt, tan

from vsctrl.symbols import T_s, d, kappa, lam, tau, z_plane

alpha = Symbol("alpha", nonnegative=True)
u, x, zeta = (Symbol(name, positive=True) for name in ("u", "x", "zeta"))
# fmt: off
FORMS: dict[str, Any] = {
    "closed._principal_pole": LambertW(-kappa*lam*tau)/tau,
    "criteria.dominant_damping": exp(zeta*acos(zeta)/sqrt(1 - zeta**2)*Rational(-1, 1))*acos(zeta)/sqrt(1 - zeta**2),
    "criteria.sensitivity_peak": (-u**2*cos(u) + u*sin(u), 1/(sqrt(u**2 + 1)*cos(u))),
    "criteria.squared_step_error": -1 + (tan(x) + 1/cos(x))/x*Rational(1, 2),
    "limits._continuous_double_root": exp(-1)/(kappa*tau),
    "limits._continuous_limit": (-alpha + pi/2)/(kappa*tau),
    "limits._delayed_double_root": d**d*(d + 1)**(-d - 1)/(T_s*kappa),
    "limits._sampled_limit": 2*sin((pi - 2*alpha)/(2*d + 1)*Rational(1, 2))/(T_s*kappa),
    "limits.pulse_transfer": T_s*kappa*lam/(z_plane - 1),
}

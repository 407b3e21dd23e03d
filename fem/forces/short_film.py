"""Film of a short journal bearing or squeeze-film damper (Ocvirk), with all derivatives, in closed form.

With h = c − x cos θ − y sin θ and a = x' + Ω y / 2, b = y' − Ω x / 2, Reynolds' equation without flow around
the journal gives the pressure, summed over the length,

    P(θ) = η L³ (a cos θ + b sin θ) / h³,

positive on the half circle around α = atan2(b, a). With R = D / 2 and θ = β + φ, the film being the half
circle around β (there φ runs from −π/2 to π/2), X = x / c, Y = y / c and the components along β and across

    p = X cos β + Y sin β,  q = −X sin β + Y cos β,  u = a cos β + b sin β,  w = −a sin β + b cos β,

the force on the journal, F = −R ∫ P (cos θ, sin θ) dθ, is

    F_β = −C (u I₁ + w I₂),  F_⊥ = −C (u I₂ + w I₃),  C = η L³ R / c³,
    I₁, I₂, I₃ = ∫ (cos² φ, sin φ cos φ, sin² φ) / (1 − p cos φ − q sin φ)³ dφ
               = ½ J_pp, ½ J_pq, ½ J_qq  of  J = ∫ dφ / (1 − p cos φ − q sin φ).

With k² = 1 − p² − q²: J = (2 / k) atan2(k, −p), J_p = (2 + p J) / k², J_q = q (2 p / (1 − q²) + J) / k²,
and so on by differentiation. Where the film is that of positive pressure, β = α, the force does not change
with β alone, since the pressure is zero at both ends. Where it is bound to the line of centres, β = atan2(−x,
y), the ends count: ∂F_⊥/∂β = −C w ((1 − q)⁻³ − (1 + q)⁻³).

That film is the textbook's: where the line of centres turns faster than the fluid, u < 0, its pressure would
pull, and the force along the line of centres keeps the sign that it has below, −C (|u| I₂ + w I₃).

Sources: F. W. Ocvirk, NACA TN 2808 (1952); for the film of positive pressure G. Adiletta, A. R. Guido, C.
Rossi, Nonlinear Dynamics 10 (1996) 251.
"""

from __future__ import annotations

import math

from rotorid.base.arrays import FloatArray
from rotorid.base.compiled import compiled_part

_WALL = 1e-14  # of 1 − ε², below which it is rounding


@compiled_part
def short_film(  # noqa: PLR0913  what is compiled takes no objects
    C: float,
    c: float,
    x: float,
    y: float,
    vx: float,
    vy: float,
    omega: float,
    line_of_centres: bool,
    out: FloatArray,
) -> None:
    """Force on the journal and its derivatives, as `fem.forces.laws.law` writes them.

    Parameters
    ----------
    C, c
        η L³ R / c³, N·s/m, and the radial clearance, m.
    x, y, vx, vy, omega
        Of the journal, m, m/s and rad/s; Ω is 0 for a damper.
    line_of_centres
        Which film; False: where the pressure is positive.
    out
        Written, shape (2, 6).
    """
    X, Y = x / c, y / c
    k2 = 1.0 - X * X - Y * Y
    if not k2 > _WALL:
        out[:, :] = math.nan
        return
    a, b = vx + 0.5 * omega * y, vy - 0.5 * omega * x
    beta = math.atan2(-x, y) if line_of_centres else math.atan2(b, a)
    C_, S_ = math.cos(beta), math.sin(beta)
    p, q = X * C_ + Y * S_, -X * S_ + Y * C_
    u, w = a * C_ + b * S_, -a * S_ + b * C_

    k = math.sqrt(k2)
    r = 1.0 / k2
    J = 2.0 / k * math.atan2(k, -p)
    d = 1.0 / (1.0 - q * q)
    Jp = (2.0 + p * J) * r
    Jq = q * (2.0 * p * d + J) * r
    Jpp = (J + 3.0 * p * Jp) * r
    Jpq = (p * Jq + 2.0 * q * Jp) * r
    Jqq = (2.0 * p * (1.0 + q * q) * d * d + J + 3.0 * q * Jq) * r
    Jppp = (4.0 * Jp + 5.0 * p * Jpp) * r
    Jppq = (Jq + 3.0 * p * Jpq + 2.0 * q * Jpp) * r
    Jpqq = (p * Jqq + 2.0 * Jp + 4.0 * q * Jpq) * r
    # d³J/dq³ of Jqq = (N + 3 q Jq) / k², N = 2 p (1 + q²) / (1 − q²)² + J
    Jqqq = (4.0 * p * q * (3.0 + q * q) * d * d * d + 4.0 * Jq + 5.0 * q * Jqq) * r

    h = -0.5 * C
    Fb, Fc = h * (u * Jpp + w * Jpq), h * (u * Jpq + w * Jqq)
    # by p and q (over c), and by u and w, along β and across
    bp, bq = h / c * (u * Jppp + w * Jppq), h / c * (u * Jppq + w * Jpqq)
    cp, cq = h / c * (u * Jppq + w * Jpqq), h / c * (u * Jpqq + w * Jqqq)
    b_u, b_w, c_w = h * Jpp, h * Jpq, h * Jqq

    # turned back: columns by x and y of p, q and by a and b of u, w have the same directions
    for i in range(2):
        along, across = (C_, -S_) if i == 0 else (S_, C_)  # of e_β and e_⊥ in x or y
        out[i, 0] = Fb * along + Fc * across
        gp, gq = bp * along + cp * across, bq * along + cq * across
        gu, gw = b_u * along + b_w * across, b_w * along + c_w * across
        fa, fb = gu * C_ - gw * S_, gu * S_ + gw * C_  # by a and b
        out[i, 1] = gp * C_ - gq * S_ - 0.5 * omega * fb
        out[i, 2] = gp * S_ + gq * C_ + 0.5 * omega * fa
        out[i, 3], out[i, 4] = fa, fb
        out[i, 5] = 0.5 * (y * fa - x * fb)
    if line_of_centres and x * x + y * y > 0.0:
        _at_the_line(C, c, x, y, vx, vy, omega, out)


@compiled_part
def _at_the_line(
    C: float, c: float, x: float, y: float, vx: float, vy: float, omega: float, out: FloatArray
) -> None:
    """Add what the ends of the film at the line of centres count, and where u < 0 the change of its force.

    There q = e / c, w = e', u = −s / e with s = x b − y a; |u| in place of u adds −g s (x, y) to the force,
    g = 4 C / (c e k⁴).
    """
    e2 = x * x + y * y
    e = math.sqrt(e2)
    q, k2 = e / c, 1.0 - e2 / (c * c)
    ends = -C * (x * vx + y * vy) / e * ((1.0 - q) ** -3 - (1.0 + q) ** -3)
    s = x * vy - y * vx - 0.5 * omega * e2
    g = 4.0 * C / (c * e * k2 * k2) if s > 0.0 else 0.0
    slope = g * (4.0 / (c * c * k2) - 1.0 / e2)  # of g by x and y, over x and y
    s_x, s_y = vy - omega * x, -vx - omega * y
    for i in range(2):
        r = x if i == 0 else y
        # β = atan2(−x, y): dβ = (−y dx + x dy) / e², and e_⊥ = (x, y) / e
        out[i, 1] -= ends * r / e * y / e2 + (slope * x * s + g * s_x) * r
        out[i, 2] += ends * r / e * x / e2 - (slope * y * s + g * s_y) * r
        out[i, 0] -= g * s * r
        out[i, 1 + i] -= g * s
        out[i, 3] += g * y * r
        out[i, 4] -= g * x * r
        out[i, 5] += 0.5 * g * e2 * r

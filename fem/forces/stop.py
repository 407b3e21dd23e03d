"""A shaft that rubs on a ring beyond a gap, with dry friction, and all derivatives.

With n = z / |z| and t = i n, the normal force N = k (|z| − gap) + c |z|', not below 0, and the slip
s = v · t + Ω R, the force on the shaft is F = −N n − µ N tanh(s / v₀) t.

Source: R. F. Beatty, J. Vib. Acoust. Stress Reliab. Des. 107 (1985) 151, for a spring with Coulomb friction;
here with damping, and with friction that is smooth around no slip.
"""

from __future__ import annotations

import math

from rotorid.base.arrays import FloatArray
from rotorid.base.compiled import compiled_part


@compiled_part
def stop(v: FloatArray, x: float, y: float, vx: float, vy: float, omega: float, out: FloatArray) -> None:
    """Force on the shaft and its derivatives, as `fem.forces.laws.law` writes them; zeros without contact.

    `v`: gap m, k N/m, c N·s/m, µ, the shaft's diameter 2 R m, v₀ m/s.
    """
    out[:, :] = 0.0
    gap, k, c, mu, R, v0 = v[0], v[1], v[2], v[3], v[4] / 2, v[5]
    r = math.hypot(x, y)
    if not r > gap:
        return
    nx, ny = x / r, y / r
    vr, vt = vx * nx + vy * ny, vy * nx - vx * ny
    N = k * (r - gap) + c * vr
    if not N > 0.0:
        return
    f = math.tanh((vt + omega * R) / v0)
    slope = mu * N * (1.0 - f * f) / v0
    g = mu * f
    Fn, Ft = -N, -g * N
    # derivatives of F_n and F_t by radial and tangential displacement and velocity, then of the directions
    n_r, n_t, n_vr = -k, -c * vt / r, -c
    t_r, t_t, t_vr, t_vt = -g * k, -g * c * vt / r + slope * vr / r, -g * c, -slope
    n_t -= Ft / r
    t_t += Fn / r
    for i in range(2):
        n, t = (nx, -ny) if i == 0 else (ny, nx)
        out[i, 0] = Fn * n + Ft * t
        d_r, d_t = n_r * n + t_r * t, n_t * n + t_t * t
        d_vr, d_vt = n_vr * n + t_vr * t, t_vt * t
        out[i, 1], out[i, 2] = d_r * nx - d_t * ny, d_r * ny + d_t * nx
        out[i, 3], out[i, 4] = d_vr * nx - d_vt * ny, d_vr * ny + d_vt * nx
        out[i, 5] = -slope * R * t

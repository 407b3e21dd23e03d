"""The integration of a model with its sensitivities as machine code, with the extra `rotorid[fast]`.

The method of Dormand and Prince of order 8(5,3) with the tolerances of `adaptive`, one step or more from
sample to sample. `translation` compiles `advance` and `tolerances` below, which are also plain Python, and
the rates of the model.
"""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.timedomain.integration.translation import Machine
from rotorid.timedomain.models.errors import LARGEST

if TYPE_CHECKING:
    from rotorid.timedomain.integration.system import Augmented

Array = FloatArray
BUDGET = 20_000
"""Steps at most, and ten for every sample."""


def shifted(array: Array, begin: int) -> Array:
    """The array from an element on."""
    return array[begin:]


def rates(t: float, z: Array, q: Array, out: Array) -> int:  # pragma: no cover
    """Stands for those of a model: states and sensitivities, parameters and inputs, and what comes out."""
    raise NotImplementedError


def tolerances(scale: Array, nx: int, np: int, rtol: float, per: Array, out: Array) -> int:
    """Absolute tolerances as `adaptive` has them: of states, then of sensitivities, row by row."""
    most = 0.0
    for i in range(nx):
        most = scale[i] if scale[i] > most else most
    for i in range(nx):
        own = 0.1 * rtol * scale[i]
        least = 1e-16 * most if most > 1e-284 else 1e-300
        out[i] = own if own > least else least
    for p in range(np):
        highest = 0.0
        for i in range(nx):
            s = scale[nx + i * np + p]
            highest = s if s > highest else highest
        least = 1e-7 * rtol * most * per[p]
        least = least if least > 1e-16 * highest else 1e-16 * highest
        least = least if least > 1e-300 else 1e-300
        for i in range(nx):
            own = 0.1 * rtol * scale[nx + i * np + p]
            out[nx + i * np + p] = own if own > least else least
    return 0


def advance(  # noqa: C901, PLR0913, PLR0915  one function for the compiler
    t: Array,
    n: int,
    z: Array,
    nx: int,
    np: int,
    q: Array,
    u: Array,
    nu: int,
    table: Array,
    scale: Array,
    per: Array,
    work: Array,
    tableau: Array,
    rtol: float,
    longest: float,
    largest: float,
    budget: int,
) -> int:
    """Fill rows 1 … n − 1 of the table; 0, or 1 where steps become too small, too many, or z too large.

    `q` holds parameters, then room for inputs; `work` K (13, size), the new z and the tolerances; `tableau`
    A (12, 12), B, C, E3 and E5 of scipy's DOP853.
    """
    size = nx + nx * np
    nq = np
    new = 13 * size
    tol = 14 * size
    for j in range(nu):
        q[nq + j] = u[j]
    rates(t[0], z, q, work)
    tolerances(scale, nx, np, rtol, per, shifted(work, tol))
    large = 0.0
    fast = 0.0
    for j in range(size):
        a = z[j] / work[tol + j]
        large += a * a
        a = work[j] / work[tol + j]
        fast += a * a
    h = t[n - 1] - t[0]
    if large > 0.0 and fast > 0.0 and 0.01 * (large / fast) ** 0.5 < h:
        h = 0.01 * (large / fast) ** 0.5
    else:
        h = 1e-6 * h
    steps = 0
    bad = 0
    i = 0
    while i < n - 1 and bad == 0:
        now = t[i]
        for j in range(nu):
            q[nq + j] = u[i * nu + j]
        if nu > 0 and i > 0:
            rates(now, z, q, work)
        while now < t[i + 1] and bad == 0:
            steps += 1
            h = h if h < longest else longest
            last = 1 if now + 1.01 * h >= t[i + 1] else 0
            step = t[i + 1] - now if last == 1 else h
            for s in range(1, 13):
                for j in range(size):
                    work[new + j] = 0.0
                row = 12 * s
                for k in range(s if s < 12 else 12):
                    a = tableau[row + k]
                    if a < 0.0 or a > 0.0:
                        for j in range(size):
                            work[new + j] += a * work[k * size + j]
                for j in range(size):
                    work[new + j] = z[j] + step * work[new + j]
                at = now + tableau[156 + s] * step
                for j in range(nu):
                    part = (at - t[i]) / (t[i + 1] - t[i])
                    q[nq + j] = (1.0 - part) * u[i * nu + j] + part * u[(i + 1) * nu + j]
                rates(at, shifted(work, new), q, shifted(work, s * size))
            five = 0.0
            three = 0.0
            for j in range(size):
                a = 0.0
                b = 0.0
                for k in range(13):
                    a += tableau[182 + k] * work[k * size + j]
                    b += tableau[169 + k] * work[k * size + j]
                high = abs(z[j]) if abs(z[j]) > abs(work[new + j]) else abs(work[new + j])
                limit = work[tol + j] + rtol * high
                five += (a / limit) * (a / limit)
                three += (b / limit) * (b / limit)
            error = 0.0
            if five > 0.0 or three > 0.0:
                error = step * five / ((five + 0.01 * three) * size) ** 0.5
            if error < 1.0:
                grow = 10.0
                if error > 0.0 and 0.9 * error ** (-0.125) < 10.0:
                    grow = 0.9 * error ** (-0.125)
                # a step that a sample has cut short says little of the next
                if last == 0 or step * grow < h or step * grow > 2.0 * h:
                    h = step * grow
                now = t[i + 1] if last == 1 else now + step
                for j in range(size):
                    z[j] = work[new + j]
                    work[j] = work[12 * size + j]
                    scale[j] = abs(z[j]) if abs(z[j]) > scale[j] else scale[j]
                tolerances(scale, nx, np, rtol, per, shifted(work, tol))
            else:
                shrink = 0.1
                if error < 1e30 and 0.9 * error ** (-0.125) > 0.1:
                    shrink = 0.9 * error ** (-0.125)
                h = step * shrink
                if now + 0.01 * h <= now:
                    bad = 1
            if steps >= budget:
                bad = 1
            for j in range(nx):
                if not abs(z[j]) < largest:
                    bad = 1
        i += 1
        for j in range(size):
            table[i * size + j] = z[j]
    return bad


def integrate(
    system: Augmented, z0: FloatArray, scale: FloatArray, rtol: float, longest: float
) -> FloatArray | None:
    """States and sensitivities (n, size); None without the extra, or where the ordinary way must say why."""
    run = _machine(system)
    if run is None:
        return None
    t, size = system.t, system.size
    table = np.empty((len(t), size))
    table[0] = z0
    theta = np.abs(system.theta)
    arrays = {
        "t": t,
        "z": z0.copy(),
        "q": np.concatenate([system.theta, np.zeros(system.u.shape[1])]),
        "u": np.ascontiguousarray(system.u),
        "table": table,
        "scale": scale.copy(),
        "per": 1 / np.where(theta > 0, theta, 1.0),
        "work": np.zeros(15 * size),
        "tableau": _tableau(),
    }
    p = {name: array.ctypes.data for name, array in arrays.items()}
    inputs, budget = system.u.shape[1], BUDGET + 10 * len(t)
    failed = run(
        p["t"], len(t), p["z"], system.nx, system.np, p["q"], p["u"], inputs, p["table"], p["scale"],
        p["per"], p["work"], p["tableau"], rtol, min(longest, 1e300), LARGEST, budget,
    )  # fmt: skip
    return None if failed or not np.isfinite(table).all() else table


@cache
def _tableau() -> FloatArray:
    """The coefficients in one row: A with B as its last row, C, E3 and E5."""
    from scipy.integrate import DOP853

    a = np.zeros((13, 12))
    a[:12], a[12] = DOP853.A[:12, :12], DOP853.B
    return np.concatenate([a.ravel(), DOP853.C[:12], [1.0], DOP853.E3, DOP853.E5])


def _machine(system: Augmented) -> Callable[..., int] | None:
    """The compiled function of a model with sensitivities, made when it is integrated for the second time."""
    model = system.model
    if not system.np:
        return None
    store: dict[str, Any] = model.machine
    store["runs"] = store.get("runs", 0) + 1
    if "run" not in store and store["runs"] > 1:
        store["run"] = None
        written = model.source()
        if written is not None:
            try:
                store["machine"] = Machine(
                    "\n".join([written, *map(inspect.getsource, (tolerances, advance))])
                )
            except (ImportError, OSError, AttributeError):
                return None
            a, i, f = ctypes.c_void_p, ctypes.c_int64, ctypes.c_double
            kinds = [a, i, a, i, i, a, a, i, a, a, a, a, a, f, f, f, i]
            store["run"] = store["machine"].function("advance", kinds)
    found: Callable[..., int] | None = store.get("run")
    return found

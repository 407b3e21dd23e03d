"""The rotor equations solved the plain way: dense matrices of both planes, one loop over elements.

Written apart from `fem`, from its equations only, to be the judge between `fem` and its peers. With
z = x + i y, rotation from x to y at Ω and slopes dx/ds, dy/ds as angles,

    x:  M x'' + B x' + Ω G y' + K x + Ω B y + (supports)_x = f_x
    y:  M y'' + B y' − Ω G x' + K y − Ω B x + (supports)_y = f_y

Euler–Bernoulli elements are the cubic ones, so answers on one mesh are comparable digit by digit. With shear
the elements are polynomials of high degree in deflection and rotation, so answers are the continuum's, to
about ten digits on any mesh. A pedestal is two more unknowns.

Unknowns stand in the order of the axis: node 1 (x, θx, y, θy), inner unknowns of element 1, node 2, …
"""

from dataclasses import dataclass, replace

import numpy as np

DEGREE = 8  # of the polynomials of an element with shear


@dataclass(frozen=True)
class Dense:
    M: np.ndarray
    C: np.ndarray  # with everything proportional to velocity, gyroscopic part included
    K: np.ndarray  # with the circulatory part of material damping
    x: np.ndarray  # index of the deflection of each node, x-direction
    y: np.ndarray

    def dynamic(self, s):
        """s² M + s C + K."""
        return s * s * self.M + s * self.C + self.K


def assemble(rotor, speed):
    """All matrices at a rotating speed, supports taken at that speed."""
    model = rotor.model
    inner = DEGREE - 1 if model.shear else 0
    n = rotor.n_nodes
    step = 4 + 4 * inner
    node = step * np.arange(n)
    pedestals = [support for support in rotor.supports if support.pedestal is not None]
    size = node[-1] + 4 + 2 * len(pedestals)
    M, C, K = np.zeros((3, size, size))
    for i in range(rotor.n_elements):
        Me, Ge, Ke = _shear_element(rotor, i) if model.shear else _cubic_element(rotor, i)
        beta = rotor.material_damping[i]
        near = [node[i], node[i] + 1, node[i + 1], node[i + 1] + 1]
        x = np.array(near + [node[i] + 4 + k for k in range(2 * inner)])
        y = np.array([k + 2 for k in near] + [node[i] + 4 + 2 * inner + k for k in range(2 * inner)])
        M[np.ix_(x, x)] += Me
        M[np.ix_(y, y)] += Me
        K[np.ix_(x, x)] += Ke
        K[np.ix_(y, y)] += Ke
        C[np.ix_(x, x)] += beta * Ke
        C[np.ix_(y, y)] += beta * Ke
        C[np.ix_(x, y)] += speed * Ge
        C[np.ix_(y, x)] -= speed * Ge
        K[np.ix_(x, y)] += speed * beta * Ke
        K[np.ix_(y, x)] -= speed * beta * Ke
    for disc in rotor.discs:
        at = node[disc.node - 1]
        for plane in (0, 2):
            M[at + plane, at + plane] += disc.mass
            if model.rotary_inertia:
                M[at + plane + 1, at + plane + 1] += disc.diametral_inertia
        if model.gyroscopic:
            C[at + 1, at + 3] += speed * disc.polar_inertia
            C[at + 3, at + 1] -= speed * disc.polar_inertia
    foot = node[-1] + 4
    for support in rotor.supports:
        k, c = (_at_speed(support, values, speed) for values in (support.stiffness, support.damping))
        at = np.array([0, 2]) + node[support.node - 1]
        K[at + 1, at + 1] += support.tilting_stiffness
        if support.pedestal is None:
            K[np.ix_(at, at)] += k
            C[np.ix_(at, at)] += c
            continue
        below = np.array([foot, foot + 1])
        foot += 2
        for matrix, block in ((K, k), (C, c)):
            matrix[np.ix_(at, at)] += block
            matrix[np.ix_(below, below)] += block
            matrix[np.ix_(at, below)] -= block
            matrix[np.ix_(below, at)] -= block
        M[below, below] += support.pedestal.mass
        K[below, below] += np.broadcast_to(support.pedestal.stiffness, 2)
        C[below, below] += np.broadcast_to(support.pedestal.damping, 2)
    return Dense(M, C, K, node, node + 2)


def whirl(rotor, speed):
    """All finite eigenvalues λ, and their vectors in both planes.

    Returns λ (m,), X (m, N), Y (m, N): deflections, so that x = Re X e^{λt}.
    """
    D = assemble(rotor, speed)
    shift = 100.0  # rad/s: a free rotor has a singular K
    K = D.dynamic(shift)
    C = D.C + 2 * shift * D.M
    size = len(K)
    inverse = np.linalg.inv(K)
    companion = np.block([[-inverse @ C, -inverse @ D.M], [np.eye(size), np.zeros((size, size))]])
    values, vectors = np.linalg.eig(companion)
    finite = np.abs(values) > 1e-9 * np.abs(values).max()
    return 1 / values[finite] + shift, vectors[D.x][:, finite].T, vectors[D.y][:, finite].T


def synchronous(rotor, speeds):
    """K and N of undamped whirl at each speed itself, K q = Ω² N q; of the forward plane if that is all."""
    still = assemble(replace(rotor, supports=[], material_damping=0.0), 1.0).C
    for speed in speeds:
        D = assemble(rotor, speed)
        K, N = (D.K + D.K.T) / 2, D.M.astype(complex)
        N[: len(still), : len(still)] -= 1j * still
        if rotor.symmetric:
            feet = np.arange(len(still), len(K), 2)
            x, y = np.concatenate((D.x, D.x + 1, feet)), np.concatenate((D.y, D.y + 1, feet + 1))
            K, N = (A[np.ix_(x, x)] - 1j * A[np.ix_(x, y)] for A in (K, N))
        yield K, N


def response(rotor, unbalance, speed):
    """Complex amplitudes X, Y (N,) at one speed: x = Re X e^{iΩt}; unbalance {node: m r e^{iφ}}, kg·m."""
    D = assemble(rotor, speed)
    force = np.zeros(len(D.M), dtype=complex)
    for node, amount in unbalance.items():
        force[D.x[node - 1]] += amount * speed**2
        force[D.y[node - 1]] += -1j * amount * speed**2
    q = np.linalg.solve(D.dynamic(1j * speed), force)
    return q[D.x], q[D.y]


def _section(rotor, i):
    outer, inner = rotor.outer_diameter[i], rotor.inner_diameter[i]
    return np.pi / 4 * (outer**2 - inner**2), np.pi / 64 * (outer**4 - inner**4)


def _cubic_element(rotor, i):
    A, second = _section(rotor, i)
    L, E, rho = rotor.length[i], rotor.youngs_modulus[i], rotor.density[i]
    scale = np.outer([1, L, 1, L], [1, L, 1, L])
    stiffness = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    moving = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    turning = np.array([[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]])
    K = E * second / L**3 * scale * stiffness
    M = rho * A * L / 420 * scale * moving
    R = rho * second / (30 * L) * scale * turning
    return M + rotor.model.rotary_inertia * R, rotor.model.gyroscopic * 2 * R, K


def _shear_element(rotor, i):
    """Order of unknowns: w₁, ψ₁, w₂, ψ₂, inner w, inner ψ; ψ is the rotation of the section."""
    A, second = _section(rotor, i)
    L, E, rho = rotor.length[i], rotor.youngs_modulus[i], rotor.density[i]
    nu, m2 = rotor.poisson_ratio[i], (rotor.inner_diameter[i] / rotor.outer_diameter[i]) ** 2
    cowper = 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)
    shear = cowper * E / (2 * (1 + nu)) * A
    points, weights = np.polynomial.legendre.leggauss(DEGREE + 1)
    legendre = np.polynomial.legendre.Legendre.basis
    shapes = [0.5 * (legendre(0) - legendre(1)), 0.5 * (legendre(0) + legendre(1))]
    shapes += [legendre(k) - legendre(k - 2) for k in range(2, DEGREE + 1)]
    N = np.array([shape(points) for shape in shapes])
    dN = np.array([shape.deriv()(points) for shape in shapes]) * 2 / L
    inner = DEGREE - 1
    w, psi = (np.zeros((2 * len(shapes), len(points))) for _ in range(2))
    dw, dpsi = np.zeros_like(w), np.zeros_like(psi)
    w_rows = np.array([0, 2] + [4 + k for k in range(inner)])
    psi_rows = np.array([1, 3] + [4 + inner + k for k in range(inner)])
    w[w_rows], dw[w_rows], psi[psi_rows], dpsi[psi_rows] = N, dN, N, dN
    gamma = dw - psi
    weights = weights * L / 2
    K = E * second * (dpsi * weights) @ dpsi.T + shear * (gamma * weights) @ gamma.T
    R = rho * second * (psi * weights) @ psi.T
    M = rho * A * (w * weights) @ w.T + rotor.model.rotary_inertia * R
    return M, rotor.model.gyroscopic * 2 * R, K


def _at_speed(support, values, speed):
    """A 2 × 2 matrix from what a support may hold: a number or a matrix, constant or one per speed."""
    if not len(support.speeds):
        return _matrix(values)
    speeds = np.asarray(support.speeds, dtype=float)
    if not speeds[0] <= speed <= speeds[-1]:
        raise ValueError(f"{speed} rad/s is outside the table")
    if isinstance(values, (int, float)):
        return _matrix(values)
    table = np.array([_matrix(entry) for entry in values])
    k = min(max(int(np.searchsorted(speeds, speed)) - 1, 0), len(speeds) - 2)
    part = (speed - speeds[k]) / (speeds[k + 1] - speeds[k])
    return (1 - part) * table[k] + part * table[k + 1]


def _matrix(value):
    array = np.asarray(value, dtype=float)
    return array * np.eye(2) if array.ndim == 0 else array

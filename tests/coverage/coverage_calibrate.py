"""Does a calibrated rotor balance in one shot, do its intervals hold, is a misfit seen? Drawn machines.

Run `python tests/coverage/coverage_calibrate.py [SEED [MACHINES [LACKING]]]`: how many of each case,
and of those in which the model lacks something (1, 510, 510: 3 hours).

A machine is the compressor of `sample_data`, its rotor23 on unlike bearings, or an overhung fan of drawn
sizes on soft pedestals. Its bearings differ by 20 % from what is believed, each coefficient on its own,
modulus and discs by 1 %, pedestals by 10 %, the angles of its four probes by 2°. Unbalances stand at five
stations. One trial run, a weight in each of two planes at once, is read at four speeds, or at one; errors are
1 % and 1° of a reading and 2 % between runs: a third of that variance of each reading, common at a speed,
common to the run. Another day the unbalances are others, and one run is all there is: the calibrated rotor
gives the weights.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from coverage_balance import normal, of_runs, percent
from numpy.typing import NDArray
from scipy.special import chdtri

import fem
from balancing import Labels, ReadingErrors, Region, RunScatter, Trials, UndeterminedError, compare_check
from balancing.regions import real_parts
from fem import receptance_with_derivatives
from fem.assembly import assemble, multiply
from fem.parameters import with_parameters
from rotorid import read_rotor
from rotorid.calibration import RunReadings, calibrate
from rotorid.commands.balance import balance
from rotorid.commands.calibrate_options import unknowns
from rotorid.files import Job
from rotorid.files.job_keys import Plane, Sensor
from rotorid.files.table_layouts import Conventions

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

RPM = np.pi / 30
PROBES = ("DE x", "DE y", "NDE x", "NDE y")
READING, RUN = ReadingErrors(0.01, np.radians(1.0)), RunScatter(0.02)
UNBALANCE = 3e-4
"""kg·m, of each station in each direction."""
TRIAL = UNBALANCE * np.sqrt(10.0) * np.array([[0, 0], [1, 1j]])
"""The bare rotor, and a weight in each plane as large as all unbalances together."""
BOW = 2e-5
"""m, in each direction."""
GOOD, NEAR = 0.1, 1.3
"""Of the vibration, and of what the exact model leaves."""
NORMAL = 1.96


class Machine(NamedTuple):
    """As it is believed to be: nodes of unbalances, planes and the two ends' probes, speeds, rad/s."""

    rotor: fem.Rotor
    stations: tuple[int, ...]
    planes: tuple[int, int]
    probes: tuple[int, int]
    speeds: FloatArray

    @property
    def sensors(self):
        """Two probes at each end."""
        return tuple(fem.Sensor(node, angle) for node in self.probes for angle in (45.0, 135.0))

    def unknowns(self, *, exact=False):
        """What `rotorid calibrate --estimate "bearing[*].*" --prior "…=20%"` takes as unknown."""
        prior = "bearing[*].k*=20%, bearing[*].c*=20%"
        return unknowns(self.rotor, PROBES, "bearing[*].*", prior, exact=exact)


class Truth(NamedTuple):
    """What the machine really is: numbers by path, what unbalances at all stations and in the planes do."""

    numbers: dict[str, float]
    speeds: FloatArray
    W_stations: ComplexArray
    W: ComplexArray
    bow: ComplexArray


class Outcome(NamedTuple):
    """Of one machine: what is left, true, relative to the vibration; errors beside their covariance.

    `left_exact` is what the exact model would leave from the same reading, `left_believed` the uncalibrated
    one. Of the numbers: errors over deviations (NaN at a bound), those that the data tell more of than was
    known before, dᵀ C⁻¹ d of all, and `width`, their deviations over the least possible; whether the joint
    region of the weights holds the true ones; of a check run: whether each reading is within its region, and
    whether all are, jointly. `chance` is that of a larger χ², `told` that a trial run is needed.
    """

    left: float
    left_exact: float
    left_believed: float
    numbers: FloatArray
    seen: NDArray[np.bool_]
    joint: float
    inside: bool
    readings: NDArray[np.bool_]
    check: bool
    chance: float
    told: bool
    words: tuple[str, ...]
    width: FloatArray

    @property
    def good(self):
        """Whether the shot is as good as wanted."""
        return self.left <= max(GOOD, NEAR * self.left_exact)


def compressor(_):
    """Of the samples."""
    rotor = read_rotor(SAMPLES / "compressor" / "rotor.toml")
    return Machine(rotor, (8, 10, 12, 14, 16), (8, 16), (3, 23), np.array([2500, 3500, 4300, 6000]) * RPM)


def rotor23(_):
    """Twelve discs on bearings that are unlike in x and y and couple both."""
    plain = read_rotor(SAMPLES / "rotor23.csv")
    discs = [replace(d, polar_inertia=0.02 * d.mass, diametral_inertia=0.011 * d.mass) for d in plain.discs]
    stiffness, damping = ((1e8, 8e6), (-6e6, 6e7)), ((2e5, 0.0), (0.0, 1.5e5))
    bearings = [fem.Support(node, stiffness, damping) for node in (2, 22)]
    rotor = replace(plain, discs=discs, supports=bearings, model=fem.Model(True, True, True))
    return Machine(rotor, (7, 9, 11, 13, 15), (7, 15), (3, 21), np.array([1000, 1500, 3000, 4500]) * RPM)


def overhung(random):
    """A fan whose wheel, shaft, bearings and soft pedestals are drawn."""

    def between(low, high):
        return np.exp(random.uniform(np.log(low), np.log(high)))

    mass, size = between(60, 200), between(0.7, 1.2)
    wheel = fem.Disc(17, mass, mass * size**2 / 10, mass * size**2 / 17)
    hub = fem.Disc(1, between(8, 25), 0.1, 0.06)

    def bearing(node):
        k, c = between(8e7, 3e8), between(5e4, 2e5)
        stiffness = ((k, 0.05 * k), (-0.03 * k, k * between(0.5, 1)))
        stand = (between(3e7, 1e8), between(3e7, 1e8))
        pedestal = fem.Pedestal(between(80, 300), stand, between(5e3, 3e4))
        return fem.Support(node, stiffness, ((c, 0.0), (0.0, c * between(0.7, 1.4))), pedestal=pedestal)

    bearings = [bearing(4), bearing(13)]
    rotor = fem.Rotor(
        [0.1] * 16,
        between(0.09, 0.13),
        discs=[hub, wheel],
        supports=bearings,
        model=fem.Model(True, True, True),
    )
    critical = fem.critical_speeds(rotor, n=1).frequencies[0]
    return Machine(rotor, (1, 6, 9, 16, 17), (1, 17), (4, 13), critical * np.array([0.7, 0.9, 1.1, 1.4]))


SAMPLES = Path(__file__).parents[2] / "sample_data"
MACHINES = {
    "compressor": compressor,
    "rotor23": rotor23,
    "overhung": overhung,
}

CASES = {
    "four speeds": {},
    "one speed": {"one_speed": True},
    "exact, four speeds": {"exact": True},
    "exact, one speed": {"exact": True, "one_speed": True},
    "third bearing": {"third": True},
    "unbalance, a bow besides": {"modelled": 0, "bow": BOW},
}

WHOLE = ("four speeds", "one speed")
"""Cases in which the model lacks nothing."""


def third_bearing(random, rotor):
    """A further bearing somewhere between the two, a tenth as stiff to as stiff as these."""
    first, last = (support.node for support in rotor.supports[:2])
    k = rotor.supports[0].at(200.0)[0][0, 0] * 10 ** random.uniform(-1.0, 0.0)
    further = fem.Support(int(random.integers(first + 2, last - 1)), k, 1e-3 * k, kind="seal")
    return replace(rotor, supports=(*rotor.supports, further))


def bent(rotor, sensors, speeds):
    """What the probes read of a rotor bent like a parabola by 1 m between its ends, (S, C)."""
    A = assemble(rotor)
    x = np.append(0.0, np.cumsum(rotor.length)) / np.sum(rotor.length)
    v = np.zeros((A.size, 1))
    at = np.array([A.deflection(node) for node in range(1, rotor.n_nodes + 1)])
    v[at, 0], v[at + 1, 0] = 4 * x * (1 - x), 4 * (1 - 2 * x) / np.sum(rotor.length)
    rows = np.array([A.deflection(rotor.node(sensor.node)) for sensor in sensors])
    angles = np.radians([sensor.angle for sensor in sensors])
    return receptance_with_derivatives(rotor, multiply(A.shaft, v), rows, angles, speeds, ()).H[..., 0]


def draw(random, machine, *, one_speed, third=False, bow=0.0):
    """A machine of this kind as it really is."""
    numbers = {u.path: random.normal(*u.prior) for u in machine.unknowns() if u.prior}
    rotor = with_parameters(machine.rotor, numbers)
    rotor = third_bearing(random, rotor) if third else rotor
    speeds = machine.speeds[[random.integers(4)]] if one_speed else machine.speeds
    turned = [numbers[f"probe[{probe}].angle"] for probe in PROBES]
    sensors = [fem.Sensor(s.node, s.angle + a) for s, a in zip(machine.sensors, turned, strict=True)]
    W_stations, W = (
        fem.influence(rotor, list(nodes), sensors, speeds).W for nodes in (machine.stations, machine.planes)
    )
    of_bow = bow * normal(random, 1) * bent(rotor, sensors, speeds) if bow else np.zeros(W.shape[:2])
    return Truth(numbers, speeds, W_stations, W, of_bow)


def read(random, Y):
    """Runs (R, S, C) as they are read."""
    R, S, C = Y.shape
    kinds = normal(random, R, 1, 1) + normal(random, R, S, 1) + normal(random, R, S, C)
    a, b = random.standard_normal((2, R, S, C))
    run = Y * (1 + RUN.relative / np.sqrt(3) * kinds)
    return run * (1 + READING.amplitude * a) * np.exp(1j * READING.phase * b)


def trials(machine, speeds, readings, weights):
    """Runs of this machine."""
    names = tuple(f"run {k + 1}" for k in range(len(readings)))
    planes = tuple(f"plane {node}" for node in machine.planes)
    labels = Labels(vibration_unit="m", weight_unit="kg_m")
    return Trials(names, speeds, PROBES, planes, readings, weights, READING, labels, run_errors=RUN)


def least_std(machine, truth, data, bare, numbers):
    """Least standard deviations (n,) of numbers, by Cramér and Rao, with the true errors and the priors."""
    Y = np.stack([bare + truth.W @ T for T in TRIAL])
    _, dW = data.coefficients(machine.rotor, truth.numbers, [one.path for one in numbers])
    each, *common = (of_runs(kind, Y, Y) for kind in ("independent", "common at a speed", "common to a run"))
    run = RUN.relative / np.sqrt(3) * np.concatenate((each, *common))
    free = 0 * Y + 100 * abs(Y).max() * np.eye(bare.size).reshape(-1, 1, *bare.shape)
    along = np.concatenate(
        (READING.amplitude * each, 1j * READING.phase * each, run, 1j * run, free, 1j * free)
    )
    E, J = (
        real_parts(A.reshape(len(A), -1)) for A in (along, np.einsum("nscp,rp->nrsc", dW[..., :2], TRIAL))
    )
    known = np.diag([one.prior[1] ** -2.0 for one in numbers])
    return np.sqrt(np.diag(np.linalg.inv(J @ np.linalg.solve(E.T @ E, J.T) + known)))


def one_machine(
    random,
    name,
    *,
    one_speed=False,
    exact=False,
    third=False,
    bow=0.0,
    modelled=None,
):
    """Draw a machine, calibrate it, balance it another day, see.

    `exact`: only the bearings are unknown. `modelled`: the bare rotor's readings count by unknown unbalances
    at the stations and so many shapes of a bow.
    """
    machine = MACHINES[name](random)
    truth = draw(random, machine, one_speed=one_speed, third=third, bow=bow)
    bare = truth.W_stations @ (UNBALANCE * normal(random, 5)) + truth.bow
    measured = read(random, np.stack([bare + truth.W @ T for T in TRIAL]))
    data = RunReadings(
        trials(machine, truth.speeds, measured, TRIAL),
        machine.planes,
        np.ones(2),
        machine.sensors,
        unbalance=machine.stations if modelled is not None else (),
        bow=modelled or 0,
    )
    numbers = machine.unknowns(exact=exact)
    held = [one for one in machine.unknowns() if exact and one.beside]
    found = calibrate(machine.rotor, numbers, [data], exact=held, side_starts=False)
    width = found.std / least_std(machine, truth, data, bare, numbers)
    try:
        return shot(random, machine, truth, found)._replace(width=width)
    except UndeterminedError as error:  # which leaves the machine as it is
        nothing, words = np.zeros(0), (*found.warnings, str(error))
        return Outcome(
            1.0,
            np.nan,
            np.nan,
            nothing,
            nothing > 0,
            np.inf,
            False,
            nothing > 0,
            False,
            found.chance,
            not found.explained,
            words,
            nothing,
        )


def shot(random, machine, truth, found):
    """Balance another day, and a third with unbalance in the planes alone: true weights are known then."""
    vibration = truth.W_stations @ (UNBALANCE * normal(random, 5)) + truth.bow
    measured = read(random, vibration[None])
    made = corrected(machine, found.rotor, truth.speeds, measured)
    after = vibration + truth.W @ made.result.weights
    run = trials(machine, truth.speeds, read(random, after[None]), made.result.weights[None])
    check = compare_check(made.result, run, made.influence, made.job.trials)
    U = UNBALANCE * np.sqrt(2.5) * normal(random, 2)
    other = corrected(machine, found.rotor, truth.speeds, read(random, (truth.W @ U)[None])).result
    true = np.array([truth.numbers[unknown.path] for unknown in found.unknowns])
    d = found.fit.estimate.solution - true
    free = found.std > 0

    def left(W):
        return left_by(-np.linalg.lstsq(W.reshape(-1, 2), measured.ravel(), rcond=None)[0])

    def left_by(D):
        return np.linalg.norm(vibration + truth.W @ D) / np.linalg.norm(vibration)

    believed = fem.influence(machine.rotor, list(machine.planes), list(machine.sensors), truth.speeds)
    return Outcome(
        left_by(made.result.weights),
        left(truth.W),
        left(believed.W),
        d / np.where(free, found.std, np.nan),
        found.data_share > 0.5,
        distance(d[free], found.covariance[np.ix_(free, free)]),
        Region.of(other.draws, other.weights).holds(-U),
        check.distance.ravel() ** 2 < chdtri(2, 0.05),
        check.explained,
        found.chance,
        not found.explained,
        found.warnings,
        found.std,
    )


def distance(d, covariance):
    """Square of an error by its covariance."""
    return d @ np.linalg.solve(covariance, d) if d.size else np.inf


def corrected(machine, rotor, speeds, readings):
    """Weights by this calibrated rotor, as `rotorid balance` finds them."""
    runs = trials(machine, speeds, readings, np.zeros((1, 2)))
    planes = {name: Plane(node=node) for name, node in zip(runs.planes, machine.planes, strict=True)}
    sensors = {
        name: Sensor(node=probe.node, angle_deg=probe.angle)
        for name, probe in zip(PROBES, machine.sensors, strict=True)
    }
    return balance(Job(runs, None, Conventions(), (), planes, sensors=sensors, rotor=rotor))


def simulate(machines, seed, name, case):
    """So many machines of a kind."""
    key = [seed, list(MACHINES).index(name), list(CASES).index(case)]
    return [one_machine(np.random.default_rng([*key, k]), name, **CASES[case]) for k in range(machines)]


def shots(name, found):
    """How many shots are good, and what they leave."""
    parts = [[one.good for one in found if bool(one.words) == said] for said in (False, True)]
    left = np.nanmedian([(one.left_believed, one.left, one.left_exact) for one in found], axis=0)
    counts = "".join(f"{percent(part):>7} of {len(part):4d}" for part in parts)
    return f"{name:<28}{counts}" + "".join(f"{value:9.3f}" for value in left)


def row(name, found, columns):
    """How many machines, and per cent."""
    return f"{name:<36}{len(found):5d}" + "".join(f"{percent(column):>10}" for column in columns)


def intervals(name, found):
    """How many intervals hold the truth, and of numbers seen the median ± over the least."""
    parts = [(one.numbers, one.seen, one.width) for one in found]
    z, seen, width = np.concatenate([np.zeros((3, 0)), *parts], axis=1)
    known = ~np.isnan(z)
    ratios = width[known & (seen > 0)]
    columns = [
        abs(z[known]) < NORMAL,
        abs(z[known & (seen > 0)]) < NORMAL,
        [one.joint < chdtri(np.sum(~np.isnan(one.numbers)), 0.05) for one in found],
        [one.inside for one in found],
        [inside for one in found for inside in one.readings],
        [one.check for one in found],
    ]
    return row(name, found, columns) + (f"{np.median(ratios):9.2f}" if ratios.size else "")


def lacks(name, found):
    """How many are recognised, and what the others' answers are worth."""
    columns = [
        [one.told for one in found],
        [one.told or one.inside for one in found],
        [one.told or one.check for one in found],
        [one.told or one.good for one in found],
        [one.good for one in found],
    ]
    return row(name, found, columns)


def main(seed=1, machines=510, lacking=510):
    """Print the tables."""

    def outcomes(name, case):
        return simulate((machines if case in WHOLE else lacking) // len(MACHINES), seed, name, case)

    report(outcomes)


def report(outcomes):
    """The tables of outcomes by machine and case."""
    cells = {(name, case): outcomes(name, case) for case in CASES for name in MACHINES}
    of = {case: [one for name in MACHINES for one in cells[name, case]] for case in CASES}

    print(
        "a. One shot: leaves at most 0.1 of the vibration, or 1.3 times what the exact model leaves, per cent"
    )
    print(f"{'':<28}{'silent':>15}{'warned':>15}{'  left: believed, calibrated, exact':>26}")
    for case in WHOLE:
        for name in MACHINES:
            print(shots(f"{name}: {case}", cells[name, case]))

    print("\nb. 95 % intervals that hold the truth, per cent")
    print(f"{'':<41}   numbers      seen   jointly   weights  readings     check    ±/C–R")
    for case in WHOLE:
        for said, word in ((False, "silent"), (True, "warned")):
            print(intervals(f"{case}, {word}", [one for one in of[case] if bool(one.words) == said]))

    print("\nc. What the model lacks, per cent: recognised, or else the shot's answer holds")
    print(f"{'':<41}      told or weights  or check   or good      good")
    for case in CASES:
        if case not in WHOLE:
            for name in MACHINES:
                print(lacks(f"{name}: {case}", cells[name, case]))

    print("\nd. Complete models: machines with a χ² that chance would exceed in so many per cent, per cent")
    print(f"{'':<41}        1         5        20        50")
    for case in WHOLE:
        chance = np.array([one.chance for one in of[case]])
        print(row(case, chance, [chance < level for level in (0.01, 0.05, 0.2, 0.5)]))


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))

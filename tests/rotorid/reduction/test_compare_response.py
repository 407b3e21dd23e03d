"""The response of the small model beside the full rotor's."""

import json

import numpy as np
import pytest
from cases import each_of
from fem_rotors import ROOT, rotor23
from small_models import compare_response, small_rotor

import fem
import rotorid
from rotorid.reduction import reduce

NODES = (7, 12, 18)


def book(modes=2, nodes=NODES):
    rotor = rotor23()
    return small_rotor(rotor, nodes, reduce(rotor, nodes, modes).masses.solution)


def lumped(supports, *, material=0.0, masses=(40.0, 90.0, 25.0)):
    """A massless shaft with masses at nodes 2, 4 and 5: the small model of it is the rotor itself."""
    rotor = fem.Rotor(
        [0.2, 0.3, 0.25, 0.15, 0.3],
        [0.05, 0.06, 0.06, 0.05, 0.05],
        density=0.0,
        discs=[fem.Disc(n, m) for n, m in zip((2, 4, 5), masses, strict=True)],
        supports=supports,
        material_damping=material,
    )
    return small_rotor(rotor, (2, 4, 5), masses)


def worst_part(cost):
    """Of the largest coefficient at each speed, band or not."""
    return np.nanmax(np.abs(cost.small - cost.full) / np.abs(cost.full).max(axis=(1, 2))[:, None, None])


def test_reference_rotor():
    """Within 8 % of the largest entry, median below 1 %, up to 1.1 times the second critical speed."""
    small = book()
    cost = compare_response(small)
    second = fem.critical_speeds(rotor23(), 2).frequencies[1]
    assert cost.speeds[-1] == pytest.approx(1.1 * second, rel=1e-12)
    assert cost.sizes["largest"] < 0.08
    assert cost.sizes["median"] < 0.01
    assert cost.warnings == ()
    # The same in the compliance form of the book, without the small rotor's matrices.
    alpha, m = fem.compliance(rotor23(), NODES), np.diag(small.small.masses[small.small.masses > 0])
    w2 = cost.speeds[:, None, None] ** 2
    W = np.linalg.solve(np.linalg.inv(alpha) - w2 * m, w2 * np.eye(3))
    difference = np.abs(W - cost.full) / np.abs(cost.full).max(axis=(1, 2))[:, None, None]
    used = difference[~cost.excluded].max(axis=(1, 2))
    assert cost.sizes["largest"] == pytest.approx(used.max(), rel=1e-8)
    assert cost.sizes["median"] == pytest.approx(np.median(used), rel=1e-8)


def test_frequency_is_not_response():
    """Nodes 3, 11, 14 have the best frequencies of all triples, and follow the rotor badly; it is said."""
    cost = compare_response(book(nodes=(3, 11, 14)))
    assert cost.sizes["largest"] > 1.0
    assert "take more masses" in cost.summary()
    assert cost.where[1:] == (3, 3)


def test_bands():
    cost = compare_response(book(), np.linspace(0.0, 600.0, 601), bands=0.1)
    first, second = fem.critical_speeds(rotor23(), 2).frequencies
    assert cost.criticals == pytest.approx([first, second])
    expected = (cost.speeds == 0) | np.any(
        [(cost.speeds > 0.9 * w) & (cost.speeds < 1.1 * w) for w in (first, second)], axis=0
    )
    assert (cost.excluded == expected).all()
    assert cost.left_out[0] == pytest.approx((0.9 * first, 1.1 * first))
    assert np.isnan(cost.relative_difference[0]).all()
    assert "left out: " in cost.answer.whole()
    narrow = compare_response(book(), cost.speeds, bands=0.02)
    assert narrow.sizes["largest"] > cost.sizes["largest"]
    assert np.count_nonzero(narrow.excluded) < np.count_nonzero(cost.excluded)


def test_where():
    cost = compare_response(book(), np.linspace(10.0, 450.0, 89))
    speed, sensor, plane = cost.where
    k = int(np.flatnonzero(cost.speeds == speed)[0])
    assert not cost.excluded[k]
    assert cost.worst[~cost.excluded].max() == cost.sizes["largest"]
    own = cost.relative_difference[k, cost.sensors.index(sensor), cost.nodes.index(plane)]
    assert own == cost.sizes["largest"]
    assert cost.relative_difference.shape == cost.full.shape == cost.small.shape == (89, 3, 3)


BEARINGS = {
    "springs": [fem.Support(1, 2e6), fem.Support(6, 3e6)],
    "damped": [fem.Support(1, 2e6, 800.0), fem.Support(6, 3e6, 500.0)],
    "whirling": [
        fem.Support(1, ((2e6, 3e5), (-2e5, 3e6)), ((900.0, 50.0), (20.0, 700.0))),
        fem.Support(6, 3e6, 500.0, pedestal=fem.Pedestal(60.0, (8e6, 5e6), 2e3)),
    ],
    "tables": [
        fem.Support(1, [2e6, 1e6, 4e6], [900.0, 700.0, 800.0], speeds=(0.0, 100.0, 900.0)),
        fem.Support(
            6,
            [((2e6, 1e5), (-1e5, 2e6)), ((3e6, 4e5), (-4e5, 3e6))],
            [500.0, 300.0],
            speeds=(0.0, 800.0),
        ),
    ],
}


@pytest.mark.parametrize("kind", BEARINGS)
def test_masses_that_are_lumped(kind):
    """A massless shaft with discs: nothing is lost by the reduction, in x and in y, with phases."""
    small = lumped(BEARINGS[kind], material=1e-5 if kind == "whirling" else 0.0)
    cost = compare_response(small, np.linspace(3.0, 700.0, 60), bands=0.05)
    assert cost.sizes["largest"] < 1e-8
    assert worst_part(cost) < 1e-6
    assert cost.full.shape[1] == (3 if small.rotor.symmetric else 6)
    assert "No critical speed" in cost.answer.whole() or cost.criticals.size


def test_reads_as_the_small_rotor():
    """Readings in x are those of `SmallRotor.response`, which solves both planes."""
    for kind in BEARINGS:
        small = lumped(BEARINGS[kind])
        cost = compare_response(small, [20.0, 111.0, 340.0], bands=0.0)
        for k, node in enumerate(small.small.massive):
            response = small.small.response(cost.speeds, {node: 1.0})
            expected = response.readings(small.small.massive)
            assert cost.small[:, :3, k] == pytest.approx(expected, rel=1e-9)


def test_gyroscopic_rotor_with_tables():
    """The compressor with three masses: speeds inside its tables by default, both planes, and it is said."""
    rotor = rotorid.read_rotor(ROOT / "sample_data" / "compressor" / "rotor.toml")
    nodes = (8, 14, 20)
    cost = compare_response(small_rotor(rotor, nodes, reduce(rotor, nodes, 1).masses.solution))
    assert cost.speeds[0] == pytest.approx(1000 * np.pi / 30)
    assert len(cost.sensors) == 6
    assert cost.sizes["median"] < 0.03
    assert (~cost.excluded).any()
    first = cost.speeds < 0.9 * cost.criticals[0]
    assert cost.worst[first].max() < 0.04
    whole = fem.influence(rotor, nodes, [(8, 90.0)], cost.speeds[:1]).W[0, 0]
    assert cost.full[0, 3] == pytest.approx(whole)


def test_growing_is_said():
    q = 1e6
    small = lumped([*BEARINGS["damped"], fem.Support(4, ((0, q), (-q, 0)), kind="seal")])
    cost = compare_response(small, [50.0, 100.0])
    assert any("the steady response does not exist" in text for text in cost.warnings)


def test_no_critical_speed_in_the_tables():
    supports = [fem.Support(n, [2e6, 2e6], [500.0, 500.0], speeds=(0.0, 20.0), name="plain") for n in (1, 6)]
    cost = compare_response(lumped(supports), [5.0, 10.0, 20.0])
    assert cost.criticals.size == 0
    assert not cost.excluded.any()
    assert any("no band is left out" in text for text in cost.warnings)
    with pytest.raises(ValueError, match="plain"):
        compare_response(lumped(supports), [5.0, 30.0])


def test_outputs():
    cost = compare_response(book(), np.linspace(0.0, 500.0, 26))
    text = json.dumps(cost.to_dict(), allow_nan=False)
    back = json.loads(text)
    assert back["largest"] == cost.sizes["largest"]
    assert back["relative_difference"][0] is None
    assert back["where"]["plane"] == cost.where[2]
    assert len(back["relative_difference"]) == 26


@each_of(
    ("speeds", "options", "message"),
    [
        ([10.0, 5.0], {}, "ascend"),
        ([-1.0, 5.0], {}, "not negative"),
        ([np.nan], {}, "finite"),
        (["a"], {}, "numbers"),
        ([], {}, "in one list"),
        ([10.0], {"bands": 1.0}, "part of the critical speed"),
        ([10.0], {"bands": -0.1}, "part of the critical speed"),
        ([10.0], {"bands": np.nan}, "part of the critical speed"),
        ([0.0, 135.0], {}, "other speeds, or narrower bands"),
    ],
)
def test_bad_input(speeds, options, message):
    with pytest.raises(ValueError, match=message):
        compare_response(book(), speeds, **options)


def test_modal_damping_is_left_out_of_the_comparison():
    """The full rotor has none: what it takes away from a peak is no error of the reduction."""
    small = book()
    damped = small_rotor(
        small.rotor,
        small.small.massive,
        small.small.masses[small.small.masses > 0],
        modal_damping=(0.05, 0.05),
    )
    speeds = [120.0, 135.0]
    plain, more = (compare_response(each, speeds, bands=0.0) for each in (small, damped))
    np.testing.assert_allclose(more.small, plain.small, rtol=1e-12)
    assert more.warnings[0].startswith("the modal damping of the small model is left out")
    node = damped.small.massive[0]
    assert damped.small.response(speeds, {node: 1.0}).largest[1] < 0.1 * np.abs(plain.small[1, :, 0]).max()

"""The proof table: its rule, its numbers, and that it notices a wrong formula."""

import csv
import dataclasses
import inspect
import json
import math
import textwrap
from collections import Counter
from decimal import ROUND_HALF_EVEN, Decimal
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from cases import each_of
from hypothesis import given
from hypothesis import strategies as st

import fem.matrices.elements
from rotorid.reduction import equivalent_masses
from rotorid.samples import sample_data
from rotorid.tables import read_rotor
from rotorid.validation import PROVIDERS, Group, Validation, formula_50, row, validate
from rotorid.validation.row import half_unit, number, printed_table, tables

DATA = Path(__file__).parents[2] / "data"
DIGITS = st.integers(min_value=-99999, max_value=99999)
EXPONENTS = st.integers(min_value=-12, max_value=8)


@pytest.fixture(scope="module")
def proof():
    return validate()


def group(proof, name):
    return next(g.rows for g in proof.groups if g.name == name)


def from_source(proof, start):
    return [r for r in proof.rows if r.source.startswith(start)]


# the rule


def written(digits, decimals, exponent):
    """ "-1.25e-7" from -125, 2 and -7."""
    text = f"{Decimal(digits).scaleb(-decimals):f}"
    return f"{text}e{exponent}" if exponent else text


@given(DIGITS, st.integers(0, 5), EXPONENTS, st.fractions(min_value=-0.499, max_value=0.499))
def test_what_rounds_to_the_printed_number_agrees(digits, decimals, exponent, part):
    text = written(digits, decimals, exponent)
    unit = Decimal(1).scaleb(exponent - decimals)
    value = Decimal(text) + unit * Decimal(part.numerator) / Decimal(part.denominator)
    assert value.quantize(unit, ROUND_HALF_EVEN) == Decimal(text)
    assert row("a source", "a number", text, float(value)).status == "agrees"


@given(DIGITS, st.integers(0, 5), EXPONENTS, st.floats(0.501, 50), st.sampled_from([-1, 1]))
def test_what_rounds_to_another_number_differs(digits, decimals, exponent, part, sign):
    text = written(digits, decimals, exponent)
    unit = float(f"1e{exponent - decimals}")
    found = row("a source", "a number", text, number(text) + sign * part * unit)
    assert found.status == "differs"
    assert found.misfit > 1


@given(DIGITS, st.integers(0, 5), EXPONENTS)
def test_half_a_unit_is_that_of_the_last_printed_digit(digits, decimals, exponent):
    text = written(digits, decimals, exponent)
    assert half_unit(text) == pytest.approx(0.5 * 10.0 ** (exponent - decimals), rel=1e-14)
    assert number(text) == float(text)


@pytest.mark.parametrize(
    ("text", "value", "half"),
    [
        ("135.2394", 135.2394, 5e-5),
        ("1.003e4", 1.003e4, 5.0),
        ("8.92e-8", 8.92e-8, 5e-11),
        ("-1.119810467E-1", -0.1119810467, 5e-11),
        (".41", 0.41, 0.005),
        ("−0.5", -0.5, 0.05),
        ("10", 10.0, 0.5),
    ],
)
def test_printed_texts(text, value, half):
    assert number(text) == value
    assert half_unit(text) == half


@each_of("text", ["", "1,5", "1.5.2", "1e", "nan", "inf", "0x10", "5 kg", " 5", ".", "1e999", 5.0])
def test_what_is_no_printed_number_is_refused(text):
    with pytest.raises(ValueError, match="number"):
        number(text)


def test_every_row_says_why_it_is_not_judged_as_printed(proof):
    for r in proof.rows:
        assert r.source.strip()
        assert r.quantity.strip()
        assert bool(r.reason.strip()) == (r.tolerance != half_unit(r.text)), r
        assert 0 < r.tolerance < math.inf
        assert r.corrected is None or number(r.corrected) != r.printed
        assert bool(r.erratum.strip()) >= (r.corrected is not None)
        assert bool(r.erratum) == bool(r.erratum.strip())


def test_an_erratum_really_differs_and_is_what_the_correction_says():
    def status(computed, **more):
        return row("a source", "a number", "1.0", computed, erratum="a wrong digit", **more).status

    assert status(2.0) == "erratum"
    assert status(1.04) == "differs"  # agrees with the print: no erratum
    assert status(2.04, corrected="2.0") == "erratum"
    assert status(2.06, corrected="2.0") == "differs"
    assert status(1.04, corrected="1.04") == "differs"
    assert status(math.nan) == "differs"
    wide = {"tolerance": 0.5, "reason": "read off a figure"}
    assert status(1.4, **wide) == "differs"
    assert status(1.6, **wide) == "erratum"


def test_what_was_not_computed_differs_and_is_null():
    lost = row("a source", "a number", "1.0", math.nan)
    assert lost.status == "differs"
    assert lost.to_dict()["computed"] is lost.to_dict()["difference"] is None
    assert "nothing was computed" in lost.note


# the numbers


@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("rotor", 75),
        ("masses", 53),
        ("lessons", 110),
        ("formulas", 34),
        ("closed_forms", 11),
        ("balancing", 40),
    ],
)
def test_every_printed_number_is_there(proof, name, least):
    assert len(group(proof, name)) >= least


def test_time_records_are_there(proof):
    assert len(from_source(proof, "[Q]")) >= 300
    assert len(from_source(proof, "[F]")) >= 6


def test_no_number_differs(proof):
    assert [(r.source, r.quantity, r.text, r.computed) for r in proof.rows if r.status == "differs"] == []
    assert proof.holds
    assert sum(proof.counts.values()) == len(proof.rows)
    assert len({(r.source, r.quantity) for r in proof.rows}) == len(proof.rows)


def test_every_erratum_and_every_other_tolerance_has_its_reason(proof):
    for r in proof.rows:
        where = (r.source, r.quantity)
        assert (r.status in {"erratum", "consequence"}) is bool(r.erratum), where
        assert (r.tolerance != half_unit(r.text)) <= bool(r.reason), where
        assert r.erratum in r.note, where
        assert r.reason in r.note, where
        if r.erratum:
            assert len(r.erratum.split()) >= 4, where
            assert r.difference > 0 if r.kind == "bound" else abs(r.difference) > r.tolerance, where
        if r.reason:
            assert len(r.reason.split()) >= 4, where


def test_no_tolerance_is_wider_than_its_numbers_need(proof):
    """Wider than half a unit only where a number of its source and reason needs it, by a tenth at least."""
    wide = {}
    for r in proof.rows:
        if r.tolerance > half_unit(r.text):
            assert r.status in {"agrees", "given"}, r
            assert r.tolerance < 0.1 * abs(r.printed), r
            wide.setdefault((r.source, r.reason), []).append(r)
    for rows in wide.values():
        assert any(abs(r.difference) > half_unit(r.text) for r in rows), rows[0]
        close = rows[0].tolerance < 1e-9 * abs(rows[0].printed)  # what double precision holds
        assert close or max(r.misfit for r in rows) > 0.1, rows[0]
    shown = " ".join(proof.answer.whole().split()).lower()
    assert all(" ".join(reason.lower().split()) in shown for _, reason in wide)


# kinds


def test_given_values_are_listed_apart(proof):
    """Times, inputs, starting values, shapes at the node where they are 1: nothing moves them."""
    given = [r for r in proof.rows if r.status == "given"]
    assert Counter(r.source for r in given) == {
        "[S] task 9.1, mode shapes": 3,
        "[Q] table 2.1": 30,
        "[Q] table 2.2": 42,
        "[Q] table 2.3": 3,
        "[F] record": 6,
    }
    assert {r.kind for r in given} == {"given"}
    assert not any(r.to_dict()["could_fail"] for r in given)
    assert all(r.to_dict()["could_fail"] for r in proof.rows if r.kind != "given")
    assert max(abs(r.difference) for r in given) < 5e-4  # they are right all the same


def test_a_given_value_that_is_copied_wrongly_differs():
    right = row("a source", "a number", "1.0", 1.0)
    assert dataclasses.replace(right, kind="given").status == "given"
    assert dataclasses.replace(right, kind="given", computed=1.1).status == "differs"


def test_consequences_name_the_misprint_that_they_follow_from(proof):
    rows = [r for r in proof.rows if r.status == "consequence"]
    assert Counter(r.source for r in rows) == {
        formula_50.EXACT[1]: 6,
        formula_50.EXACT[2]: 5,
        "[Q] (2.32)": 2,
    }
    errata = {f"{r.source}: {r.quantity}" for r in proof.rows if r.status == "erratum"}
    causes = {"[S] task 9.1, inputs: alpha12, m/N", "[Q] (2.32): M(3,1), sign restored"}
    assert {r.follows for r in rows} == causes <= errata
    assert all(r.follows in r.note for r in rows)
    assert not any(r.follows for r in proof.rows if r.status != "consequence")


@pytest.mark.parametrize(("modes", "left"), [(1, 0.356), (2, 0.513)])
def test_what_alpha12_alone_changes(modes, left):
    """The misprint explains the larger part of m1; the three digits of the other inputs do the rest."""
    printed = formula_50.as_printed()
    exact = formula_50.of_rotor(read_rotor(sample_data() / "rotor23.csv"))
    alpha = printed.alpha.copy()
    alpha[0, 1] = alpha[1, 0] = exact.alpha[0, 1]
    mended = dataclasses.replace(printed, alpha=alpha)
    wrong, right = (abs(inputs.masses(modes) - exact.masses(modes))[0] for inputs in (printed, mended))
    assert right == pytest.approx(left * wrong, rel=0.03)


def test_what_is_selected_says_so(proof):
    rows = [r for r in proof.rows if r.kind == "selected"]
    estimates = {"[F] from the intact printed values", "[F] the same, steps 1 to 5"}
    assert {r.source for r in rows} == {"[F] record", *estimates}
    assert len(rows) == 383
    assert "383 numbers of [F], whose print is damaged, were selected by agreement" in proof.summary()
    every = dataclasses.replace(proof, every=True).answer.whole()
    assert every.count("agrees, selected") == 383


@pytest.mark.parametrize(("computed", "status"), [(0.0099, "agrees"), (0.01, "agrees"), (0.0101, "differs")])
def test_a_bound_is_not_exceeded(computed, status):
    bound = dataclasses.replace(row("a source", "a number", "0.01", computed), kind="bound")
    assert bound.status == status
    rounded = dataclasses.replace(bound, computed=0.0136, erratum="it is rounded down", corrected="0.0136")
    assert rounded.status == "erratum"
    assert dataclasses.replace(rounded, computed=0.0099).status == "differs"


def test_bounds_that_are_rounded_down(proof):
    bounds = {(r.source[4:], r.quantity): r for r in proof.rows if r.kind == "bound"}
    assert {where: r.corrected for where, r in bounds.items() if r.status == "erratum"} == {
        ("task 5.1", "largest error, %"): "0.0136",
        ("task 5.2", "largest error, %"): "0.232",
        ("task 7.1", "rounding of the data, %"): "0.546",
        ("task 7.2", "largest error of a mass, %"): "1.09",
        ("task 8.2", "largest error of a stiffness, %"): "12.2",
    }
    assert sum(r.status == "agrees" for r in bounds.values()) == 6


def test_misprinted_equations_are_wrong_and_their_corrections_right(proof):
    rows = {r.quantity: r for r in group(proof, "formulas")}
    for quantity, r in rows.items():
        printed = quantity.endswith(", left as printed")
        assert r.status == ("erratum" if printed else "agrees"), quantity
        assert r.computed > 1e-3 if printed else r.computed < 1e-10, quantity
    assert rows["task 8.1, formula of delta12, left as printed"].computed == pytest.approx(7 / 8, abs=1e-9)
    tasks = ("(23)", *(f"task {t}" for t in ("2.2", "2.3", "3.1", "3.2", "4.1", "4.3", "8.1, formula")))
    assert all(any(task in quantity for quantity in rows) for task in tasks)


def test_what_is_only_rounding_is_no_misprint(proof):
    (found,) = (r for r in proof.rows if r.text == "99790")
    assert (found.status, found.tolerance) == ("agrees", 5.0)


def test_the_rotor_is_all_there(proof):
    rows = {(r.source, r.quantity): r for r in group(proof, "rotor")}
    with (DATA / "rotor23_modes.csv").open(encoding="utf-8", newline="") as file:
        for line in csv.DictReader(file):
            for k, name in enumerate(list(line)[1:], start=1):
                shown = rows["[S] task 9.1, mode shapes", f"mode {k}, node {line['node']}"]
                assert shown.printed == float(line[name])
                assert abs(shown.difference) <= 4e-5
    speeds = [rows["[S] task 9.1, critical speeds", f"critical speed {k}, rad/s"] for k in (1, 2, 3)]
    assert [r.printed for r in speeds] == [135.2394, 540.7326, 1163.804]
    np.testing.assert_allclose([r.computed for r in speeds], [135.24041, 540.73289, 1163.80513], atol=6e-6)


@pytest.mark.parametrize(
    ("source", "quantity", "printed", "corrected"),
    [
        ("[S] task 9.1, inputs", "l, distance of the supports, m", 2.74, 2.76),
        ("[S] task 9.1, inputs", "alpha12, m/N", 11.2e-8, 1.10521909e-7),
        ("[S] task 9.1, inputs", "alpha22 of the running text, m/N", 9.35e-8, 1.64475623e-7),
        ("[S] task 9.1, one mode", "m3, kg", 136.375, 136.575),
        ("[S] task 9.1, one mode", "omega2, rad/s", 593.391, 592.92),
        ("[S] task 9.1, with all digits", "omega2, rad/s", 593.391, 530.68),
        ("[S] task 9.1, with all digits", "omega2 above that of the rotor, %", 10, -1.9),
        ("[S] task 6.1", "Re S at omega = 2, table", -0.31, -0.37),
        ("[S] task 7.1", "c3 of the direct problem, N/m", 5e4, 5e3),
    ],
)
def test_known_errata(proof, source, quantity, printed, corrected):
    (found,) = (r for r in proof.rows if (r.source, r.quantity) == (source, quantity))
    assert found.status == ("consequence" if "all digits" in source else "erratum")
    assert (found.printed, number(found.corrected)) == (printed, corrected)
    assert found.misfit <= 1


def test_the_condition_numbers_of_the_reasons():
    exact = formula_50.of_rotor(read_rotor(sample_data() / "rotor23.csv"))
    for modes, condition in ((1, 63), (2, 18)):
        reason = formula_50.BOOK.lines[formula_50.EXACT[modes], "m1, kg"]["erratum"]
        assert f"condition number {condition})" in reason
        estimate = equivalent_masses(exact.alpha, exact.omega[:modes], exact.shapes[:, :modes])
        assert estimate.condition_number == pytest.approx(condition, abs=0.5)


# a wrong formula is noticed


def scaled(function, factor):
    """The same function with its first result multiplied."""

    def changed(*args, **kwargs):
        first, *others = function(*args, **kwargs)
        return (first * factor, *others)

    return changed


def times(function, factor):
    return lambda *args, **kwargs: function(*args, **kwargs) * factor


def conjugate(function):
    return lambda *args, **kwargs: {k: v.conj() for k, v in function(*args, **kwargs).items()}


def unstretched(function):
    """Imaginary rows with the wrong sign of what multiplies the unknowns."""

    def changed(self):
        K, Y, experiment = function(self)
        return K * np.where(np.arange(len(K)) % 2, -1.0, 1.0)[:, None], Y, experiment

    return changed


@pytest.mark.parametrize(
    ("target", "wrong", "name", "least"),
    [
        ("fem.matrices.elements._BENDING", lambda form: form * 1.0003, "rotor", 3),
        ("fem.matrices.elements._MASS", lambda form: form * 1.001, "rotor", 3),
        ("fem.matrices.elements._MASS", lambda form: form * 1.03, "rotor", 60),
        ("fem.matrices.elements._BENDING", lambda form: form * 1.01, "masses", 10),
        (
            "rotorid.reduction.equivalent.equivalent_masses_formula_50.design",
            lambda f: scaled(f, 1.0001),
            "masses",
            8,
        ),
        (
            "rotorid.validation.formula_50.natural_frequencies",
            lambda f: scaled(f, 1.00001),
            "masses",
            6,
        ),
        ("rotorid.harmonic.regression_rows.Rows.real_rows", unstretched, "lessons", 15),
        ("rotorid.harmonic.operator_model.HarmonicModel.predict", conjugate, "lessons", 8),
        ("rotorid.harmonic.operator_model.HarmonicModel.predict", conjugate, "formulas", 12),
        ("rotorid.validation.identification.natural_modes", lambda f: scaled(f, 1.0001), "lessons", 4),
        (
            "rotorid.timedomain.methods.quasilinearization._heun",
            lambda f: times(f, 1.01),
            "time_records",
            100,
        ),
        (
            "rotorid.timedomain.integration.matrix_exponential.expm_and_derivatives",
            lambda f: scaled(f, 1.0001),
            "time_records",
            50,
        ),
        ("balancing.coefficients.influence.gain", lambda f: times(f, np.exp(0.05j)), "balancing", 4),
        (
            "balancing.solvers.least_squares_minmax._closed_form",
            lambda f: times(f, np.exp(0.05j)),
            "balancing",
            8,
        ),
    ],
)
def test_a_wrong_formula_makes_numbers_differ(monkeypatch, target, wrong, name, least):
    owner, attribute = _place(target)
    monkeypatch.setattr(owner, attribute, wrong(getattr(owner, attribute)))
    found = validate([name])
    assert found.counts["differs"] >= least
    assert not found.holds
    assert "Differ:" in found.summary()


def _place(target):
    """Module or class, and the name in it; a module even where a function of its package hides it."""
    owner, _, attribute = target.rpartition(".")
    if owner.rpartition(".")[2][0].isupper():
        module, _, name = owner.rpartition(".")
        return getattr(import_module(module), name), attribute
    return import_module(owner), attribute


SIGNS = {
    "seal in (50)": (
        "rotorid.reduction.equivalent.equivalent_masses_formula_50.design",
        "U + alpha @ (springs",
        "U - alpha @ (springs",
    ),
    "supports, whirl": ("fem.matrices.lateral_planes.Quadratic.at", "+ (c.reshape", "- (c.reshape"),
    "supports, response": (
        "fem.matrices.support_dynamic_stiffness.on_whirl",
        "support.stiffness + 1j * speeds",
        "support.stiffness - 1j * speeds",
    ),
    "material": ("fem.matrices.lateral_planes.project", "planes(along, B,", "planes(along, -B,"),
    "material, turning": ("fem.matrices.lateral_planes.project", "planes(across, B,", "planes(across, -B,"),
    "stacked readings": (
        "balancing.correction.correct.correct",
        "Y.ravel(),",
        "Y.ravel() * np.repeat((-1) ** np.arange(len(Y)), Y.shape[1]),",
    ),
    "stacked coefficients": (
        "balancing.correction.correct.correct",
        "part.W.reshape(-1, len(chosen))",
        "(part.W * (-1) ** np.arange(len(used))[:, None, None]).reshape(-1, len(chosen))",
    ),
}  # fmt: skip
"""Signs that no printed number tells: the function, its line, and the line with the wrong sign."""


@pytest.mark.parametrize("what", SIGNS)
def test_a_wrong_sign_of_seal_damping_or_stacking_makes_numbers_differ(monkeypatch, what):
    """The line is changed in the function itself, wherever that has been imported."""
    target, right, wrong = SIGNS[what]
    owner, attribute = _place(target)
    function = inspect.unwrap(getattr(owner, attribute))
    source = textwrap.dedent(inspect.getsource(function))
    assert source.count(right) == 1
    changed = dict(function.__globals__)
    exec(
        compile("from __future__ import annotations\n" + source.replace(right, wrong), what, "exec"), changed
    )
    monkeypatch.setattr(function, "__code__", changed[attribute].__code__)
    found = validate(["closed_forms"])
    assert found.counts["differs"] >= 1
    assert not found.holds
    others = validate(["rotor", "masses", "lessons", "formulas", "balancing"])
    assert others.holds  # so nothing else tells it


def test_a_formula_that_is_right_again_agrees_again():
    """Nothing of a tampered run is kept."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fem.matrices.elements, "_BENDING", fem.matrices.elements._BENDING * 1.01)
        assert validate(["rotor"]).counts["differs"] >= 70
    assert validate(["rotor"]).holds


def test_the_summary_has_a_line_for_each_source_and_every_reason(proof):
    text = proof.answer.whole()
    lines = text.splitlines()
    n = proof.counts
    assert lines[:2] == [
        "Every printed number is met, or is known as a misprint, or as what follows from one.",
        f"{len(proof.rows) - n['given']} numbers can fail: {n['agrees']} agree, {n['erratum']} misprints, "
        f"{n['consequence']} consequences, 0 differ; {n['given']} given, not counted.",
    ]
    assert proof.summary().splitlines()[:2] == lines[:2]
    for r in proof.rows:
        assert any(line.startswith(f"  {r.source} ") for line in lines)
    flat = " ".join(text.split()).lower()
    for r in proof.rows:
        assert " ".join(r.erratum.lower().split()) in flat
        assert " ".join(r.reason.lower().split()) in flat
    assert max(map(len, lines)) <= 110
    assert "Differ:" not in text
    shown = dataclasses.replace(proof, every=True).answer.whole()
    assert all(r.quantity in shown for r in proof.rows)
    assert len(shown.splitlines()) == len(lines) + len(proof.rows)


def test_numbers_that_differ_are_all_named():
    rows = tuple(row("a source", f"number {i}", "1.0", 2.0 + i) for i in range(20))
    text = Validation(groups=(Group("one", "One group", rows),), provenance={}).answer.whole()
    assert all(
        f"number {i}: printed 1.0, computed {2.0 + i:.5g}" in " ".join(text.split()) for i in range(20)
    )
    assert text.startswith(
        "NOT every printed number is met.\n"
        "20 numbers can fail: 0 agree, 0 misprints, 0 consequences, 20 differ; 0 given, not counted.\n\n"
        "Differ:\n"
    )


def test_documents_and_frames_hold_every_row(proof):
    document = proof.to_dict()
    json.dumps(document, allow_nan=False)
    assert len(document["rows"]) == document["counts"]["numbers"] == len(proof.rows)
    assert [g["group"] for g in document["groups"]] == list(PROVIDERS)
    keys = {"source", "quantity", "printed", "computed", "difference", "tolerance", "status", "note"}
    for shown, r in zip(document["rows"], proof.rows, strict=True):
        assert keys <= set(shown)
        assert shown["difference"] == shown["computed"] - shown["printed"]
        assert shown["printed"] == number(shown["printed_text"]) == r.printed
    frame = proof.to_frame()
    assert list(frame.columns) == list(document["rows"][0])
    assert len(frame) == len(proof.rows)


def test_an_unknown_group_is_refused():
    with pytest.raises(ValueError, match="no group 'rotors'"):
        validate(["rotors"])


def test_tables_of_printed_numbers_say_where_they_are_printed():
    assert tables()
    for path in tables():
        first = path.read_text(encoding="utf-8").splitlines()[0]
        assert first.startswith("# ")
        assert len(first.split()) >= 5
        assert len(printed_table(path.name)) >= 1


def test_a_group_that_fails_is_said_and_the_others_are_shown(cli, monkeypatch):
    import rotorid.validation
    from rotorid.validation import balancing, closed_forms, formulas, identification, rotor, time_records

    def broken():
        raise KeyError("a table is gone")

    for module in (balancing, closed_forms, formulas, identification, time_records):
        monkeypatch.setattr(module, "rows", list)
    monkeypatch.setattr(formula_50, "rows", broken)
    found = rotorid.validation.validate(["masses", "rotor"])
    assert not found.holds
    assert [group.failure for group in found.groups] == ["KeyError: 'a table is gone'", ""]
    assert found.groups[1].rows == tuple(rotor.rows())
    assert "FAILED, none of its numbers was computed: KeyError: 'a table is gone'" in found.answer.found
    assert found.last_line.endswith("given, not counted; not computed: 'masses'")
    outcome = cli("validate", "--json")
    assert outcome.code == 1
    groups = {group["group"]: group for group in outcome.json["groups"]}
    assert groups["masses"]["failure"] == "KeyError: 'a table is gone'"
    assert "failure" not in groups["rotor"]
    assert (groups["rotor"]["agrees"], groups["rotor"]["given"]) == (72, 3)

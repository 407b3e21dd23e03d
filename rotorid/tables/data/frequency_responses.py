"""Frequency responses of UFF files (dataset 58, function type 4) as displacements by a force of 1 N.

A response is that of displacement, velocity or acceleration by force, H e^{iωt}; velocities and accelerations
are divided by iω and (iω)². Units are those of the file's labels, SI where it has none.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import listing
from rotorid.base.unit_words import Shown, speed_axis, vibration_unit_words
from rotorid.files import units
from rotorid.files.headings import read_unit, readable
from rotorid.tables.waveforms.instrument_files import names_of_sets
from rotorid.tables.waveforms.sampled_file import library, refusal

if TYPE_CHECKING:
    from rotorid.identify.amplitudes import Experiments

RESPONSE = 4
_ORDER = {8: 0, 11: 1, 12: 2}
"""How often a quantity of these data types is differentiated."""


def read_responses(path: Path) -> Experiments:
    """Displacements at the points of the responses of a UFF file under a force F of 1 N.

    Raises
    ------
    InputError
        Without responses to one force at frequencies that all of them have, in known units; without pyuff.
    """
    from rotorid.identify.amplitudes import Experiments

    with library(path, "UFF58"):
        import pyuff

        file = pyuff.UFF(str(path))
        places = np.flatnonzero(np.asarray(file.get_set_types()) == 58)
        sets: list[dict[str, Any]] = [file.read_sets(int(place)) for place in places]
    sets = [one for one in sets if one["func_type"] == RESPONSE]
    if not sets:
        raise refusal(path, f"frequency responses (function type {RESPONSE}) in a dataset 58")
    forces = {(one["ref_node"], one["ref_dir"]) for one in sets}
    if len(forces) > 1:
        shown = listing((f"{node} ({way:+d})" for node, way in sorted(forces)), "and")
        raise refusal(path, f"responses to one force; there are forces at nodes {shown}")
    omega = 2.0 * np.pi * np.asarray(sets[0]["x"], dtype=float)
    used = omega > 0
    signals: dict[str, ComplexArray] = {}
    for name, one in zip(names_of_sets(sets), sets, strict=True):
        if len(one["x"]) != len(omega) or not np.allclose(2.0 * np.pi * one["x"], omega, rtol=1e-6):
            raise refusal(path, "responses at the same frequencies")
        signals[name] = _displacement(path, one, omega[used], np.asarray(one["data"], dtype=complex)[used])
    if not used.any():
        raise refusal(path, "frequencies above 0")
    omega = omega[used]
    rows = tuple(str(row + 1) for row in range(len(omega)))
    shown_as = dict.fromkeys(signals, Shown(vibration_unit_words("um"), 1e6))
    free = np.zeros(len(omega), bool)
    signals["F"] = np.ones(len(omega), dtype=complex)
    return Experiments(rows, omega, signals, free, axis=speed_axis("frequency", "Hz"), units=shown_as)


def _displacement(path: Path, one: dict[str, Any], omega: FloatArray, values: ComplexArray) -> ComplexArray:
    """Of a response, m/N."""
    label, force = (
        str(one[f"{part}_axis_units_lab"] or "").strip().replace("^", "") for part in ("ordinate", "orddenom")
    )
    label, force = ("" if text.upper() == "NONE" else text for text in (label, force))
    kind = one["ordinate_spec_data_type"]
    if not label and kind in _ORDER:
        factor, order = 1.0, _ORDER[kind]
    elif label and readable("amplitude", label) and force in ("", *units.FORCE):
        unit = units.VIBRATION[read_unit("amplitude", label)[0]]
        factor = unit.to_si(1.0) / (units.FORCE[force].to_si(1.0) if force else 1.0)
        order = ["length", "velocity", "acceleration"].index(unit.kind)
    else:
        expected = "responses of a displacement, velocity or acceleration by a force, such as m/s^2 by N"
        raise refusal(path, expected, value=f"{label or kind} by {force or 'no unit'}")
    if not np.isfinite(values).all():
        raise refusal(path, "finite numbers")
    return values * factor / (1j * omega) ** order

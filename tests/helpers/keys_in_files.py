"""Tables of keys in docs/files.md: `python tests/helpers/keys_in_files.py` writes them."""

import re
from pathlib import Path

from rotorid.tables import study_file
from rotorid.tables.job import job_keys
from rotorid.tables.models import harmonic_file, matrix_form, ode_file, shared_keys, small_model_file
from rotorid.tables.rotor import bearing, calibration_keys, node_forces, rotor_file
from rotorid.tables.waveforms import waveform_keys

PAGE = Path(__file__).resolve().parents[2] / "docs" / "files.md"
TABLES = {
    "key": job_keys.JOB,
    "key of [errors]": job_keys.ERRORS,
    "key of [key_phasor]": job_keys.KEY_PHASOR,
    "key of [slow_roll.SENSOR]": job_keys.VECTOR,
    "key of [columns]": job_keys.COLUMNS,
    "key of [sheet]": job_keys.SHEET,
    "key of [planes.NAME]": job_keys.PLANE,
    "key of [sensors.NAME]": job_keys.SENSOR,
    "key of a model file for harmonic tests": harmonic_file.HARMONIC,
    "key of a model file with states": ode_file.TIME_STATES,
    "further key with matrices": (*matrix_form.MATRICES, *ode_file.FORCE),
    "key of [nuisance]": ode_file.NUISANCE,
    "key of [errors] of a model file": shared_keys.ERRORS,
    "key of a rotor file": rotor_file.ROTOR,
    "key of [material]": rotor_file.MATERIAL,
    "key of [model]": rotor_file.MODEL,
    "key of [[station]]": rotor_file.STATION,
    "key of [[disc]]": rotor_file.DISC,
    "key of [[bearing]]": bearing.KEYS_OF["bearing"],
    "key of [calibration]": calibration_keys.CALIBRATION,
    "key of [[calibration.parameter]]": calibration_keys.PARAMETER,
    "key of [[calibration.data]]": calibration_keys.DATA,
    "key of a small model": small_model_file.SMALL_MODEL,
    "key of [[unbalance]]": small_model_file.UNBALANCE,
    "key of [[bow]]": small_model_file.BOW,
    "key of a waveforms file": waveform_keys.WAVEFORMS,
    "key of [channels.NAME]": waveform_keys.CHANNEL,
    "key of a study file": study_file.STUDY,
    "key of [planes.NAME] of a study": study_file.PLANE,
    "key of [sensors.NAME] of a study": study_file.SENSOR,
    "key of [unbalance.STATION]": study_file.UNBALANCE,
    "key of [readings]": study_file.READINGS,
    "key of [calibrate]": study_file.CALIBRATE,
    **{f"key of [[{kind}]]": keys for kind, keys in node_forces.KEYS_OF_FORCE.items()},
}


def key_lines(keys, what="key"):
    """Keys as a table in Markdown: names, what is said about them, and how their values are written."""
    lines = [f"| {what} | meaning | such as |", "|---|---|---|"]
    for key in keys:
        names = ", ".join(f"`{key.kind.header.format(name)}`" for name in key.names)
        words = [f'"{word}"' for word in key.kind.schema.get("enum", ())] or [key.kind.example]
        lines.append(f"| {names} | {key.about} | {', '.join(f'`{word}`' for word in words if word)} |")
    return lines


def with_tables(text):
    """The page with the tables between their marks written anew."""
    for title, own in TABLES.items():
        mark = f"<!-- keys: {title} -->\n"
        before, own_mark, after = text.partition(mark)
        assert own_mark, title
        lines = "\n".join(key_lines(own, re.sub(r"(\[.*\])", r"`\1`", title)))
        text = f"{before}{mark}{lines}\n{after[after.index('<!-- end -->') :]}"
    return text


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")

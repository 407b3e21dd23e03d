"""Tables of keys in docs/files.md: `python tests/helpers/keys_in_files.py` writes them."""

import re
import typing
from pathlib import Path

from rotorid.files import bearing, forces, job_models, model, rotor, small_model, waveforms
from rotorid.files.settings import Settings
from rotorid.study import study_file

PAGE = Path(__file__).resolve().parents[2] / "docs" / "files.md"
TABLES = {
    "key": job_models.JobSettings,
    "key of [errors]": job_models.Errors,
    "key of [key_phasor]": job_models.KeyPhasor,
    "key of [slow_roll.SENSOR]": job_models.Vector,
    "key of [columns]": job_models.Columns,
    "key of [planes.NAME]": job_models.Plane,
    "key of [sensors.NAME]": job_models.Sensor,
    "key of [sheet]": job_models.Sheet,
    "key of a model file": model.ModelFile,
    "key of [nuisance]": model.Nuisance,
    "key of [errors] of a model file": model.AmplitudeErrorKeys,
    "key of a rotor file": rotor.RotorFile,
    "key of [material]": rotor.Material,
    "key of [model]": rotor.Effects,
    "key of [[station]]": rotor.Station,
    "key of [[disc]]": rotor.DiscKeys,
    "key of [[bearing]]": bearing.SupportKeys,
    "key of [calibration]": rotor.CalibrationKeys,
    "key of [[calibration.parameter]]": rotor.Parameter,
    "key of [[calibration.data]]": rotor.DataFile,
    "key of a small model": small_model.SmallModelFile,
    "key of [[unbalance]]": small_model.UnbalanceKeys,
    "key of [[bow]]": small_model.BowKeys,
    "key of a waveforms file": waveforms.WaveformsFile,
    "key of [channels.NAME]": waveforms.ChannelKeys,
    "key of a study file": study_file.StudyKeys,
    "key of [planes.NAME] of a study": study_file.PlaneKeys,
    "key of [sensors.NAME] of a study": study_file.SensorKeys,
    "key of [unbalance.STATION]": study_file.UnbalanceKeys,
    "key of [readings]": study_file.ReadingKeys,
    **{f"key of [[{kind}]]": keys for kind, keys in forces.KEYS.items()},
}


def key_lines(keys, what="key"):
    """Keys as a table in Markdown: names, what is said about them, and how their values are written."""
    lines = [f"| {what} | meaning | such as |", "|---|---|---|"]
    return lines + [_line(keys, name, field) for name, field in keys.model_fields.items()]


def _line(settings, name, field):
    """A field of typed settings."""
    inner = [one for one in (field.annotation, *typing.get_args(field.annotation)) if isinstance(one, type)]
    table = any(issubclass(one, Settings) for one in inner)
    choices = settings.model_json_schema()["properties"].get(field.alias or name, {})
    several = typing.get_origin(field.annotation) is list
    key = settings.known_keys()[field.alias or name]
    header = "[[{}]]" if table and several else "[{}]" if table or dict in inner else "{}"
    if typing.get_origin(field.annotation) is dict:
        may_be_text = any(hasattr(mark, "func") for mark in field.metadata)
        header = "[{}.NAME]" if table else "{}" if may_be_text else "[{}]"
    names = ", ".join(f"`{header.format(one)}`" for one in key.names)
    enums = [one.get("enum", ()) for one in (choices, *choices.get("anyOf", ()))]
    words = [f'"{word}"' for words in enums for word in words] or field.examples or []
    return f"| {names} | {key.about} | {', '.join(f'`{word}`' for word in words)} |"


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

"""JSON schemas of settings files, for editors: their keys in all units, and what may stand there."""

from __future__ import annotations

from typing import Any

from rotorid.base.choices import one_of
from rotorid.files.job_models import JobSettings
from rotorid.files.rotor import RotorFile
from rotorid.files.settings import Settings, settings_schema
from rotorid.files.small_model import SmallModelFile
from rotorid.files.waveforms import WaveformsFile

FILES: dict[str, tuple[str, type[Settings]]] = {
    "job": ("Job file of rotorid", JobSettings),
    "rotor": ("Rotor file of rotorid", RotorFile),
    "small": ("Small model for motion of rotorid", SmallModelFile),
    "waveforms": ("Waveforms file of rotorid", WaveformsFile),
}
"""What the file is, and its keys, by the names that `rotorid schema` takes."""


def schema(kind: str) -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of a kind of file.

    Parameters
    ----------
    kind
        One of `FILES`.

    Raises
    ------
    ValueError
        For another kind.
    """
    title, keys = FILES[one_of(kind, "schema", list(FILES))]
    return settings_schema(keys, title)

"""Identification from harmonic tests, natural frequencies and shapes: operator models, two methods."""

from __future__ import annotations

from rotorid.harmonic.experiments import AmplitudeErrors, Experiments
from rotorid.harmonic.identification import identify
from rotorid.harmonic.operator_equations import harmonic_model
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.result import Identification
from rotorid.regression.undetermined_combinations import FoundCombination

__all__ = [
    "AmplitudeErrors",
    "Experiments",
    "FoundCombination",
    "HarmonicModel",
    "Identification",
    "harmonic_model",
    "identify",
]

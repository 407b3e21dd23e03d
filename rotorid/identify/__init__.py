"""Identification: from harmonic tests, natural frequencies and shapes, with intervals, or what data tell."""

from __future__ import annotations

from rotorid.identify.amplitudes import AmplitudeErrors, Experiments, experiments
from rotorid.identify.equations import harmonic_model
from rotorid.identify.fit_amplitudes import identify
from rotorid.identify.operator_model import HarmonicModel
from rotorid.identify.result import Identification

__all__ = [
    "AmplitudeErrors",
    "Experiments",
    "HarmonicModel",
    "Identification",
    "experiments",
    "harmonic_model",
    "identify",
]

"""Names of the old modules until this one is written."""

from fem.matrices.elements import Layout, bending_terms, gyroscopic_terms, mass_terms
from fem.matrices.strain import strains

__all__ = ["Layout", "bending_terms", "gyroscopic_terms", "mass_terms", "strains"]

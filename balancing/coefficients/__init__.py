"""Influence coefficients: from trial runs, from a rotor model, combined, and what they can tell."""

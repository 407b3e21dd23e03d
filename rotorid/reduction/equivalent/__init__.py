"""Equivalent masses by formula (50): regression, matched frequencies, derivatives, errors."""

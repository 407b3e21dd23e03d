"""Rotor tables and files, their bearings, and unbalance tables."""

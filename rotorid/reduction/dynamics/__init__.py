"""The small model in motion: its matrices, response and stability beside the full rotor's."""

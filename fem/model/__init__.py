"""A rotor as plain data: shaft, discs, supports, and where vibration is read."""

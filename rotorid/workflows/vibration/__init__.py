"""From measured vibration: modes and critical speeds."""

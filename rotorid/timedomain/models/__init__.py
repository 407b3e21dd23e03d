"""Models in time and the records that they are fitted to."""

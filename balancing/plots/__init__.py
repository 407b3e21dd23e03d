"""Pictures of corrections, discs, tolerances and trade-offs. Nothing is shown or saved: the caller does."""

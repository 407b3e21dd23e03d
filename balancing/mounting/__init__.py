"""Weights as they can be mounted: pieces in holes, free amounts, material taken away."""

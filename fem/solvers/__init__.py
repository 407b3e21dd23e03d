"""Eigenvalues, receptances and whirl: fast ways in reduced bases, and exact ones to check them."""

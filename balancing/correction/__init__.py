"""Corrections: the result, its check, its verdict, and what else could be done."""

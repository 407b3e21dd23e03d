"""Printed numbers of three books and of published balancing, beside what is computed now: once, here."""

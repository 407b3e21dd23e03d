"""Printed numbers of the three books and of published balancing, beside what is computed now; once, and here."""

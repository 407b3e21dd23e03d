"""Finders of wrong answers: mutated files, relations between answers, hostile names.

`make fuzz` mutates samples for minutes (`python -m fuzz --help`); the tests here are a short run of the same.
"""

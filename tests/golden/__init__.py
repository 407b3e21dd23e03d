"""The net: stored outputs of every command on every sample job, model and rotor.

`python -m golden store` writes them, `python -m golden exact` compares with another commit byte for byte; the
tests `test_golden_*.py` compare what the command line says now with what is stored. Nothing here knows more of
the product than `rotorid.cli.main`.
"""

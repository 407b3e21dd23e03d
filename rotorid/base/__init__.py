"""What every room uses: array types, numbers in words and JSON, suggestions, checks, speeds, plot style.

It stands on numpy and the standard library only (matplotlib inside functions), below `fem` and `balancing`.
"""

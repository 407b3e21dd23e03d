"""One module a command, and what only one of them needs."""

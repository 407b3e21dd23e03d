"""`python -m book` writes every printed number beside what is computed now."""

from book.page import write

write()

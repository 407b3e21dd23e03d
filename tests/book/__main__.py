"""`python -m book` writes `docs/book_numbers.md`."""

from book.page import write

write()

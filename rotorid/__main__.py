"""`python -m rotorid`."""

from rotorid.cli import main

if __name__ == "__main__":
    main()

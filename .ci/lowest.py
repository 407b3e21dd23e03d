"""Print constraints for `make test-lowest`: what pyproject.toml promises, in the lowest version promised.

That is what rotorid needs, what builds it, and the groups test and docs, which the tests use. All else (what
these need in turn) is no newer than in constraints.txt.
"""

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def normal(name: str) -> str:
    """The name as package indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def lowest() -> dict[str, str]:
    """Lowest promised version by name."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    groups = project["dependency-groups"]
    wanted = [*project["build-system"]["requires"], *project["project"]["dependencies"]]
    found = {}
    for requirement in [*wanted, *groups["test"], *groups["docs"]]:
        match = re.fullmatch(r"([\w.-]+)>=([\w.]+)", requirement)
        if match is None:
            sys.exit(f"pyproject.toml: {requirement!r} does not have the form NAME>=VERSION")
        found[normal(match[1])] = match[2]
    return found


def main() -> None:
    """Print the file."""
    promised = lowest()
    for name, version in promised.items():
        print(f"{name}=={version}")
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        if not line.startswith("#") and normal(line.split("==")[0]) not in promised:
            print(line.replace("==", "<=", 1))


if __name__ == "__main__":
    main()

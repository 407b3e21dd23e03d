"""Commands over fleets give what is stored: see `tests/golden`."""

import pytest

from golden.checks import checks

pytest.importorskip("pyarrow", reason="without the extra rotorid[fleet]")
test_as_stored = checks("fleet")

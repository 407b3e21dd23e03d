"""influence: numbers, and the table that balance reads."""

import numpy as np
import pandas as pd

import fem
from rotorid.files import read_influence


def test_influence_with_angles_feeds_balance(cli, files, model, tmp_path):
    table = tmp_path / "w.csv"
    document = cli(
        "influence", files[0], "--planes", "wheel,3", "--sensors", "probe:45,6", "--speeds", "100,120",
        "--output", table, "--plot", tmp_path / "w.png", "--json",
    ).json  # fmt: skip
    W = fem.influence(model, ["wheel", 3], [("probe", 45.0), 6], [100.0, 120.0]).W
    sizes = np.array([row["influence"] for row in document["rows"]]).reshape(2, 2, 2)
    np.testing.assert_allclose(sizes, np.abs(W), rtol=1e-9)
    stored = read_influence(table)
    assert stored.sensors == ("probe at 45°", "6")
    assert stored.planes == ("wheel", "3")
    assert (tmp_path / "w.png").read_bytes().startswith(b"\x89PNG")
    frame = pd.read_csv(table)
    assert len(frame) == 8
    np.testing.assert_allclose(stored.W, W, rtol=1e-6)
    # a job of phases that lag does not turn what the table says
    np.testing.assert_allclose(read_influence(table, phase="lag").W, W, rtol=1e-6)
    assert "phase_lead_deg" in frame

"""Write amplitudes.csv: `python make_data.py` (needs NumPy only, not rotorid).

The chain of [S] task 7.1 with damping proportional to its stiffnesses (0.24, 0.52 and 0.98 % of critical),
shaken at its last mass with 10 N at nine frequencies around each resonance; 2 % and 1° of noise.
"""

from pathlib import Path

import numpy as np

c1, c2, c3 = 1e4, 2e4, 5e3
M = np.diag([20.0, 20.0, 10.0])
K = np.array([[c1 + c2, -c2, 0], [-c2, c2 + c3, -c3], [0, -c3, c3]])
C = 4e-4 * K
FORCE = np.array([0.0, 0.0, 10.0])

rng = np.random.default_rng(71)
lines = ["frequency_rad_s,F_re," + ",".join(f"X{i}_amplitude_um,X{i}_phase_deg" for i in (1, 2, 3))]
for omega in np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)):
    damping = 4e-4 * omega / 2
    for w in np.round(omega * (1 + damping * np.linspace(-3, 3, 9)), 3):
        X = np.linalg.solve(K - w**2 * M + 1j * w * C, FORCE)
        size = 1e6 * np.abs(X) * (1 + 0.02 * rng.standard_normal(3))
        phase = np.degrees(np.angle(X)) + rng.standard_normal(3)
        cells = [f"{a:.5g},{(p + 180) % 360 - 180:.1f}" for a, p in zip(size, phase, strict=True)]
        lines.append(",".join([f"{w:.3f}", "10", *cells]))
Path(__file__).with_name("amplitudes.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")

"""What a state space answers, from its four matrices."""

import numpy as np


def frequency_response(model, omega):
    """C (iω − A)⁻¹ B + D at frequencies in rad/s, shape (S, outputs, inputs)."""
    A, B, C, D = model
    iw = 1j * np.atleast_1d(omega)[:, None, None] * np.eye(len(A))
    return C @ np.linalg.solve(iw - A, np.broadcast_to(B, (len(iw), *B.shape))) + D

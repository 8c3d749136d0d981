"""Small records with a known error."""

import numpy as np

from aesi.records import ErrorSeries
from aesi.sparse.terms.inputs import low_pass


def make_record(
    n: int = 900, seed: int = 0, feedback: float = 0.0, noise_v: float = 5e-4, name: str = "record"
) -> ErrorSeries:
    """e[k + 1] = feedback e[k] + 1e-3 I[k] + 2e-3 (soc - 0.5) I[k] / 3 + noise, at 1 Hz."""
    rng = np.random.default_rng(seed)
    current = low_pass(rng.normal(0.0, 12.0, n), 1.0, 3.0)
    soc = np.linspace(0.9, 0.1, n)
    drive = 1e-3 * current + 2e-3 * (soc - 0.5) * current / 3
    error = np.zeros(n)
    for k in range(n - 1):
        error[k + 1] = feedback * error[k] + drive[k] + noise_v * rng.normal()
    inputs = np.column_stack([current, soc, low_pass(current, 1.0, 20.0)])
    return ErrorSeries(
        name, 1.0, np.arange(n, dtype=float), error, inputs, soc, np.full(n, 3.7), ("I", "soc", "c_e0")
    )

"""A simulated cell: PyBaMM's reduced and full porous-electrode models with changes, under profiles, cached."""

import os

# PyBaMM asks about its telemetry, and writes a file of settings, when it is imported, which the modules here do.
os.environ.setdefault("PYBAMM_DISABLE_TELEMETRY", "true")

"""A simulated cell: PyBaMM's reduced and full porous-electrode models with changes, under profiles, cached."""

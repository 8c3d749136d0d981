"""A cell on a computer: PyBaMM's reduced and full porous-electrode models, changed, driven and cached."""

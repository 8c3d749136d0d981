"""The physics: speed and accuracy against PyBaMM, and free runs on every measured cell."""

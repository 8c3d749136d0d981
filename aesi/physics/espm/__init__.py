"""The extended single-particle model: constants, tables and kernels of one run."""

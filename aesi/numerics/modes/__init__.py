"""Spectral discretisations: Galerkin modes of particles and layers, collocation within electrodes."""

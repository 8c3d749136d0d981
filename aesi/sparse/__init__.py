"""Ensemble sparse learning of the voltage error: library, STRidge, ensembles, free run, search problem."""

from aesi.sparse.model import SparseModel
from aesi.sparse.search.evaluate import (
    ENSEMBLES,
    Candidate,
    FitnessWeights,
    OutOfFoldResiduals,
    evaluate,
    fitness,
)
from aesi.sparse.search.genome import Genome
from aesi.sparse.search.problem import Options, Problem
from aesi.sparse.stridge import STRidge
from aesi.sparse.terms.inputs import with_inputs
from aesi.sparse.terms.library import Library, Term

__all__ = [
    "ENSEMBLES",
    "Candidate",
    "FitnessWeights",
    "Genome",
    "Library",
    "Options",
    "OutOfFoldResiduals",
    "Problem",
    "STRidge",
    "SparseModel",
    "Term",
    "evaluate",
    "fitness",
    "with_inputs",
]

"""Ensemble sparse learning of the voltage error: library, STRidge, ensembles, free run, search problem."""

from aesi.sparse.evaluate import Candidate, FitnessWeights, HonestResiduals, evaluate, fitness
from aesi.sparse.genome import Genome
from aesi.sparse.inputs import with_inputs
from aesi.sparse.library import Library, Term
from aesi.sparse.model import SparseModel
from aesi.sparse.problem import Options, Problem
from aesi.sparse.stridge import STRidge

__all__ = [
    "Candidate",
    "FitnessWeights",
    "Genome",
    "HonestResiduals",
    "Library",
    "Options",
    "Problem",
    "STRidge",
    "SparseModel",
    "Term",
    "evaluate",
    "fitness",
    "with_inputs",
]

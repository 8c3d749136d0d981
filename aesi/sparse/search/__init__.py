"""Candidates of the search: their genome, the shared problem, their fit and their judgement."""

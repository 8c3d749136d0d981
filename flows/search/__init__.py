"""The evolutionary search over candidates: NSGA-II by Optuna, its result, and the study of an experiment."""

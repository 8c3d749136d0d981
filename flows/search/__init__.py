"""The evolutionary search over candidates: NSGA-II by Optuna, what it came to, one study of an experiment."""

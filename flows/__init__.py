"""Prefect flows, MLflow tracking, Optuna search and the command line over the aesi package."""

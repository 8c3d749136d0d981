"""The jobs that a user starts: experiment, discovery, calibration, worker; as Prefect flows or plain functions."""

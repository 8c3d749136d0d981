"""The jobs that a user starts: experiment, discovery, batch, calibration, worker; Prefect flows or plain functions."""

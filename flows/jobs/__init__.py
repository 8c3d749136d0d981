"""What a person starts: an experiment, a discovery, a calibration, a worker; as Prefect flows or plain functions."""

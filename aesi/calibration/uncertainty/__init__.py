"""What the records of a calibration leave open: of parameters, of the state of health, of the resistance."""

"""What every other folder stands on: environment, console, content keys, stored stages."""

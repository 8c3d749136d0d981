"""What every other folder stands on: environment, console, files that are whole, content keys, stored stages."""

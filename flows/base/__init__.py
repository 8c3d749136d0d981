"""The basis of all other folders: environment, console, content keys, stored stages."""

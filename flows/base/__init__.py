"""The basis of all other folders: environment, console, locks, databases, interrupts, content keys, stored stages."""

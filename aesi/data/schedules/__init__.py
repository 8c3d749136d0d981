"""The eight bundled drive schedules; see README.md for their sources."""

"""Currents to apply: drive schedules, a vehicle that makes currents of speeds, and profiles of both."""

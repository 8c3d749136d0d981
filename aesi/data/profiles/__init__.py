"""Currents to apply: drive schedules, a vehicle model that converts speeds to currents, and profiles of both."""

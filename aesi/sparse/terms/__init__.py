"""The library of candidate terms: functions of scaled inputs, and their products."""

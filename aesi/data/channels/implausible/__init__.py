"""Checks of units and signs that need current, voltage and time together.

The limits hold for one lithium cell. Shares and voltages were set on 342 measured and virtual records, or parts of
them, with and without the sign of their current: those that the constants call "those records".
"""

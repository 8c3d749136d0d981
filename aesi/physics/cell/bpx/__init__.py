"""Cell files in the Battery Parameter eXchange (BPX) format: read, checked, written.

Standard: https://bpxstandard.com. What it has no field for is in the file's section `User-defined`.
"""

"""Bitrode (VisualLCN): CSV, its units in the names, with 'Exclude' and the three counters of loops; current positive on
charge, its direction also in words (CHRG, DCHG, REST).

Held against the published tests of a Nissan Leaf's cell (Wiggins, Allu & Wang 2019, doi:10.5281/zenodo.2580327). Some
of these lost the line of names: their columns are called by their numbers.
"""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="Bitrode",
    marks=(r"exclude", r"loop.*", r"step ?time.*", r"current.*", r"voltage.*", r"mode"),
    columns={
        "time_s": (Name(r"(total )?time ?\((?P<unit>s|h|h:m:s)\)"),),
        "current_a": (Name(r"current ?\((?P<unit>m?a)\)"),),
        "voltage_v": (Name(r"voltage ?\((?P<unit>m?v)\)"),),
        "temperature_degc": (Name(r"temperature( a?1)? ?\((?P<unit>.{0,3}c)\)", "degC"),),
        "state": (Name(r"mode"),),
        "cycle": (Name(r"cycle"),),
        "step": (Name(r"step"),),
    },
)

"""BioLogic (EC-Lab, BT-Lab): `.mpt` text below 'Nb header lines', or `.mpr` through galvani.

The current is positive on charge (oxidation at the working electrode), in mA or A by its name.
"""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="BioLogic",
    marks=(r"time/s", r"<?(ewe|ecell)>?(-ece)?/v", r"<?i>?/m?a"),
    columns={
        "time_s": (Name(r"time/(?P<unit>s)"),),
        "current_a": (Name(r"i/(?P<unit>m?a)"), Name(r"<i>/(?P<unit>m?a)")),
        "voltage_v": (
            Name(r"<?ecell>?/(?P<unit>m?v)"),
            Name(r"<?ewe-ece>?/(?P<unit>m?v)"),
            Name(r"<?ewe>?/(?P<unit>m?v)", reference=r"<?ece>?/m?v"),
        ),
        "temperature_degc": (Name(r"temperature/.{0,3}c", "degC"),),
        "cycle": (Name(r"cycle number|z cycle"),),
        "step": (Name(r"ns"),),
    },
)

"""Arbin (MITS Pro): CSV, or a sheet 'Channel...' of an Excel workbook; current positive on charge.

So are the time series of batteryarchive.org, which keep its names and leave out the points and steps.
"""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="Arbin",
    marks=(
        r"test time( ?\(s\))?",
        r"cycle index",
        r"current( ?\(m?a\))?",
        r"voltage( ?\(m?v\))?",
        r"charge capacity( ?\(m?ah\))?|step index",
    ),
    columns={
        "time_s": (Name(r"test time ?\((?P<unit>s)\)"), Name(r"test time", "s")),
        "current_a": (Name(r"current ?\((?P<unit>m?a)\)"), Name(r"current", "A")),
        "voltage_v": (Name(r"voltage ?\((?P<unit>m?v)\)"), Name(r"voltage", "V")),
        "temperature_degc": (
            Name(r"(aux )?temperature( ?\((?P<unit>°?c|k)\))? ?1"),
            Name(r"aux temperature 1 ?\((?P<unit>°?c|k)\)"),
            Name(r"(cell )?temperature ?\((?P<unit>°?c|k)\)"),
            Name(r"temperature|aux temperature 1", "degC"),
        ),
        "cycle": (Name(r"cycle index"),),
        "step": (Name(r"step index"),),
    },
)

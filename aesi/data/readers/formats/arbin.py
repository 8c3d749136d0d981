"""Arbin (MITS Pro): CSV, or a sheet 'Channel...' of an Excel workbook; current positive on charge."""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="Arbin",
    marks=(r"data point", r"test time( ?\(s\))?", r"step index", r"cycle index"),
    columns={
        "time_s": (Name(r"test time ?\((?P<unit>s)\)"), Name(r"test time", "s")),
        "current_a": (Name(r"current ?\((?P<unit>m?a)\)"), Name(r"current", "A")),
        "voltage_v": (Name(r"voltage ?\((?P<unit>m?v)\)"), Name(r"voltage", "V")),
        "temperature_degc": (
            Name(r"(aux )?temperature( ?\((?P<unit>°?c|k)\))? ?1"),
            Name(r"aux temperature 1 ?\((?P<unit>°?c|k)\)"),
            Name(r"temperature ?\((?P<unit>°?c|k)\)"),
            Name(r"temperature|aux temperature 1", "degC"),
        ),
        "cycle": (Name(r"cycle index"),),
        "step": (Name(r"step index"),),
    },
)

"""Novonix (UHPC): CSV below '[Data]'; time in hours, current positive on charge."""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="Novonix",
    marks=(r"run time ?\(h\)", r"current ?\(m?a\)", r"potential ?\(v\)|voltage ?\(v\)"),
    columns={
        "time_s": (Name(r"run time ?\((?P<unit>h)\)"),),
        "current_a": (Name(r"current ?\((?P<unit>m?a)\)"),),
        "voltage_v": (Name(r"(potential|voltage) ?\((?P<unit>m?v)\)"),),
        "temperature_degc": (Name(r"temperature ?\((?P<unit>.{0,3}c)\)", "degC"),),
        "cycle": (Name(r"cycle number"),),
        "step": (Name(r"step number"),),
    },
)

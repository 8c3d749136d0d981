"""Digatron: CSV below a block about the test, with a line of units below the names; current positive on charge."""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="Digatron",
    marks=(r"step", r"status", r"prog(ram)? (time|duration)(#s)?", r"voltage(#m?v)?", r"current(#m?a)?"),
    columns={
        "time_s": (
            Name(r"prog(ram)? (time|duration)#(?P<unit>s)"),
            Name(r"prog(ram)? (time|duration)", "h:m:s"),
        ),
        "current_a": (Name(r"current#(?P<unit>m?a)"), Name(r"current", "A")),
        "voltage_v": (Name(r"voltage#(?P<unit>m?v)"), Name(r"voltage", "V")),
        "temperature_degc": (
            Name(r"(t1|logtemp0*1)(#(?P<unit>degc|°?c))"),
            Name(r"temperature|t1|logtemp0*1", "degC"),
        ),
        "state": (Name(r"status"),),
        "cycle": (Name(r"cycle"),),
        "step": (Name(r"step"),),
    },
)

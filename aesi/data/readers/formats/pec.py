"""PEC: CSV below a long block about the test; current positive on charge."""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="PEC",
    marks=(r"test", r"rack", r"total time \(.*\)", r"voltage \(m?v\)", r"current \(m?a\)", r"reasoncode"),
    columns={
        "time_s": (
            Name(r"total time \((?P<unit>seconds|minutes|hours)\)"),
            Name(r"total time \(hours in hh:mm:ss.*\)", "h:m:s"),
        ),
        "current_a": (Name(r"current \((?P<unit>m?a)\)"),),
        "voltage_v": (Name(r"voltage \((?P<unit>m?v)\)"),),
        "temperature_degc": (
            Name(r"cell surface temperature \((?P<unit>.{0,3}c)\)", "degC"),
            Name(r"temperature \((?P<unit>.{0,3}c)\)", "degC"),
        ),
        "cycle": (Name(r"cycle"),),
        "step": (Name(r"step"),),
    },
)

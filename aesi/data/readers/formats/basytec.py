"""BaSyTec: text below lines that begin with `~`, the last of which names the columns; current positive on charge."""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="BaSyTec",
    marks=(r"time\[.*\]", r"u\[m?v\]", r"i\[m?a\]", r"dataset|command|line|t-step\[.*\]|ah\[ah\]"),
    columns={
        "time_s": (Name(r"time\[(?P<unit>s|min|h|h:min:s)\]"),),
        "current_a": (Name(r"i\[(?P<unit>m?a)\]"),),
        "voltage_v": (Name(r"u\[(?P<unit>m?v)\]"),),
        "temperature_degc": (Name(r"t1?\[(?P<unit>.{0,3}c)\]", "degC"),),
        "state": (Name(r"command"),),
        "cycle": (Name(r"cyc-count"),),
        "step": (Name(r"line"),),
    },
)

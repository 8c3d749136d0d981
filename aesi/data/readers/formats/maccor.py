"""Maccor: text with tabs or commas below one or two lines about the test.

The current is a magnitude in most exports, and `State` says which way it flows (C charge, D discharge, R rest,
P pause, S suspended); where the export was set to signs, charge is positive.
"""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="Maccor",
    marks=(
        r"rec#?|record",
        r"cyc(le)?( ?[#cp])?|cyc#",
        r"step( time.*)?",
        r"(m?amps|current)( ?[(\[].*[)\]])?",
        r"volt.*",
    ),
    columns={
        "time_s": (
            Name(r"test ?(time)? ?\((?P<unit>s|sec|min|h|hr|hh:mm:ss)\)"),
            Name(r"test ?time", "h:m:s"),
        ),
        "current_a": (
            Name(r"(amps|current) ?[(\[](?P<unit>m?a|amps)[)\]]"),
            Name(r"amps|current", "A"),
            Name(r"mamps", "mA"),
        ),
        "voltage_v": (Name(r"(volts|voltage) ?[(\[](?P<unit>m?v|volts)[)\]]"), Name(r"volts|voltage", "V")),
        "temperature_degc": (
            Name(r"(ev)?temp(erature)? ?1? ?\((?P<unit>°?c|k)\)"),
            Name(r"(ev)?temp(erature)? ?1?", "degC"),
        ),
        "state": (Name(r"state|md"),),
        "cycle": (Name(r"cyc#|cyc(le)?( ?[#cp])?"),),
        "step": (Name(r"step"),),
    },
)

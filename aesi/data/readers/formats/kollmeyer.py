"""The sets that Kollmeyer published (Panasonic 18650PF, 2018, doi:10.17632/wykht8y7tg.1): `.mat` files with a structure
`meas`, its names without units (s, A, V, degC); current positive on charge."""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="Kollmeyer",
    marks=(r"time", r"voltage", r"current", r"ah", r"battery temp degc"),
    columns={
        "time_s": (Name(r"time", "s"),),
        "current_a": (Name(r"current", "A"),),
        "voltage_v": (Name(r"voltage", "V"),),
        "temperature_degc": (Name(r"battery temp degc", "degC"),),
    },
)

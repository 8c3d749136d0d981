"""Neware (BTS): the records as CSV or as the sheet 'record' of an Excel workbook.

Units stand in the names (older versions write mA and mAh); 'Time' is that of the step, 'Total Time' or 'Cumulative
Time' that of the test. A report in layers holds the names and rows of cycles and steps too; its records are the third.
The current is positive on charge; where it is written as a magnitude, the kind of step says its sign.
"""

from aesi.data.readers.formats.format import Format, Name

FORMAT = Format(
    name="Neware",
    marks=(
        r"cur(rent)? ?\(m?a\)|电流\(m?a\)",
        r"volt(age)? ?\(m?v\)|电压\(m?v\)",
        r"total time.*|cumulative time|relative time.*|time(\(h:min:s\.ms\)|\(s\))?|总时间.*|测试时间.*|时间.*",
        r"data ?point|record( ?(index|id|no\.?))?|step (type|id)|status|数据序号|工步类型",
        r"(chg\.?|charge|dchg\.?|capa|discharge|比|充电)? ?(cap|容量).*",
    ),
    columns={
        "time_s": (
            Name(r"(total|test) ?time ?\((?P<unit>s|h|min|h:min:s\.ms|hh:mm:ss)\)"),
            Name(r"(总时间|测试时间)\((?P<unit>s|h)\)"),
            Name(r"total ?time|cumulative time|总时间", "h:m:s"),
            Name(r"absolute time|real ?time|date ?time|date|绝对时间", "date"),
        ),
        "current_a": (Name(r"(cur(rent)?|电流) ?\((?P<unit>m?a)\)"),),
        "voltage_v": (Name(r"(volt(age)?|电压) ?\((?P<unit>m?v)\)"),),
        "temperature_degc": (
            Name(r"(aux\. ?)?t1 ?\((?P<unit>°?c)\)"),
            Name(r"t1 ?\(\?\)", "degC"),  # the sign for degrees lost in an export
            Name(r"(temperature|温度) ?\((?P<unit>°?c)\)"),
        ),
        "state": (Name(r"step type|status|state|工步类型"),),
        "cycle": (Name(r"cycle( ?(index|id))?|循环号"),),
        "step": (Name(r"step( ?(index|id))?|工步号"),),
    },
)

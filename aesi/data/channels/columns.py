"""Assignment of a file's columns to quantities, with their units and signs.

Four conventions are known: names given by the user, this project's names, the makers' (`readers.formats`), and the
battery data format (BDF), https://github.com/battery-data-alliance/battery-data-format, table of required quantities,
whose current is positive on charge.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from aesi.data import units
from aesi.data.channels import headers
from aesi.data.readers.formats.format import Sign
from aesi.data.readers.heading import NUMBER, one_line
from aesi.data.readers.table import TableFile, names_listed
from aesi.errors import DataError, did_you_mean

REQUIRED = ("time_s", "current_a", "voltage_v")
QUANTITIES = (*REQUIRED, "temperature_degc")
SELECTORS = ("state", "cycle", "step")
"""Columns by which rows are chosen or signed; they are not part of a measurement."""

BDF = {
    "time_s": ("Test Time / s", "test_time_second"),
    "current_a": ("Current / A", "current_ampere"),
    "voltage_v": ("Voltage / V", "voltage_volt"),
    "temperature_degc": (
        "Surface Temperature T1 / degC",
        "temperature_t1_celsius",
        "surface_temperature_t1_celsius",
        "Surface Temperature / degC",
        "surface_temperature_celsius",
    ),
    "cycle": ("Cycle Count / 1", "cycle_count"),
    "step": ("Step Index / 1", "step_index", "Step Count / 1", "step_count"),
}
STRANGE_UNITS = {
    "time_s": ("weeks",),
    "current_a": ("c", "c-rate", "1/h", "w", "mw", "kw", "ah", "mah", "wh"),
    "voltage_v": ("kv",),
    "temperature_degc": (),
}
"""Units in column names that no option converts."""


@dataclass(frozen=True)
class Mapped:
    """Position, name and unit of each quantity (and selector) that was found.

    bdf_current : True where the current is a BDF column, so it is positive on charge by definition.
    maker, maker_sign : maker and current sign of a known export; the sign holds where the user gives none.
    stated_degc : temperature of every row, where the user gave a number in place of a column.
    """

    position: dict[str, int]
    header: dict[str, str]
    unit: dict[str, str]
    bdf_current: bool
    notes: tuple[str, ...]
    maker: str
    maker_sign: Sign | None
    stated_degc: float | None


def map_columns(
    table: TableFile,
    columns: Mapping[str, str | None],
    declared: Mapping[str, str],
    required: tuple[str, ...],
    selectors: tuple[str, ...],
) -> Mapped:
    """Find the quantities among the names of a table's columns.

    columns : quantity or selector -> name, or None to leave it out; takes precedence over the known names. For the
    temperature also a number for every row, in degC or the declared unit, where no column has that name.
    declared : quantity -> unit, as the user states; takes precedence over names and formats, but may not contradict a
    unit in a name that is not SI.
    required : quantities that must exist; the others are optional.
    selectors : those of `state`, `cycle`, `step` by which rows are chosen; a maker's `state` is always looked up.
    Raises DataError for an unknown quantity, a name that is missing or exists twice, a unit that is not SI and is
    neither declared nor a maker's, and a declared unit that contradicts one in the name that is not SI.
    """
    declared_units = {q: units.declared(q, u) for q, u in declared.items()}
    finder = _Finder(table, dict(columns), declared_units, required)
    missing = [q for q in QUANTITIES if not finder.take(q) and q in required]
    if missing:
        raise finder.missing(missing)
    for selector in SELECTORS:
        if selector in selectors or selector in finder.given:
            if not finder.take(selector):
                raise finder.missing([selector])
        elif selector == "state":
            finder.find_by_maker(selector)
    finder.check()
    return finder.mapped()


def known_quantities(columns: Mapping[str, str | None]) -> Mapping[str, str | None]:
    """The user's columns by quantity, as they are.  Raises DataError for a name that is neither a quantity nor a
    selector."""
    known = (*QUANTITIES, *SELECTORS)
    for name in columns:
        if name not in known:
            raise DataError(
                f"{name!r} is not a quantity to map{did_you_mean(str(name), known)} There are {', '.join(known)}."
            )
    return columns


class _Finder:
    """Looks up quantities in one table and stores the columns found."""

    def __init__(
        self,
        table: TableFile,
        given: dict[str, str | None],
        declared: dict[str, str],
        required: tuple[str, ...],
    ) -> None:
        self._table, self.given, self._declared, self._required = table, given, declared, required
        self._file = table.path.name
        known_quantities(given)
        self.position: dict[str, int] = {}
        self.unit: dict[str, str] = {}
        self.notes: list[str] = []
        self.bdf_current = False
        self._export_notes: list[str] = []
        self._stated_degc: float | None = None

    def take(self, quantity: str) -> bool:
        """Find and store the quantity. True where it was found, or where the user left it out."""
        if quantity in self.given:
            name = self.given[quantity]
            if name is None:
                if quantity in self._required:
                    raise DataError(f"{self._file}: {quantity} cannot be left out.")
                self.notes.append(f"{quantity} was left out as asked.")
                return True
            if quantity == "temperature_degc" and NUMBER.fullmatch(name) and name not in self._table.header:
                self._store_stated(float(name), name)
                return True
            self.position[quantity] = self._find_by_given_name(name, quantity)
            if name != quantity:
                self.notes.append(f"{quantity} was taken from column {name!r} as asked.")
            self._set_unit(quantity, "")
            return True
        found = self._find_by_own_name(quantity)
        if found is not None:
            self.position[quantity] = found
            self._set_unit(quantity, "")
            return True
        return self.find_by_maker(quantity) or self._find_by_bdf(quantity)

    def _store_stated(self, temperature: float, name: str) -> None:
        """Store a temperature for all rows, given in the declared unit."""
        si = units.SI["temperature_degc"]
        unit = self.unit["temperature_degc"] = self._declared.get("temperature_degc", si)
        self._stated_degc = float(units.to_si("temperature_degc", np.array([temperature]), unit)[0])
        converted = "" if unit == si else f" {unit}, {self._stated_degc:.5g} {si},"
        self.notes.append(f"temperature_degc is {name}{converted} in every row, as stated.")

    def missing(self, quantities: list[str]) -> DataError:
        """The error for missing quantities, with the options that would map them."""
        header = self._table.header
        likely = [name for name in (headers.likeliest(q, header) for q in quantities) if name]
        found = f"; the nearest: {', '.join(repr(name) for name in likely)}" if likely else ""
        if set(quantities) <= set(SELECTORS):
            options = " ".join(f"--column {q}=NAME" for q in quantities)
            return DataError(
                f"{self._file} has no column {' and no column '.join(quantities)}; say which is meant: {options}. "
                f"It has: {names_listed(header)}."
            )
        sign = _sign_advice(headers.likeliest("current_a", header)) if "current_a" in quantities else ""
        state = headers.nearest("state", header)
        words = f', or --state "{state}" if the current is a magnitude' if sign and state else ""
        return DataError(
            f"{self._file} has no column {' and no column '.join(quantities)}{found}. "
            f"Say which is meant: {headers.options(quantities, header)}{sign}{words}. "
            f"It has: {names_listed(header) or 'none'}."
        )

    def check(self) -> None:
        """Refuse a column that is used for two quantities; note a voltage or temperature column that is not used."""
        seen: dict[int, str] = {}
        for quantity, place in self.position.items():
            if place in seen and not {quantity, seen[place]} & set(SELECTORS):
                raise DataError(
                    f"{self._file}: column {self._table.header[place]!r} cannot be both {seen[place]} and {quantity}."
                )
            seen[place] = quantity
        for quantity in sorted(self._declared.keys() - self.position.keys() - self.unit.keys()):
            if self.given.get(quantity, quantity) is not None:
                self.notes.append(
                    f"A unit was declared for {quantity} ({self._declared[quantity]}), and there is no such column."
                )
        leave = {"voltage_v": "", "temperature_degc": ", --column temperature_degc= leaves it out"}
        unused = [name for place, name in enumerate(self._table.header) if place not in seen]
        for quantity in sorted(leave.keys() - self.position.keys() - self.given.keys()):
            name = headers.likeliest(quantity, unused, doubtful=quantity not in REQUIRED)
            if name is not None:
                others = self._other_temperatures(name) if quantity == "temperature_degc" else ""
                also = f"; there is also {others}" if others else ""
                self.notes.append(
                    f"Column {name!r} looks like a {quantity.partition('_')[0]} and is not used; "
                    f"{headers.of_column(quantity, name)} takes it{leave[quantity]}{also}."
                )
        if "temperature_degc" in self.position:
            taken = self._table.header[self.position["temperature_degc"]]
            if others := self._other_temperatures(taken):
                self.notes.append(f"The temperature was taken from column {taken!r}, and not from {others}.")

    def _other_temperatures(self, name: str) -> str:
        """Text that lists the other temperature columns, except this one in another unit."""
        every = headers.temperatures(self._table.header)
        return names_listed(other for other in every if headers.stem(other) != headers.stem(name))

    def mapped(self) -> Mapped:
        """The columns found so far."""
        form = self._table.format
        names = {quantity: self._table.header[place] for quantity, place in self.position.items()}
        if form is not None and self._export_notes:
            self.notes.insert(0, f"Recognised as an export of {form.name}: {', '.join(self._export_notes)}.")
        return Mapped(
            self.position,
            names,
            self.unit,
            self.bdf_current,
            tuple(self.notes),
            form.name if form else "",
            form.sign if form else None,
            self._stated_degc,
        )

    def _find_by_given_name(self, name: str, quantity: str) -> int:
        """Position of the column that the user names.  Raises DataError, with the nearest, where there is none."""
        header = self._table.header
        found = self._only([i for i, there in enumerate(header) if one_line(there) == one_line(name)])
        if found is None:
            near = get_close_matches(name, header, n=1, cutoff=0.4)
            hint = f"; the nearest is {near[0]!r}" if near else ""
            raise DataError(
                f"{self._file} has no column {name!r} for {quantity}{hint}. It has: {names_listed(header)}."
            )
        return found

    def _find_by_own_name(self, quantity: str) -> int | None:
        """Position of the column under this project's name of the quantity."""
        return self._only([i for i, name in enumerate(self._table.header) if name.lower() == quantity])

    def find_by_maker(self, quantity: str) -> bool:
        """Find and store the quantity under its name in a known export; False where it has none."""
        form = self._table.format
        found = form.find(quantity, self._table.header) if form else None
        if found is None:
            return False
        name = self._table.header[found[0]]
        self._place_of(name)  # refuses several columns of that name
        other = form.reference_column(quantity, found[0], self._table.header) if form else None
        if other is not None:
            raise DataError(
                f"{self._file}: {name!r} and {other!r} are potentials against a reference, and {quantity} of the cell "
                f"is their difference; export it as a column of its own, or, if {name!r} is the whole cell's, say so: "
                f"{headers.of_column(quantity, name)}."
            )
        self.position[quantity], unit = found
        self._set_unit(quantity, unit)
        if quantity in QUANTITIES:
            taken = self.unit[quantity]
            converted = "" if taken == units.SI[quantity] else f" (converted from {taken})"
            self._export_notes.append(f"{quantity} from {self._table.header[found[0]]!r}{converted}")
        return True

    def _find_by_bdf(self, quantity: str) -> bool:
        """Find and store the quantity under a name of the battery data format; False where it has none."""
        for label in BDF.get(quantity, ()):
            found = self._place_of(label)
            if found is not None:
                self.position[quantity] = found
                self._set_unit(quantity, units.SI.get(quantity, ""))
                if quantity in QUANTITIES:
                    self.notes.append(
                        f"{quantity} was taken from the BDF column {self._table.header[found]!r}."
                    )
                self.bdf_current |= quantity == "current_a"
                return True
        return self._find_by_bdf_in_other_unit(quantity)

    def _find_by_bdf_in_other_unit(self, quantity: str) -> bool:
        """As `_find_by_bdf`, under BDF's names with another unit of the quantity: 'Test Time / h', 'Current / mA'."""
        stems = {_without_blanks(label.rpartition("/")[0]) for label in BDF.get(quantity, ()) if "/" in label}
        places = [
            i
            for i, name in enumerate(self._table.header)
            if _without_blanks(name.rpartition("/")[0]) in stems and headers.unit_of(quantity, name)
        ]
        found = self._only(places)
        if found is None:
            return False
        name = self._table.header[found]
        self.position[quantity] = found
        self._set_unit(quantity, headers.unit_of(quantity, name) or "")
        self.notes.append(
            f"{quantity} was taken from the BDF column {name!r} (converted from {self.unit[quantity]})."
        )
        self.bdf_current |= quantity == "current_a"
        return True

    def _set_unit(self, quantity: str, known: str) -> None:
        """Set the unit: the user's, else that of the line of units, the maker's, or SI. Refuse one that contradicts the
        name."""
        if quantity not in units.SI:
            return
        name = self._table.header[self.position[quantity]]
        below = self._table.units[self.position[quantity]] if self._table.units else ""
        if quantity in self._declared:
            unit = self._declared[quantity]
            self._check_declared(
                quantity, units.spelt(quantity, below) or headers.unit_of(quantity, name), known
            )
        elif units.spelt(quantity, below):
            unit = units.spelt(quantity, below) or ""
            if unit != units.SI[quantity] and self._table.format is None:
                self.notes.append(f"{quantity} was converted from {unit}, as the line of units says.")
        elif known:
            unit = known
        else:
            unit = units.SI[quantity]
            self._refuse_other_unit(quantity, name, below)
        self.unit[quantity] = unit

    def _check_declared(self, quantity: str, said: str | None, known: str) -> None:
        """Note that a declared unit holds; refuse one that contradicts the header.

        said : unit in the header, None for none. Where that is SI, which exports and this project's own names state by
        default and checks of the values may find wrong, the declaration holds and a note says so; likewise against a
        maker's `known` unit. Clock times and dates are recognised by their cells.
        """
        name, unit = self._table.header[self.position[quantity]], self._declared[quantity]
        numbers, though = units.FACTORS[quantity], ""
        if unit in numbers and said in numbers and said != unit:
            if said != units.SI[quantity]:
                raise DataError(
                    f"{self._file}: column {name!r} is in {said} by its header, and {unit} was declared for "
                    f"{quantity}; declare --unit {quantity}={said}, or rename the column if its header is wrong."
                )
            though = f", though column {name!r} is in {said} by its header"
        elif unit in numbers and said is None and known in numbers and known != unit:
            though = f", though column {name!r} of such an export is in {known}"
        self.notes.append(f"{quantity} was converted from {unit} as declared{though}.")

    def _refuse_other_unit(self, quantity: str, name: str, below: str) -> None:
        """Raises DataError for a column that is not in SI by its name, where no unit was declared, and for a required
        one whose unit is not known: SI would be a guess.

        below : its cell in the line of units, which holds no known unit; empty without such a line.
        """
        said = headers.unit_of(quantity, name)
        if said is not None and said != units.SI[quantity]:
            raise DataError(
                f"{self._file}: column {name!r} is in {said} by its name, and {quantity} is needed in "
                f"{units.SI[quantity]}; declare it: --unit {quantity}={said}."
            )
        if said is None and quantity == "current_a" and headers.is_rate_or_power(name):
            raise DataError(
                f"{self._file}: column {name!r} is a C-rate or a power by its name, and current_a is needed in A; "
                "convert the column, or, if it is a current in A, declare it: --unit current_a=A."
            )
        if headers.unit_in(name).lower() in STRANGE_UNITS[quantity]:
            raise DataError(
                f"{self._file}: column {name!r} is in {headers.unit_in(name)} by its name, and {quantity} is needed "
                f"in {units.SI[quantity]}; convert the column."
            )
        unknown = below or headers.marked_unit(name)
        if quantity in REQUIRED and unknown and said is None:
            raise DataError(
                f"{self._file}: column {name!r} has {unknown!r} in place of a unit, which is none that is known for "
                f"{quantity} ({', '.join(units.FACTORS[quantity])}); declare the one it is in, as in "
                f"--unit {quantity}={units.SI[quantity]}, or convert the column."
            )

    def _place_of(self, label: str) -> int | None:
        """Position of the only column of a name, blanks and case apart; None for none.  Raises as `_only`."""
        wanted = _without_blanks(label)
        return self._only([i for i, name in enumerate(self._table.header) if _without_blanks(name) == wanted])

    def _only(self, places: list[int]) -> int | None:
        """The only one of the positions of a name, None for none.  Raises DataError for several columns of one name."""
        if len(places) > 1:
            raise DataError(
                f"{self._file} has {len(places)} columns named {self._table.header[places[0]]!r} (numbers "
                f"{', '.join(str(p + 1) for p in places)}); rename all but one of them."
            )
        return places[0] if places else None


def _sign_advice(current: str | None) -> str:
    """What a proposal of options adds on the sign of the current in this column."""
    said = headers.sign_in(current or "")
    if said is None:
        return ", and --sign charge-positive if charging is positive there"
    return "" if said == "discharge-positive" else f" --sign {said}"


def _without_blanks(name: str) -> str:
    """A column's name in lower case without any blanks, as names of the battery data format are compared."""
    return re.sub(r"\s+", "", name).lower()

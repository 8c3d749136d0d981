"""The plan of the cases on measured cells: withheld temperatures, added faults, ageing, impedance spectra, controls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from aesi.bench import some_chosen
from aesi.bench.physics.archive import ARCHIVE, for_development
from aesi.bench.real.case import Fault, RealCase, Take
from aesi.bench.real.faults import FaultKind
from aesi.bench.real.good import beside_good
from aesi.data.catalogue import HG2, M50T, NMC, PANASONIC

CELLS = {
    HG2: "lg_18650hg2_25degc.bpx.json",
    PANASONIC: "panasonic_ncr18650pf_25degc.bpx.json",
    NMC: f"{NMC}:cell.bpx.json",
    M50T: "lg_m50_chen2020.bpx.json",
}
"""Data set -> the cell file, which was published or calibrated at 25 degC alone."""
FITTED = frozenset({(HG2, "25degC_mixed1"), (HG2, "25degC_cap_1c")})
"""(data set, record) that the cell file was calibrated on. They are no controls, since their error is too small."""
WINDOW_S = 3600.0
"""Only the first hour of a drive is used, s. A convention that limits the processor time."""
THERMOCOUPLE = "thermocouple on the case"
ADDED = "added"
COLD_AND_HOT: dict[str, tuple[str, ...]] = {
    HG2: ("40degC_la92", "10degC_us06", "0degC_mixed1", "n10degC_cap_1c", "40degC_c20_ocv", "0degC_c20_ocv"),
    PANASONIC: (
        "10degC_cycle_1",
        "0degC_cycle_1",
        "n10degC_cycle_1",
        "10degC_hppc",
        "0degC_hppc",
        "n10degC_hppc",
    ),
}
"""Data set -> records at other temperatures than the file's, of which the temperature is withheld."""
WARMING: dict[str, tuple[str, ...]] = {
    HG2: ("25degC_us06", "25degC_cap_1c_b"),
    PANASONIC: ("25degC_us06", "25degC_1c_start"),
}
"""Data set -> records at 25 degC in which the cell warms up under load, of which the temperature is withheld."""
SLOW_OR_PULSES = ("c20", "hppc")
"""Parts of the names of slow discharges and pulse tests, which are used whole."""
UNTIL_S = {"n10degC_hppc": 78_611.0}
"""Record -> time up to which it is used, s: nine hours are missing after it, in which the current is unknown."""
CONTROLS: dict[str, tuple[str, ...]] = {
    HG2: ("25degC_mixed1", "25degC_mixed2", "25degC_mixed3", "25degC_la92", "25degC_us06", "25degC_cap_1c_b"),
    PANASONIC: (
        "25degC_cycle_1",
        "25degC_cycle_2",
        "25degC_cycle_3",
        "25degC_hwfet",
        "25degC_la92",
        "25degC_us06",
    ),
    NMC: ("drive_cycle", "C2", "1C"),
}
"""Data set -> records at the temperature of the cell file with nothing added or withheld."""
COLDER_CONTROLS: dict[str, tuple[str, ...]] = {
    HG2: ("10degC_us06", "0degC_mixed1", "40degC_la92"),
    PANASONIC: ("10degC_cycle_1", "0degC_cycle_1", "n10degC_cycle_1"),
}
"""Data set -> records at other temperatures with the temperature column given. They lack no temperature; a file that
was calibrated at 25 degC has a larger model error there."""
FAULTY = {HG2: "25degC_mixed2", PANASONIC: "25degC_cycle_1", NMC: "drive_cycle"}
"""Data set -> the record that faults are added to."""
FAULTS: dict[FaultKind, tuple[tuple[float, ...], dict[str, float]]] = {
    "current_offset": (
        (0.05, 0.1, 0.3),
        {"current_sensor_offset.offset_a": 1.0, "leakage_current.leakage_a": -1.0},
    ),
    "current_gain": ((1.01, 1.02, 1.03), {"current_sensor_gain.gain": 1.0}),
    "voltage_offset": ((0.003, 0.008, 0.015), {"voltage_sensor_offset.offset_v": 1.0}),
    "voltage_lag": ((0.3, 1.0, 2.0), {"clock_skew.lag_s": 1.0}),
    "wrong_soc0": ((0.02, 0.05, 0.1), {}),
}
"""Kind of fault -> (three sizes; parameters of the right effects, each as a multiple of the size). The units are those
of `FaultKind`. A wrong initial state of charge has no right effect: the tracer has to correct it without naming one."""
RESISTANCES_OHM = {HG2: (0.005, 0.015), PANASONIC: (0.005, 0.015), NMC: (0.0005, 0.002)}
"""Data set -> contact resistances that are added, ohm."""
MORE_IN_FILE = 0.05
"""Share by which a wrong cell file declares too much of both electrodes."""
LOSSES = ("lithium_inventory_loss", "active_material_loss_negative", "active_material_loss_positive")
"""Effects each of which is a right answer for a cell that has lost capacity."""


SPECTRA = {"25degC": "25degC_eis", "10degC": "10degC_eis"}
"""First part of a Panasonic record's name -> the impedance spectra of the same month."""


DRIVES = ("cycle", "us06", "mixed", "la92")
"""Parts of the names of the archives' records that are used: drives."""
RESTS_FIRST = {(PANASONIC, "us06"), (PANASONIC, "la92")}
"""(data set, drive) of the archives that begin with an hour or two of rest. They are left out, since only the first
hour is used."""
SHORT = ("n10degC_601_us06", "n20degC_610_us06")
"""Records of the archives that are shorter than an hour, on a clock that began hours before; they are used whole."""
WARM = ("25degC", "40degC_562")
"""First parts of the names of records near 25 degC, of which withholding the temperature would hide nothing. The
archive of the HG2 has some of these, measured at 24 degC, under 40 degC."""


def plan(archive: bool = False) -> tuple[RealCase, ...]:
    """All cases, in a fixed order. Every second case of a group, beginning with the first, is for development.

    archive : take the cases on the published archives instead: other drives of the same cells, at other temperatures.
    Those on a record that constants of the cell files were chosen on are for development, too.
    """
    if archive:
        cases = list(_archived())
    else:
        cases = [*_controls(), *_withheld(), *_faults(), *_physics(), *_ageing(), *_spectra_cases()]
        cases += beside_good(cases)
    there = {case.name for case in cases}
    seen: dict[str, int] = {}
    out = []
    for case in cases:
        number = seen[case.group] = seen.get(case.group, -1) + 1
        matched = case.matched if case.matched in there else None
        chose = number % 2 == 0 or for_development(case.take.set, case.take.file)
        out.append(replace(case, development=chose, matched=matched))
    return tuple(c for c in out if c.group != "control" or (c.take.set, c.take.file) not in FITTED)


def chosen(
    cases: int | None = None,
    only: str | None = None,
    development: bool | None = None,
    every: int = 1,
    archive: bool = False,
) -> Sequence[RealCase]:
    """The selected cases of the plan.

    cases : number of cases, from the first; None selects all.  only : a group, or a substring of a case's name.
    development : True selects the development cases, False the test cases.  every : take each n-th case.
    archive : as for `plan`.  Raises InputError if no case is selected.
    """
    planned = plan(archive)
    found = [c for c in planned if only is None or only == c.group or only in c.name]
    found = [c for c in found if development is None or c.development == development]
    return some_chosen("real", found[::every][:cases], (case.group for case in planned))


def _stop(file: str) -> float | None:
    if file in SHORT:
        return None
    return UNTIL_S.get(file) if any(word in file for word in SLOW_OR_PULSES) else WINDOW_S


def _soc0(cell: str, file: str) -> float | None:
    """State of charge at the first row. All records begin with a full charge but two of the M50T: its UDDS, and the
    pulses, of which the tracer has to find it (None)."""
    if cell != M50T:
        return 1.0
    return 0.7816 if file == "n0_udds" else None


def _spectra(cell: str, file: str) -> str | None:
    return SPECTRA.get(file.partition("_")[0]) if cell == PANASONIC else None


def _archived() -> Iterator[RealCase]:
    for cell, days in ARCHIVE.items():
        for record in sorted(days):
            drive = next((word for word in DRIVES if word in record), None)
            if drive is not None and (cell, drive) not in RESTS_FIRST and not record.startswith(WARM):
                yield _withheld_from(cell, record)
                yield _control(cell, record)


def _controls() -> Iterator[RealCase]:
    for given in (CONTROLS, COLDER_CONTROLS):
        for cell, files in given.items():
            yield from (_control(cell, file) for file in files)


def _control(cell: str, file: str) -> RealCase:
    return RealCase(
        name=f"control-{cell}-{file}",
        group="control",
        cell=CELLS[cell],
        take=Take(cell, file, _stop(file)),
        soc0=_soc0(cell, file),
        answers=(),
        source="the same cell at the temperature given, nothing added",
        spectra=_spectra(cell, file),
    )


def _withheld_from(cell: str, file: str) -> RealCase:
    return RealCase(
        name=f"withheld-{cell}-{file}",
        group="withheld",
        cell=CELLS[cell],
        take=Take(cell, file, _stop(file), temperature=False),
        soc0=1.0,
        answers=("ambient_temperature",),
        source=THERMOCOUPLE,
        measured="temperature",
        matched=f"control-{cell}-{file}",
    )


def _withheld() -> Iterator[RealCase]:
    for cell, files in COLD_AND_HOT.items():
        yield from (_withheld_from(cell, file) for file in files)
    for cell, files in WARMING.items():
        for file in files:
            yield replace(
                _withheld_from(cell, file),
                name=f"warming-{cell}-{file}",
                answers=("self_heating", "ambient_temperature"),
                measured=None,
            )


def _faults() -> Iterator[RealCase]:
    for number in range(3):
        for kind, (sizes, parameters) in FAULTS.items():
            for cell, file in FAULTY.items():
                size = sizes[number]
                yield RealCase(
                    name=f"{kind}-{size:g}-{cell}",
                    group="fault",
                    cell=CELLS[cell],
                    take=Take(cell, file, WINDOW_S),
                    soc0=1.0,
                    answers=tuple(name.partition(".")[0] for name in parameters),
                    source=ADDED,
                    parameters={name: times * size for name, times in parameters.items()},
                    fault=Fault(kind, size),
                    matched=f"control-{cell}-{file}",
                )


def _physics() -> Iterator[RealCase]:
    for cell, file in FAULTY.items():
        for ohm in RESISTANCES_OHM[cell]:
            yield RealCase(
                name=f"contact-{ohm:g}-{cell}",
                group="physics",
                cell=CELLS[cell],
                take=Take(cell, file, WINDOW_S),
                soc0=1.0,
                answers=("series_resistance",),
                source=ADDED,
                parameters={"series_resistance.resistance_ohm": ohm},
                fault=Fault("contact_resistance", ohm),
                matched=f"control-{cell}-{file}",
            )
        yield RealCase(
            name=f"capacity-{cell}",
            group="physics",
            cell=CELLS[cell],
            take=Take(cell, file),
            soc0=1.0,
            answers=(*LOSSES, "current_sensor_gain"),
            source=f"{ADDED} to the file: {MORE_IN_FILE:.0%} more of both electrodes",
            parameters={"current_sensor_gain.gain": 1.0 / (1.0 + MORE_IN_FILE)},
            fault=Fault("capacity_in_file", MORE_IN_FILE),
            matched=f"control-{cell}-{file}",
        )


def _ageing() -> Iterator[RealCase]:
    first_discharge = Take(PANASONIC, "25degC_1c_start")
    for file, answers in (("25degC_1c_end", LOSSES), ("25degC_1c_start", ())):
        yield RealCase(
            name=f"ageing-{file}",
            group="ageing",
            cell=CELLS[PANASONIC],
            take=Take(PANASONIC, file),
            soc0=1.0,
            answers=answers,
            source="charge of the 1C discharges of March and July 2017",
            measured="capacity" if answers else None,
            against=first_discharge if answers else None,
        )
    for file in ("n0_hppc", "n0_udds"):
        yield RealCase(
            name=f"fresh-{M50T}-{file}",
            group="ageing",
            cell=CELLS[M50T],
            take=Take(M50T, file),
            soc0=_soc0(M50T, file),
            answers=(),
            source="charge of the C/20 discharge of the fresh cell",
            measured="declared capacity",
            against=Take(M50T, "n0_c20_discharge"),
        )


def _spectra_cases() -> Iterator[RealCase]:
    for month, spectra in SPECTRA.items():
        yield RealCase(
            name=f"witness-{month}_hppc",
            group="witness",
            cell=CELLS[PANASONIC],
            take=Take(PANASONIC, f"{month}_hppc"),
            soc0=1.0,
            answers=(),
            source=f"impedance at half charge, {spectra}",
            spectra=spectra,
        )

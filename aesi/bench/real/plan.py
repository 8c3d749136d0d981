"""The cases on measured cells: withheld temperatures, faults put in, ageing, witnesses, and controls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from aesi.bench import some_chosen
from aesi.bench.physics.archive import ARCHIVE
from aesi.bench.real.case import Fault, RealCase, Take
from aesi.bench.real.faults import FaultKind
from aesi.bench.real.good import beside_good

HG2, PANASONIC, NMC, M50T = "lg_18650hg2", "panasonic_ncr18650pf", "about_energy_nmc", "lg_m50t_w8"
CELLS = {
    HG2: "lg_18650hg2_25degc.bpx.json",
    PANASONIC: "panasonic_ncr18650pf_25degc.bpx.json",
    NMC: f"{NMC}:cell.bpx.json",
    M50T: "lg_m50_chen2020.bpx.json",
}
"""Files calibrated at 25 degC alone, or published."""
FITTED = frozenset({(HG2, "25degC_mixed1"), (HG2, "25degC_cap_1c")})
"""Records that a file was calibrated on: what is asked of them says nothing, so that they are no controls."""
WINDOW_S = 3600.0
"""Part of a drive that is taken, s: the first hour."""
THERMOCOUPLE = "thermocouple on the case"
PUT_IN = "put in"
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
WARMING: dict[str, tuple[str, ...]] = {
    HG2: ("25degC_us06", "25degC_cap_1c_b"),
    PANASONIC: ("25degC_us06", "25degC_1c_start"),
}
SLOW_OR_PULSES = ("c20", "hppc")
UNTIL_S = {"n10degC_hppc": 78_611.0}
"""Where nine hours are missing from a record: what the cell did in them is unknown."""
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
COLDER_CONTROLS: dict[str, tuple[str, ...]] = {
    HG2: ("10degC_us06", "0degC_mixed1", "40degC_la92"),
    PANASONIC: ("10degC_cycle_1", "0degC_cycle_1", "n10degC_cycle_1"),
}
"""The thermocouple is given: what is left is what a file calibrated at 25 degC lacks there, and no temperature."""
FAULTY = {HG2: "25degC_mixed2", PANASONIC: "25degC_cycle_1", NMC: "drive_cycle"}
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
"""Kind -> three sizes, and the parameters of the right names as multiples of the size. An initial state that was told
wrongly is for the finder to correct, without a name."""
RESISTANCES_OHM = {HG2: (0.005, 0.015), PANASONIC: (0.005, 0.015), NMC: (0.0005, 0.002)}
MORE_IN_FILE = 0.05
"""Share by which both electrodes are larger in a cell file that is made wrong."""
LOSSES = ("lithium_inventory_loss", "active_material_loss_negative", "active_material_loss_positive")


SPECTRA = {"25degC": "25degC_eis", "10degC": "10degC_eis"}
"""Start of a Panasonic record's name -> the spectra of the same month."""


DRIVES = ("cycle", "us06", "mixed", "la92")
RESTS_FIRST = {(PANASONIC, "us06"), (PANASONIC, "la92")}
"""Drives of the archives that begin with an hour or two of rest, which the first hour would be."""
WARM = ("25degC", "40degC_562")
"""Chambers at which nothing is withheld: that of the files, and what the archive of the HG2 has at 24 degC under 40."""


def plan(archive: bool = False) -> tuple[RealCase, ...]:
    """All cases in a fixed order; every other one of a group is for development.

    archive : those of the published archives, other drives at other temperatures of the same cells.
    """
    if archive:
        cases = list(_archived())
    else:
        cases = [*_controls(), *_withheld(), *_faults(), *_physics(), *_ageing(), *_witnesses()]
        cases += beside_good(cases)
    there = {case.name for case in cases}
    seen: dict[str, int] = {}
    out = []
    for case in cases:
        number = seen[case.group] = seen.get(case.group, -1) + 1
        matched = case.matched if case.matched in there else None
        out.append(replace(case, development=number % 2 == 0, matched=matched))
    return tuple(c for c in out if c.group != "control" or (c.take.set, c.take.file) not in FITTED)


def chosen(
    cases: int | None = None,
    only: str | None = None,
    development: bool | None = None,
    every: int = 1,
    archive: bool = False,
) -> Sequence[RealCase]:
    """Cases of the plan; of that of the archives with `archive`.

    cases : the first so many.  only : a group, or a substring of names.  development : only those that choose, or only
    those that do not.  every : take each n-th.  Raises InputError where none is left.
    """
    planned = plan(archive)
    found = [c for c in planned if only is None or only == c.group or only in c.name]
    found = [c for c in found if development is None or c.development == development]
    return some_chosen("real", found[::every][:cases], (case.group for case in planned))


def _stop(file: str) -> float | None:
    return UNTIL_S.get(file) if any(word in file for word in SLOW_OR_PULSES) else WINDOW_S


def _soc0(cell: str, file: str) -> float | None:
    """Every test starts from a full charge but two of the M50T."""
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
        source="the same cell at the temperature given, nothing put in",
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
                    source=PUT_IN,
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
                source=PUT_IN,
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
            source=f"{PUT_IN} to the file: {MORE_IN_FILE:.0%} more of both electrodes",
            parameters={"current_sensor_gain.gain": 1.0 / (1.0 + MORE_IN_FILE)},
            fault=Fault("capacity_in_file", MORE_IN_FILE),
            matched=f"control-{cell}-{file}",
        )


def _ageing() -> Iterator[RealCase]:
    march = Take(PANASONIC, "25degC_1c_start")
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
            against=march if answers else None,
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


def _witnesses() -> Iterator[RealCase]:
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

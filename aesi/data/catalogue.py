"""Public data sets of measured cells: where they come from, where they are on this machine, how to get them.

The package itself contains no measurements. Some sets are fetched from their public address and checked; the others are
behind pages that a program cannot follow, so they are listed with their DOI and how to read them.
"""

from __future__ import annotations

import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path, PurePath

from aesi.data.fetch import Remote, fetch
from aesi.errors import DataAway, DataError, did_you_mean, not_written
from aesi.numerics.files.cache_folder import cache_folder

FOLDER_VARIABLE = "AESI_DATA"
"""Environment variable with a folder of the user's own copies: `<folder>/<set>/` or `<folder>/measured/<set>/`."""
SHARED = Path("shared") / "data"
"""Folder with a group's copies, in the working folder or in one above it."""
SUFFIXES = ("", ".csv", ".csv.gz", ".parquet", ".mat", ".bpx.json", ".json")

ABOUT_ENERGY = (
    "https://raw.githubusercontent.com/About-Energy-OpenSource/About-Energy-BPX-Parameterisation/"
    "8efd45a7495ad8d3a4d72b547e657322a4baabd2/"
)
ABOUT_ENERGY_COLUMNS = {"time_s": "Time [s]", "current_a": "I[A]", "voltage_v": "U[V]"}


@dataclass(frozen=True)
class DataSet:
    """One cell and its tests.

    files : files that `get` fetches; empty where a program cannot.  how : how to get the set by hand and to read it.
    published : pattern of a record's name in the path of its file in the published archive; the groups that match are
    joined by `_`.
    """

    name: str
    cell: str
    tests: str
    source: str
    licence: str
    files: tuple[Remote, ...] = ()
    how: str = ""
    published: str = ""

    def record_of(self, path: PurePath) -> str | None:
        """Name of the record in a file of the unpacked archive, in lower case except `degC` and with `n` for minus;
        None for other files."""
        match = re.search(self.published, path.as_posix()) if self.published else None
        if match is None:
            return None
        name = "_".join(filter(None, match.groups())).lower().replace("degc", "degC")
        return re.sub("^-", "n", name)


def _about_energy(name: str, path: str, sha256: str) -> Remote:
    """A file of the repository of About:Energy, by its path there."""
    columns = ABOUT_ENERGY_COLUMNS if name.endswith(".csv") else None
    return Remote(name, ABOUT_ENERGY + path, sha256, columns, "charge-positive")


NMC, NMC_2C, LFP = "about_energy_nmc", "about_energy_nmc_2c", "about_energy_lfp"
HG2, PANASONIC, M50T = "lg_18650hg2", "panasonic_ncr18650pf", "lg_m50t_w8"
"""Names of the data sets."""

SETS = (
    DataSet(
        NMC,
        "12.5 Ah NMC111/graphite pouch cell, 25 degC",
        "C/20, C/2 and 1C discharges; drive cycle at 1 Hz; published porous-electrode parameters (BPX)",
        "About:Energy, github.com/About-Energy-OpenSource/About-Energy-BPX-Parameterisation, commit 8efd45a",
        "CC BY-SA 4.0",
        (
            _about_energy(
                "C20.csv",
                "NMC/data/validation/NMC_25degC_Co20.csv",
                "d04bf7f43b92df88fb0c158621f3309380027b181bd6c803f3be709c371b76c4",
            ),
            _about_energy(
                "C2.csv",
                "NMC/data/validation/NMC_25degC_Co2.csv",
                "0a86a5e9eebfef061b7b0535269837780f391bfa61df09887ba955b635e58275",
            ),
            _about_energy(
                "1C.csv",
                "NMC/data/validation/NMC_25degC_1C.csv",
                "4dbfdac5a6d4d9aebc1c916a1fd3687049c86d3b191a4210dd0c1d8f90de34a7",
            ),
            _about_energy(
                "drive_cycle.csv",
                "NMC/data/validation/NMC_25degC_DriveCycle.csv",
                "08b8ecfcd3d38fba5fe3852b518d70188ac5c10e28bf47be9ec45fa0467ccace",
            ),
            _about_energy(
                "cell.bpx.json",
                "NMC/nmc_pouch_cell_BPX.json",
                "9fea2c5a2748ac1f09e2bb32225fe4810597611a93ea57d68ed84783188f4d03",
            ),
        ),
    ),
    DataSet(
        NMC_2C,
        "12.5 Ah NMC111/graphite pouch cell, 25 degC",
        "2C discharge",
        "About:Energy, github.com/About-Energy-OpenSource/About-Energy-BPX-Parameterisation, commit 8efd45a",
        "CC BY-SA 4.0",
        (
            _about_energy(
                "2C.csv",
                "NMC/data/validation/NMC_25degC_2C.csv",
                "19d38ed508a42a74398c1276933335f97022f98ff9fa33bf39a59309fbc9f563",
            ),
        ),
    ),
    DataSet(
        LFP,
        "2 Ah LFP/graphite 18650 cell, 25 degC",
        "C/20, C/2, 1C and 2C discharges; drive cycle at 1 Hz; published porous-electrode parameters (BPX)",
        "About:Energy, github.com/About-Energy-OpenSource/About-Energy-BPX-Parameterisation, commit 8efd45a",
        "CC BY-SA 4.0",
        (
            _about_energy(
                "C20.csv",
                "LFP/data/validation/LFP_25degC_Co20.csv",
                "6ca1fe6c43c147d5d108a3b7ce045c3d0e5a0fadf1a6c5a70e98df82faff568d",
            ),
            _about_energy(
                "C2.csv",
                "LFP/data/validation/LFP_25degC_Co2.csv",
                "1c857767bdd1a0a8ebe55796d22075e3dd2242dc11c31843ed0c0ac46ce4c993",
            ),
            _about_energy(
                "1C.csv",
                "LFP/data/validation/LFP_25degC_1C.csv",
                "f3dcaf1ed812fda72b3b2d73d08a5f0ae1737fa480e24ede609f88766aadc4ce",
            ),
            _about_energy(
                "2C.csv",
                "LFP/data/validation/LFP_25degC_2C.csv",
                "1abbc52904175977aa775967677dd93ab7bc4f673db5a6abef899461d19abb02",
            ),
            _about_energy(
                "drive_cycle.csv",
                "LFP/data/validation/LFP_25degC_DriveCycle.csv",
                "953a15eb2500f00bd057bd6f20a3f503b53d5849edcbef4d32617d2eb1986d94",
            ),
            _about_energy(
                "cell.bpx.json",
                "LFP/lfp_18650_cell_BPX.json",
                "56d2932515637c3f899c2b6c9620ee4fcf69b71f7479782e57d7b482d143be02",
            ),
        ),
    ),
    DataSet(
        HG2,
        "LG 18650HG2, 3.0 Ah, NMC/graphite-SiO",
        "C/20, 1C capacity, US06, LA92 and mixed cycles at 10 Hz, -20 to 40 degC; case temperature",
        "Kollmeyer, Vidal, Naguib, Skells 2020, doi:10.17632/cp3473x7xv.3",
        "CC BY 4.0",
        how="Open the DOI, download the archive and unpack it. Each CSV is an export of Digatron's, which every "
        "command reads as it is.",
        published=r"(n?\d+degC)/(\d+_\w+)\.csv$",
    ),
    DataSet(
        PANASONIC,
        "Panasonic NCR18650PF, 2.9 Ah, NCA/graphite",
        "C/20, 1C, pulses (HPPC), US06, HWFET, LA92 and mixed cycles at 10 Hz; case temperature",
        "Kollmeyer 2018, doi:10.17632/wykht8y7tg.1",
        "CC BY 4.0",
        how="Open the DOI, download the archive and unpack it. Each .mat file holds a structure `meas`, "
        "which every command reads as it is; those of pulses (HPPC) lack the discharges between these, and are read a "
        "part at a time (--from-s, --to-s). Its spectra hold ActFreq (Hz), Zreal1 and Zimg1 (mOhm, which they do not "
        "say) and AhAccu (Ah, negative on discharge): write these as frequency_hz,z_real_mohm,z_imag_mohm and, with "
        "its sign turned, discharged_ah, beside the chamber's temperature_degc.",
        published=r"[ _](n?\d+degC_\w+)_Pan18650PF\.mat$"
        r"|(-?\d+degC)/Charges and Pauses/(\d\d-\d\d-\d\d_\d\d\.\d\d) \d+_(Charge\w+)\.mat$",
    ),
    DataSet(
        M50T,
        "LG INR21700-M50T, 4.85 Ah, NMC811/graphite-SiOx, 23 degC, cell W8 when fresh",
        "C/20, pulses (HPPC), UDDS from SOC 0.7816 at 1 Hz",
        "Pozzato, Allam, Onori 2022, Data in Brief, doi:10.1016/j.dib.2022.107995",
        "CC BY 4.0",
        how="Open the DOI and follow its data link. The diagnostic tests come as .mat or Excel files with "
        "time, current and voltage: name their columns (--column), or write these as a CSV with the columns "
        "time_s,current_a,voltage_v in seconds, amperes and volts, and check the sign of the current (--sign).",
    ),
)


def catalogue_lines() -> tuple[str, ...]:
    """The catalogue as lines of text, with where each set is on this machine or how to get it."""
    lines: list[str] = []
    for one in SETS:
        folder = _folder(one.name)
        if folder is not None:
            place = f"on this machine: {folder}"
        elif one.files:
            place = f"not here yet: aesi data get {one.name}"
        else:
            place = (
                f"not here; by hand: {one.how} Put the files into {_own_folder(one.name)}, or into a folder "
                f"{one.name} of the one that {FOLDER_VARIABLE} names."
            )
        lines += [
            f"{one.name}: {one.cell}",
            f"  {one.tests}",
            f"  {one.source} ({one.licence})",
            f"  {place}",
        ]
    return tuple(lines)


def find_set(name: str) -> DataSet:
    """A data set by name. Raises DataError for an unknown one, with the nearest."""
    for one in SETS:
        if one.name == name:
            return one
    names = [one.name for one in SETS]
    raise DataError(f"There is no data set {name!r}{did_you_mean(name, names)} Known: {', '.join(names)}.")


def get(name: str, out: Path | None = None) -> Path:
    """The folder of a data set: a copy on this machine, or else the files fetched, checked and converted.

    out : a folder to put the files into; without it, a copy is used in place, or the files are fetched into the cache.
    Raises DataError where the set is unknown, cannot be fetched by a program, or there is no network.
    """
    one = find_set(name)
    here = _folder(name)
    if here is not None:
        return here if out is None else _copy(here, out)
    if not one.files:
        raise DataError(
            f"{name} cannot be fetched by a program. {one.how} Source: {one.source}.{_own_folder_clause(name)}"
        )
    folder = _own_folder(name) if out is None else out
    try:
        for remote in one.files:
            fetch(remote, folder)
    except DataAway as error:
        raise DataAway(f"{error}{_own_folder_clause(name)}") from None
    return folder


def _own_folder_clause(name: str) -> str:
    """A sentence, with a blank before it, that the user's own folder lacks files of a set; '' where none is named."""
    own = os.environ.get(FOLDER_VARIABLE)
    if not own:
        return ""
    if not Path(own).expanduser().is_dir():
        return f" {FOLDER_VARIABLE} names {own}, which is no folder."
    files = ", ".join(remote.name for remote in find_set(name).files) or "files in it"
    return f" {FOLDER_VARIABLE} names {own}, which has no folder {name} with {files}."


def locate(name: str, file: str) -> Path:
    """The path of a file of a data set, by its name with or without suffix; fetched where it is not on this machine.

    In a set whose archive was unpacked, `file` may also be the name of a record: `n10degC_cycle_2`,
    `n20degC_611_mixed3`.

    Raises DataError where there is no such file, with the names of those there are, or where the set cannot be fetched.
    """
    folder = get(name)
    if Path(file).name != file:
        raise DataError(f"{file!r} is not the name of a file of {name}; give the name alone.")
    for suffix in SUFFIXES:
        path = folder / f"{file}{suffix}"
        if path.is_file():
            return path
    one = find_set(name)
    published = {one.record_of(path.relative_to(folder)): path for path in sorted(folder.rglob("*"))}
    if file in published:
        return published[file]
    files = [path.name for path in folder.iterdir() if path.is_file()]
    there = ", ".join(sorted([*files, *(record for record in published if record is not None)]))
    raise DataError(f"{name} has no file {file!r} in {folder}; there are: {there}.")


def _own_folder(name: str) -> Path:
    return cache_folder() / "measured" / name


def _folder(name: str) -> Path | None:
    """The first folder on this machine that holds the set."""
    own = os.environ.get(FOLDER_VARIABLE)
    given = [Path(own).expanduser()] if own else []
    here = Path.cwd()
    shared = [above / SHARED for above in (here, *here.parents)]
    copies = [folder / below / name for folder in (*given, *shared) for below in ("", "measured")]
    for place in (*copies, _own_folder(name)):
        if place.is_dir() and _complete(name, place):
            return place
    return None


def _complete(name: str, folder: Path) -> bool:
    """True where the folder has all files that `get` would fetch, or any file where it fetches none."""
    wanted = [remote.name for remote in find_set(name).files]
    if wanted:
        return all((folder / file).is_file() for file in wanted)
    return any(path.is_file() for path in folder.rglob("*"))


def _copy(source: Path, out: Path) -> Path:
    if source.resolve() in out.resolve().parents:
        raise DataError(
            f"{out} lies in {source}, from where the set is copied, and its own files would be lost; name a folder "
            "beside it."
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
        if out.samefile(source):
            return out
        for path in [path for path in source.rglob("*") if path.is_file()]:
            copy = out / path.relative_to(source)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, copy)
    except OSError as error:
        raise DataError(not_written(out, error)) from None
    return out

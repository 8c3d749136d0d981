"""Cell files of published parameter sets that PyBaMM ships: an LFP cell with a flat potential, and an NCA power cell.

    python -m aesi.data.laboratory.published FOLDER

writes `lfp_prada2013.bpx.json` and `nca_kim2011.bpx.json`. PyBaMM is under the BSD 3-Clause licence; the figures are
those of the articles named in each file. What BPX holds in another form is worked out here from PyBaMM's own
functions: rate constants j0 = F k sqrt(c_e/c_e0 x (1 - x)), areas 3 eps/r, transport efficiencies eps**b,
effective conductivities of the solid, stoichiometries at the limits of voltage, and activation energies over 15 K
around the reference.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K, SECONDS_PER_HOUR
from aesi.data.laboratory.simulator import evaluated_at

REFERENCE_K = 298.15
"""The temperature of the published parameters."""
CHARGE_AH_MOL = FARADAY_C_MOL / SECONDS_PER_HOUR
COLDER_K, WARMER_K = 290.65, 305.65
"""Temperatures, 7.5 K below and above the reference, between which an activation energy is computed."""


@dataclass(frozen=True)
class PublishedSet:
    """A PyBaMM parameter set, and the data of the cell that it lacks.

    pairs : number of electrode pairs that multiplies the set's cell.  cell : fields of BPX's section `Cell`.
    negative_ocp, positive_ocp : V, expressions in the stoichiometry x.  conductivity : S/m in x, mol/m3.
    """

    file: str
    name: str
    title: str
    description: str
    references: str
    pairs: int
    cell: Mapping[str, float]
    negative_ocp: str
    positive_ocp: str
    conductivity: str
    diffusivity: str | float


LFP = PublishedSet(
    file="lfp_prada2013.bpx.json",
    name="Prada2013",
    title="A123 26650 2.3 Ah LFP|graphite, Prada 2013",
    description=(
        "The PyBaMM parameter set Prada2013 (BSD 3-Clause) as BPX: graphite potential of Chen et al. 2020 and LFP "
        "potential of Afshar et al. 2017 (arXiv:1709.03970), as there. Density from 76 g and the size of a 26650; "
        "specific heat from the 67.2 J/K of Lin et al. 2014 (doi:10.1016/j.jpowsour.2014.01.097)."
    ),
    references="Prada et al., J. Electrochem. Soc. 160 (2013) A616, doi:10.1149/2.053304jes",
    pairs=1,
    cell={
        "Density [kg.m-3]": 2202.0,
        "Specific heat capacity [J.K-1.kg-1]": 884.0,
        "Volume [m3]": 3.451e-5,
        "External surface area [m2]": 6.371e-3,
    },
    negative_ocp=(
        "1.9793 * exp(-39.3631 * x) + 0.2482 - 0.0909 * tanh(29.8538 * (x - 0.1234)) "
        "- 0.04478 * tanh(14.9159 * (x - 0.2769)) - 0.0205 * tanh(30.4444 * (x - 0.6103))"
    ),
    positive_ocp="3.4077 - 0.020269 * x + 0.5 * exp(-150 * x) - 0.9 * exp(-30 * (1 - x))",
    conductivity=(
        "1000 * (4.1253e-4 + 5.007 * (x / 1e6) - 4721.2 * (x / 1e6) ** 2 + 1.5094e6 * (x / 1e6) ** 3 "
        "- 1.6018e8 * (x / 1e6) ** 4)"
    ),
    diffusivity=2e-10,
)

NCA = PublishedSet(
    file="nca_kim2011.bpx.json",
    name="NCA_Kim2011",
    title="22 Ah NCA|graphite pouch cell for power, Kim 2011",
    description=(
        "The PyBaMM parameter set NCA_Kim2011 (BSD 3-Clause) as BPX, 46 electrode pairs of it: the "
        "plug-in hybrid cell of the article. Electrolyte at 298.15 K with one activation energy each, of its functions "
        "at 1.2 mol/l; volume of the pairs, external surface of the article's 20 x 14 cm, heat capacity as there."
    ),
    references="Kim et al., J. Electrochem. Soc. 158 (2011) A955, doi:10.1149/1.3597614",
    pairs=46,
    cell={
        "Density [kg.m-3]": 2680.0,
        "Specific heat capacity [J.K-1.kg-1]": 700.0,
        "Volume [m3]": 2.125e-4,
        "External surface area [m2]": 6.1e-2,
    },
    negative_ocp=(
        "0.124 + 1.5 * exp(-70 * x) - 0.0351 * tanh((x - 0.286) / 0.083) - 0.0045 * tanh((x - 0.9) / 0.119) "
        "- 0.035 * tanh((x - 0.99) / 0.05) - 0.0147 * tanh((x - 0.5) / 0.034) - 0.102 * tanh((x - 0.194) / 0.142) "
        "- 0.022 * tanh((x - 0.98) / 0.0164) - 0.011 * tanh((x - 0.124) / 0.0226) "
        "+ 0.0155 * tanh((x - 0.105) / 0.029)"
    ),
    positive_ocp=(
        "1.638 * x ** 10 - 2.222 * x ** 9 + 15.056 * x ** 8 - 23.488 * x ** 7 + 81.246 * x ** 6 - 344.566 * x ** 5 "
        "+ 621.3475 * x ** 4 - 554.774 * x ** 3 + 264.427 * x ** 2 - 66.3691 * x + 11.8058 "
        "- 0.61386 * exp(5.8201 * x ** 136.4)"
    ),
    conductivity="0.237371 * (x / 1000) ** 3 - 1.295927 * (x / 1000) ** 2 + 1.949133 * (x / 1000)",
    diffusivity="3.85374e-11 * (x / 1000) ** 2 - 1.891636e-10 * (x / 1000) + 2.814305e-10",
)

SETS = (LFP, NCA)


def bpx_of(published: PublishedSet) -> dict[str, Any]:
    """The content of the BPX file of a set."""
    import pybamm

    values = pybamm.ParameterValues(published.name)
    values.update({"Ambient temperature [K]": REFERENCE_K, "Initial temperature [K]": REFERENCE_K})
    model = pybamm.LithiumIonParameters()
    x0, x100, y100, y0 = pybamm.lithium_ion.get_min_max_stoichiometries(values, param=model)
    area = values["Electrode height [m]"] * values["Electrode width [m]"]
    negative = _electrode(values, "Negative", published.negative_ocp, float(x0), float(x100))
    positive = _electrode(values, "Positive", published.positive_ocp, float(y100), float(y0))
    per_area = (
        negative["Thickness [m]"]
        * values["Negative electrode active material volume fraction"]
        * negative["Maximum concentration [mol.m-3]"]
        * (negative["Maximum stoichiometry"] - negative["Minimum stoichiometry"])
    )
    return {
        "Header": {
            "BPX": "1.1.0",
            "Title": published.title,
            "Model": "DFN",
            "Description": published.description,
            "References": published.references,
        },
        "Parameterisation": {
            "Cell": {
                "Reference temperature [K]": REFERENCE_K,
                "Lower voltage cut-off [V]": float(values["Lower voltage cut-off [V]"]),
                "Upper voltage cut-off [V]": float(values["Upper voltage cut-off [V]"]),
                "Nominal cell capacity [A.h]": _digits(published.pairs * area * per_area * CHARGE_AH_MOL),
                "Electrode area [m2]": _digits(area),
                "Number of electrode pairs connected in parallel to make a cell": published.pairs,
                **published.cell,
            },
            "Electrolyte": _electrolyte(values, published),
            "Negative electrode": negative,
            "Positive electrode": positive,
            "Separator": {
                "Thickness [m]": values["Separator thickness [m]"],
                "Porosity": values["Separator porosity"],
                "Transport efficiency": _efficiency(values, "Separator"),
            },
        },
        "State": {
            "Initial conditions": {
                "Initial state-of-charge": 1.0,
                "Initial temperature [K]": REFERENCE_K,
                "Initial electrolyte concentration [mol.m-3]": values[
                    "Initial concentration in electrolyte [mol.m-3]"
                ],
            },
            "Thermal environment": {
                "Ambient temperature [K]": REFERENCE_K,
                "Heat transfer coefficient [W.m-2.K-1]": 10.0,
            },
        },
    }


def _electrode(values: Any, side: str, ocp: str, least: float, most: float) -> dict[str, Any]:
    full = float(values[f"Maximum concentration in {side.lower()} electrode [mol.m-3]"])
    salt = float(values["Initial concentration in electrolyte [mol.m-3]"])
    radius = float(values[f"{side} particle radius [m]"])

    def exchange(kelvin: float) -> float:
        name = f"{side} electrode exchange-current density [A.m-2]"
        return evaluated_at(values, name, salt, 0.5 * full, full, kelvin)

    def diffusivity(kelvin: float) -> float:
        return evaluated_at(values, f"{side} particle diffusivity [m2.s-1]", 0.5, kelvin)

    return {
        "Particle radius [m]": radius,
        "Thickness [m]": values[f"{side} electrode thickness [m]"],
        "Diffusivity [m2.s-1]": _digits(diffusivity(REFERENCE_K)),
        "OCP [V]": ocp,
        "Entropic change coefficient [V.K-1]": 0.0,
        "Conductivity [S.m-1]": _effective_conductivity(values, side),
        "Surface area per unit volume [m-1]": _digits(
            3 * values[f"{side} electrode active material volume fraction"] / radius
        ),
        "Porosity": values[f"{side} electrode porosity"],
        "Transport efficiency": _efficiency(values, f"{side} electrode"),
        "Reaction rate constant [mol.m-2.s-1]": _digits(exchange(REFERENCE_K) / (0.5 * FARADAY_C_MOL)),
        "Minimum stoichiometry": _digits(least),
        "Maximum stoichiometry": _digits(most),
        "Maximum concentration [mol.m-3]": full,
        "Diffusivity activation energy [J.mol-1]": _activation(diffusivity),
        "Reaction rate constant activation energy [J.mol-1]": _activation(exchange),
    }


def _electrolyte(values: Any, published: PublishedSet) -> dict[str, Any]:
    salt = float(values["Initial concentration in electrolyte [mol.m-3]"])

    def of(name: str) -> float:
        return _activation(lambda kelvin: evaluated_at(values, name, salt, kelvin))

    return {
        "Cation transference number": values["Cation transference number"],
        "Conductivity [S.m-1]": published.conductivity,
        "Diffusivity [m2.s-1]": published.diffusivity,
        "Conductivity activation energy [J.mol-1]": of("Electrolyte conductivity [S.m-1]"),
        "Diffusivity activation energy [J.mol-1]": of("Electrolyte diffusivity [m2.s-1]"),
    }


def _efficiency(values: Any, part: str) -> float:
    exponent = values[f"{part} Bruggeman coefficient (electrolyte)"]
    return _digits(values[f"{part} porosity"] ** exponent)


def _effective_conductivity(values: Any, side: str) -> float:
    """Effective conductivity of an electrode's solid, S/m, by its volume fraction: BPX applies no exponent to it."""
    solid = 1 - values[f"{side} electrode porosity"]
    exponent = values[f"{side} electrode Bruggeman coefficient (electrode)"]
    return _digits(values[f"{side} electrode conductivity [S.m-1]"] * solid**exponent)


def _activation(of_kelvin: Any) -> float:
    """Activation energy of a quantity, J/mol, between the two temperatures."""
    ratio = np.log(of_kelvin(WARMER_K) / of_kelvin(COLDER_K))
    return round(float(GAS_CONSTANT_J_MOL_K * ratio / (1 / COLDER_K - 1 / WARMER_K)), 1)


def _digits(value: float) -> float:
    return float(f"{value:.9g}")


def write(folder: Path) -> list[Path]:
    """Write the files of all sets; returns their paths."""
    paths = []
    for published in SETS:
        path = folder / published.file
        path.write_text(json.dumps(bpx_of(published), indent=2) + "\n", encoding="utf-8")
        paths.append(path)
    return paths


if __name__ == "__main__":
    for written in write(Path(sys.argv[1])):
        print(written)

"""The declared open-circuit potentials are off by smooth functions of stoichiometry.

    U_i(x) = U_i,declared(x) + sum_k a_ik T_k(2 s - 1),  k = 1, 2, 3
    s = (x - x_min) / (x_max - x_min), T_k Chebyshev polynomials, i negative or positive

V = U_p - U_n, so a correction of the negative electrode lowers the voltage.

Leaves out features sharper than a third of the stoichiometry range, and a shift constant in x
(voltage_sensor_offset). Holds within the declared stoichiometry limits; polynomials go on beyond them.

Source: Chebyshev series; sizes from half-cell to half-cell scatter, Chen et al., J. Electrochem. Soc. 167
(2020) 080534, doi:10.1149/1945-7111/ab9050.
"""

from dataclasses import replace

from numpy.polynomial import Chebyshev, Polynomial

from aesi.parameters import Parameter
from aesi.physics.cell import Electrode
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel
from aesi.physics.relations import PowerSeries, Sum


def _coefficient(k: int, electrode: str, default: float) -> Parameter:
    return Parameter(
        default,
        "V",
        bounds=(-0.05, 0.05),
        neutral=0.0,
        source="scatter of half-cell measurements, at most 50 mV",
        description=f"coefficient of T_{k} over the {electrode} electrode's range",
    )


PARAMETERS = {
    "positive_1_v": _coefficient(1, "positive", 0.005),
    "positive_2_v": _coefficient(2, "positive", 0.0),
    "positive_3_v": _coefficient(3, "positive", 0.0),
    "negative_1_v": _coefficient(1, "negative", 0.0),
    "negative_2_v": _coefficient(2, "negative", 0.0),
    "negative_3_v": _coefficient(3, "negative", 0.0),
}


def reshape(model: EspmModel, **volts: float) -> EspmModel:
    """The model with corrected open-circuit potentials; volts : the six coefficients (V)."""
    cell = model.cell
    return model.with_cell(
        negative=_corrected(cell.negative, *(volts[f"negative_{k}_v"] for k in (1, 2, 3))),
        positive=_corrected(cell.positive, *(volts[f"positive_{k}_v"] for k in (1, 2, 3))),
    )


def _corrected(electrode: Electrode, *coefficients: float) -> Electrode:
    if not any(coefficients):
        return electrode
    series = Chebyshev([0.0, *coefficients], domain=[electrode.theta_min, electrode.theta_max])
    powers = series.convert(kind=Polynomial, domain=[-1, 1], window=[-1, 1])
    return replace(electrode, ocp=Sum(electrode.ocp, PowerSeries(tuple(map(float, powers.coef)))))


EFFECT = Effect("ocp_shape", "parameter", __doc__, PARAMETERS, on_model=reshape)

"""Posterior samples of a calibration, drawn by emcee, to check the intervals of the linearised fit.

The voltage is nearly linear in the potentials' knots, the cycler's zero, and the states of charge, the active material
and the silicon of each record. These are integrated out in closed form, linearised once, at the fit, so that the
walkers move in the global parameters alone:

    log p(z) = -1/2 (r' r - b' H^-1 b) - 1/2 log det H,      H = J_l' J_l + 1,   b = J_l' r

r are the weighted residuals at z with the linear parameters at their fitted values, J_l their slopes at the fit,
whatever z is, so that det H is a constant.
Losses between dated records are not linear: they are |e|, whose slope over its coordinate is 0.07, 0.63 and 0.91 at -2,
0 and 2 (`Ageing.slopes`). Their intervals use the slope at the fit.
Foreman-Mackey et al., PASP 125 (2013) 306, doi:10.1086/670067.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from aesi.calibration.result import NINETY_FIVE, Calibration, Interval, information_weights
from aesi.errors import InputError
from aesi.numerics.typing import Array

BURNT = 0.5
"""Share of the first steps that is discarded (burn-in)."""
FEWEST_STEPS = 4
"""Fewest steps of each walker; half of them are burnt."""
SPREAD = 0.5
"""Standard deviation of the walkers' starts about the fit, in those of the linearised posterior."""


@dataclass(frozen=True, eq=False)
class PosteriorSamples:
    """Samples of the posterior of the global parameters, and what they say of the linear intervals.

    samples : (n, parameters) working coordinates.  intervals : 95 %, from them.  width_ratios : name -> width over that
    of the linear interval.  autocorrelation : steps, nan where the chain is too short.
    linearised_losses : whether losses between dated records were among what is taken to be linear.
    """

    samples: Array
    intervals: dict[str, Interval]
    width_ratios: dict[str, float]
    autocorrelation: float
    linearised_losses: bool = False

    @property
    def sentence(self) -> str:
        """How much wider or narrower the linear intervals should have been, for a reader."""
        widths = np.array(list(self.width_ratios.values()))
        worst = max(self.width_ratios, key=lambda name: abs(np.log(self.width_ratios[name])))
        chain = (
            "the chain is too short to say how far its samples repeat one another; draw more"
            if not np.isfinite(self.autocorrelation)
            else f"a sample repeats itself over {self.autocorrelation:.0f} steps"
        )
        losses = (
            "; losses between dated records are taken to be linear, which they are not"
            if self.linearised_losses
            else ""
        )
        return (
            f"posterior of {len(self.samples)} samples: intervals {np.median(widths):.2f} times as wide as the linear "
            f"ones in the median, most off {worst} ({self.width_ratios[worst]:.2f} times); {chain}{losses}."
        )


def check_posterior(steps: int) -> None:
    """Raises InputError where emcee is not installed or the steps are too few; 0 draws nothing."""
    if not steps:
        return
    if find_spec("emcee") is None:
        raise InputError("--posterior needs emcee: pip install emcee.")
    if steps < FEWEST_STEPS:
        raise InputError(
            f"--posterior {steps}: at least {FEWEST_STEPS} samples of each walker, some hundreds to be of use."
        )


def sample_posterior(found: Calibration, steps: int, seed: int = 0) -> PosteriorSamples:
    """Draw from the posterior of the global parameters, `steps` of each walker.

    Raises what `check_posterior` raises.
    """
    check_posterior(steps)
    import emcee

    model, n = found.model, len(found.model.free)
    rng = np.random.default_rng(seed)
    walkers = 2 * n + 2
    root = np.linalg.cholesky(found.covariance[:n, :n])
    start = found.x[:n] + SPREAD * rng.standard_normal((walkers, n)) @ root.T
    start = np.clip(start, model.low[:n] + 1e-6, model.high[:n] - 1e-6)
    sampler = emcee.EnsembleSampler(walkers, n, _log_probability(found))
    sampler.random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(start, steps)
    kept = sampler.get_chain(discard=int(BURNT * steps), flat=True)
    with np.errstate(invalid="ignore"):  # of walkers that never moved, whose time is NaN
        autocorrelation = float(np.mean(emcee.autocorr.integrated_time(sampler.get_chain(), quiet=True)))
    if steps < 50.0 * autocorrelation:
        autocorrelation = np.nan
    return _summary(found, kept, autocorrelation)


def _log_probability(found: Calibration) -> Callable[[Array], float]:
    """The logarithm of the posterior as a function of the global parameters, (n,), up to a constant; -inf out of their
    bounds. All others are integrated out, linearised at the fit."""
    model, n = found.model, len(found.model.free)
    weights = information_weights(model, found.x)
    linear = weights[:, None] * model.jacobian(found.x)[:, n:]
    hessian = linear.T @ linear
    inverse, (_, log_det) = np.linalg.inv(hessian), np.linalg.slogdet(hessian)

    def log_probability(z: Array) -> float:
        if ((z < model.low[:n]) | (z > model.high[:n])).any():
            return -np.inf
        x = found.x.copy()
        x[:n] = z
        r = weights * model.residual(x)
        b = linear.T @ r
        value = -0.5 * float(r @ r - b @ inverse @ b) - 0.5 * float(log_det)
        return value if np.isfinite(value) else -np.inf

    return log_probability


def _summary(found: Calibration, samples: Array, autocorrelation: float) -> PosteriorSamples:
    out, width_ratios = {}, {}
    for j, free in enumerate(found.model.free):
        low, middle, high = np.quantile(samples[:, j], [0.025, 0.5, 0.975])
        out[free.name] = Interval(
            free.value(float(middle)), free.value(float(low)), free.value(float(high)), free.unit, free.source
        )
        width_ratios[free.name] = float((high - low) / (2.0 * NINETY_FIVE * np.sqrt(found.covariance[j, j])))
    return PosteriorSamples(samples, out, width_ratios, autocorrelation, found.model.ageing.dated)

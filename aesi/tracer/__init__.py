"""Which effect a declared model lacks: competing hypotheses are fitted to measured data, selected and judged.

From `discover` to the verdict, in the order of the calls. A folder imports only those that follow it in this list:
report, decide, search, likelihood, case.

    case/records           measurements with their noise and initial state, thinned     -> PreparedRecord
    case/trust             how far the values in the cell file are believed
    case/problem           records, cell, and the parameters that hypotheses may move   -> InverseProblem
    decide/model_choice    which model of the cell: single particle or porous electrode
    decide/other_hold      records whose current runs otherwise between their rows, which are searched again
    decide/evidence        searches at several trusts, verdict, and the written model   -> Evidence
      (decide/good_records   the same, where good records are given for comparison)
      (decide/shared_effects effects that the good records show too are no difference)
    search/forward         one search: effects grown, fitted, admitted, one by one      -> Path
    search/growths         which effects are grown on which hypotheses
    likelihood/growth      adds one effect to a hypothesis, the rest to first order     -> Grown
    likelihood/fit         fits a hypothesis with the whole model                       -> FittedHypothesis
    likelihood/gaussian    log predictive density of left-out data for either           -> PredictiveScore
    likelihood/surrogates  the gain by chance, which an effect has to exceed
    decide/verdict         found, none or unknown, from a Path                          -> Verdict
    decide/model_to_write  the model that is written where the verdict is unknown       -> ModelState
    report/                the results as they are reported                             -> Discovery

Words that mean one thing throughout:

    file             the cell file, where not said otherwise
    hypothesis       the declared model with zero or more added effects, listed by id
    own parameter    a parameter of the declared model: a value of the cell file, or the initial state of a record.
                     Every hypothesis moves it within a prior
    trust            how far the declared parameters are believed: widths of the own priors, and size of the model error
    good             of a record: known to lack nothing. The other records are searched for what differs from it
                     (trust `beside`)
    competing        of an effect: a hypothesis may name it.  addable : competing, not yet in the hypothesis, and the
                     records can decide on it
    grown            of a hypothesis: one effect more than its parent, fitted with the parent's parameters to first
                     order.  fitted : all parameters with the whole model.  admitted : believed, after a step
    owner            id of the effect that a parameter belongs to, with an ending where good records share it
                     (`SHARED_SUFFIX`); one of `RECORD_OWNERS` for a parameter of a single record
    x                coordinate of a parameter: distance from the centre of its prior, in prior standard deviations
    size             standard deviation of the model error, V.  lasting, fast : its parts over and within seconds
    block            rows that are left out together.  fold : blocks left out at once.  partition : folds of one kind
    to say           a hypothesis says n nats of data: n is the log predictive density of these data while they are left
                     out, `score.total`.  gain : difference of two of these
    to leave         a model leaves v of a record: v is the RMS of its residual there, V
    beyond noise     root of (mean square of the residual less that of the white noise), V
"""

from aesi.tracer.discovery import Discovery, discover

__all__ = ["Discovery", "discover"]

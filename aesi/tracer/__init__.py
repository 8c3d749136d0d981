"""The loop closed on measured data: competing hypotheses, selection, verdict.

From `discover` to the verdict, in the order of the calls (each folder imports only those named after it here: report,
decide, search, likelihood, case):

    case/records           measurements with their noise and initial state, thinned     -> PreparedRecord
    case/trust             how far the cell's file is believed
    case/problem           these, the cell, and what hypotheses may move                -> InverseProblem
    decide/model_choice    single particle or porous electrode: with each that is tried
    decide/evidence        searches at several trusts, judged, and the model written    -> Evidence
      (decide/beside         the same beside records that are known to be good)
      (decide/shared         what these have too, which is no difference)
    search/forward         one search: effects grown, fitted, admitted, one by one      -> Path
    search/grown           which effects are grown on which hypotheses
    likelihood/growth      one effect more on a hypothesis, the rest to first order     -> Grown
    likelihood/fit         a hypothesis with the whole model                            -> FittedHypothesis
    likelihood/gaussian    what either says of data that it has not seen                -> PredictiveScore
    likelihood/surrogates  what chance says, which an effect has to exceed
    decide/verdict         found, none or unknown, of a Path                            -> Verdict
    decide/written         the model that is written where it is unknown                -> ModelState
    report/                what is told of it                                           -> Discovery

Words that mean one thing throughout:

    hypothesis       the declared model and the effects, by id, that it has beside that
    own parameter    of the declared model, moved by every hypothesis within a prior: what the file declares, and the
                     initial state of each record
    trust            how far the declared parameters are believed: widths of the own priors, and size of the model error
    good             of a record: nothing is sought in it, but in others what they have beside it (trust `beside`)
    competing        of an effect that may be named; addable : to a hypothesis that has not named it
    owner            id of the effect that a parameter belongs to, with an ending where good records share it
                     (`OF_ALL_RECORDS`); a word of its own for what belongs to a record (`OF_ONE_RECORD`)
    x                coordinate of a parameter: from the centre of its prior, in standard deviations of it
    size             standard deviation of the model error, V
    block            rows that are left out together.  fold : blocks left out at once.  partition : folds of one kind
    to say           log predictive density of what was left out, nats: `score.total`; a gain is a difference of two
    beyond noise     root of a mean square less that of the white noise, V
"""

from aesi.tracer.discovery import Discovery, discover

__all__ = ["Discovery", "discover"]

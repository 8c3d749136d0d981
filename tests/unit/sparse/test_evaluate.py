import re
from dataclasses import replace

import numpy as np
import pytest
from sparse_records import make_record

from aesi.errors import DataError, InputError
from aesi.numerics.metrics import mser
from aesi.records import Failed, Split
from aesi.sparse import Candidate, FitnessWeights, Genome, Options, Problem, evaluate, fitness
from aesi.sparse.baselines.sindy_c import evaluate_sindy_c
from aesi.sparse.ranking import svd_ranking, svd_scores
from aesi.sparse.search.fold_models import fold_models
from aesi.sparse.search.judge import Fit, fold_runs
from aesi.sparse.stridge import STRidge
from aesi.sparse.terms.library import Library, Term


def whole(problem, lambda1=1e-3, lambda2=1e-3, **others):
    return Genome.whole(problem.library, lambda1, lambda2, **{"tau": 0.5, "p_c": 2, "d": 2, **others})


def test_a_known_error_is_recovered(problem, split):
    candidate = evaluate(problem, whole(problem, 1e-2, 2e-2, feedback=False))
    assert isinstance(candidate, Candidate)
    for model in (candidate.bagging, candidate.stability):
        assert {"T1(I)", "T1(I)*T1(soc)"} <= set(model.terms)
        # Noise of 0.5 mV on an error of 5.5 mV RMS leaves 0.8 %; outside its range the model is clipped.
        run = model.free_run(split.test[0])
        assert mser(split.test[0].error_v[~run.outside], run.error_v[~run.outside]) > 98.5
    assert candidate.loss_oob < 0.02
    assert candidate.loss_sparse == len(candidate.bagging.terms)
    assert candidate.pearson_train > 0.98


def test_a_candidate_evaluated_twice_is_the_same(problem):
    one, other = (evaluate(problem, whole(problem)) for _ in range(2))
    assert one.losses == other.losses
    np.testing.assert_array_equal(one.bagging.coefficients, other.bagging.coefficients)


def test_feedback_is_recovered(feedback_problem):
    candidate = evaluate(feedback_problem, whole(feedback_problem, 1e-3, 5e-3))
    series = make_record(seed=9, feedback=0.8)
    assert mser(series.error_v, candidate.bagging.free_run(series).error_v) > 95
    assert candidate.bagging.has_feedback
    shifted = replace(series, error_v=series.error_v + 1e-6)
    gain = (candidate.bagging.one_step(shifted) - candidate.bagging.one_step(series))[1:] / 1e-6
    assert np.median(gain) == pytest.approx(0.8, abs=0.1)


def test_a_model_without_feedback_learns_a_memory(feedback_problem):
    candidate = evaluate(feedback_problem, whole(feedback_problem, feedback=False))
    assert not candidate.bagging.has_feedback
    assert 0.5 < candidate.bagging.memory < 1


def test_free_runs_of_the_search_equal_those_of_the_model(feedback_problem):
    # The fold's fit, run by the vectorised loop over a piece, against the model's own loop.
    problem = feedback_problem
    genome = whole(problem, 1e-3, 1e-3)
    candidate = evaluate(problem, genome)
    active = np.flatnonzero(genome.active(problem.library))
    names = [problem.library.names[j] for j in active]
    table = candidate.bagging.coefficient_table()
    coefficients = np.array([table.get(name, 0.0) for name in names])
    fits = np.tile(coefficients, (len(problem.folds), 1))
    runs = fold_runs(problem, active, fits, fits, [coefficients] * 2)
    first = problem.split.train[0].take(slice(0, problem.folds[0][1] + 1))
    model = replace(candidate.bagging, memory=0.0)
    expected = problem.scaling.error_to_scaled(model.free_run(first).error_v[1:])
    np.testing.assert_allclose(runs.free_run[: len(expected), Fit.FOLD], expected, atol=1e-10)


def test_a_candidate_is_judged_as_the_model_that_is_left_after_thresholding(split):
    options = Options(p_c=1, d=1, mixed=False, special=False, resamples=20, block=60, fade=True)
    problem = Problem.build(split, options)
    fed, plain = (
        evaluate(problem, whole(problem, 1.0, 0.1, p_c=1, d=1, feedback=gene)) for gene in (True, False)
    )
    assert not fed.bagging.has_feedback
    assert fed.bagging.terms == plain.bagging.terms
    assert fed.bagging.fade.amplitude == pytest.approx(plain.bagging.fade.amplitude)
    assert fed.bagging.memory == pytest.approx(plain.bagging.memory)
    assert fed.valid_losses == pytest.approx(plain.valid_losses)


def test_one_ensemble_may_feed_back_and_the_other_not(feedback_problem):
    problem, genome = feedback_problem, whole(feedback_problem, 1e-3, 5e-3)
    active = np.flatnonzero(genome.active(problem.library))
    candidate = evaluate(problem, genome)
    table = candidate.bagging.coefficient_table()
    feeding = np.array([table.get(problem.library.names[j], 0.0) for j in active])
    plain = np.where(problem.library.feedbacks[active] == 0, feeding, 0.0)
    fits = [np.tile(one, (len(problem.folds), 1)) for one in (feeding, plain)]
    both = fold_runs(problem, active, *fits, [feeding, plain])
    alone = [
        fold_runs(problem, active, one, one, [model] * 2)
        for one, model in zip(fits, (feeding, plain), strict=True)
    ]
    for name in ("one_step", "free_run", "from_unmeasured"):
        for place, runs in enumerate(alone):
            np.testing.assert_allclose(getattr(both, name)[:, place], getattr(runs, name)[:, place])
    assert both.memories == (0.0, alone[1].memories[1])
    assert both.memories[1] > 0.0


def test_a_candidate_that_fits_noise_was_admitted_by_its_correlation_on_rows_that_it_had_seen():
    record = make_record(seed=0, n=400)
    rng = np.random.default_rng(0)
    noise = replace(record, error_v=5e-3 * rng.standard_normal(len(record)))
    problem = Problem.build(Split((noise,), (), ()), Options(p_c=3, d=2, resamples=20, block=50, fade=False))
    candidate = evaluate(problem, whole(problem, 1e-6, 1e-6, feedback=False, p_c=3))
    seen = np.corrcoef(noise.error_v[1:], candidate.bagging.free_run(noise).error_v[1:])[0, 1]
    assert candidate.pearson_train < 0.1 < 0.25 < seen
    single = evaluate_sindy_c(problem, candidate.genome, FitnessWeights())
    assert single.pearson_train == pytest.approx(candidate.pearson_train, abs=0.02)


def test_residuals_are_out_of_fold_and_complete(problem, split):
    candidate = evaluate(problem, whole(problem, 1e-2, 1e-2, feedback=False))
    assert [out_of_fold.record for out_of_fold in candidate.residuals] == ["record", "second"]
    for out_of_fold, record in zip(candidate.residuals, split.train, strict=True):
        assert len(out_of_fold.one_step_v) == len(record) - 1
        # What is left is the noise of 0.5 mV.
        assert np.std(out_of_fold.one_step_v) == pytest.approx(5e-4, rel=0.2)


def test_without_validation_records_aesi_i_was_always_chosen(problem):
    """Its row of losses stayed at minus infinity there; now pieces that were left out in turn decide."""
    assert not problem.split.valid
    tried = (
        evaluate(problem, whole(problem, 1e-3, lambda2, tau=tau, feedback=False))
        for lambda2 in (1e-3, 1e-2, 3e-2)
        for tau in (0.4, 0.7, 0.95)
    )
    candidates = [each for each in tried if isinstance(each, Candidate)]
    assert np.all(np.isfinite([each.valid_losses for each in candidates]))
    assert {each.better.name for each in candidates} == {"AESI I", "AESI II"}
    assert all(
        each.better is (each.bagging, each.stability)[int(np.argmin(each.valid_losses))]
        for each in candidates
    )


def test_long_pieces_are_left_out_for_free_runs_whatever_the_search_judges_on(split):
    options = Options(p_c=1, d=2, mixed=False, resamples=5, block=60)
    long, short = (Problem.build(split, replace(options, fold=fold)) for fold in (250, 40))
    assert len(short.folds) > 3 * len(long.folds)
    both = [list(fold_models(p, evaluate(p, whole(p, p_c=1, feedback=False)))) for p in (long, short)]
    assert [rows for *_, rows in both[0]] == [rows for *_, rows in both[1]]
    for (one, *_), (other, *_) in zip(*both, strict=True):
        np.testing.assert_allclose(one.coefficients, other.coefficients, rtol=1e-8)


def test_left_out_pieces_cover_every_predicted_sample_once(split):
    problem = Problem.build(split, Options(p_c=1, d=2, mixed=False, resamples=5, block=60))
    found = list(fold_models(problem, evaluate(problem, whole(problem, p_c=1, feedback=False))))
    for record in problem.split.train:
        samples = [np.arange(len(record))[rows] for _, each, rows in found if each is record]
        np.testing.assert_array_equal(np.concatenate(samples), np.arange(1, len(record)))


def test_a_model_without_a_piece_is_the_fit_to_the_other_rows(split):
    problem = Problem.build(split, Options(p_c=1, d=2, mixed=False, resamples=5, block=60))
    genome = whole(problem, p_c=1, feedback=False)
    model, record, rows = next(fold_models(problem, evaluate(problem, genome)))
    assert record is problem.split.train[0]
    active = np.flatnonzero(genome.active(problem.library))
    weights = problem.row_weights.copy()
    weights[: rows.stop - 1] = 0.0
    by_hand = STRidge(genome.lambda1, genome.lambda2).fit(problem.theta(active).T, problem.target, weights)
    np.testing.assert_allclose(model.coefficients, by_hand[by_hand != 0], rtol=1e-8)


def test_the_figure_on_validation_is_of_the_validation_records(split):
    both = Split(split.train, (make_record(300, seed=8, name="valid"),), ())
    problem = Problem.build(both, Options(p_c=1, d=2, mixed=False, resamples=10, block=60))
    candidate = evaluate(problem, whole(problem, feedback=False, p_c=1))
    truth = both.valid[0].error_v
    assert candidate.free_run_valid_mser_pct == pytest.approx(
        mser(truth[1:], candidate.bagging.free_run(both.valid[0]).error_v[1:])
    )


def test_test_records_choose_nothing(split):
    options = Options(p_c=1, d=2, mixed=False, resamples=5, block=60)
    other = Split(split.train, split.valid, (make_record(seed=77),))
    one, two = (Problem.build(s, options) for s in (split, other))
    assert evaluate(one, whole(one, p_c=1)).losses == evaluate(two, whole(two, p_c=1)).losses


def test_fitness_weighs_the_three_losses():
    assert fitness((0.2, 0.4, 10), 100, FitnessWeights(0.5, 0.25, 1.0)) == pytest.approx(1 - 0.1 - 0.1 - 0.1)


@pytest.mark.parametrize(
    ("genome", "reason"),
    [
        (lambda p: Genome.of(np.zeros(len(p.library), dtype=bool), 1e-3, 1e-2, 0.5, 2, 2), "no term is left"),
        (lambda p: whole(p, lambda2=1e3), "below lambda2 = 1000 in every resample"),
        (lambda p: whole(p, lambda2=0.05, tau=1.0), "no term reaches an inclusion probability"),
    ],
)
def test_expected_failures_are_values_with_reasons(problem, genome, reason):
    outcome = evaluate(problem, genome(problem))
    assert isinstance(outcome, Failed)
    assert reason in outcome.reason


def test_every_resample_diverging_is_a_reason():
    # What is fed back is held within the trained range, so that only a factor above ten leaves all bounds.
    problem = Problem.build(
        Split((make_record(400),), (), ()), Options(p_c=1, d=1, special=False, resamples=5, block=100)
    )
    only = np.array([name == "T1(e)" for name in problem.library.names])
    exploding = replace(problem, factors=_exploding(problem, only))
    outcome = evaluate(exploding, Genome.of(only, 0.0, 1e-3, 0.5, 1, 1))
    assert outcome == Failed("every resample diverges in free run")


def _exploding(problem, only):
    """Factors of the exact problem e'[k + 1] = 20 e'[k]."""
    m = len(only)
    factor = np.eye(m + 1)
    factor[np.flatnonzero(only)[0], m] = 20.0
    return np.tile(factor, (len(problem.factors), 1, 1))


def with_soc_input(values):
    """A training record whose second input, called soc, has these values."""
    record = make_record(300)
    inputs = record.inputs.copy()
    inputs[:, 1] = values(record)
    return Split((replace(record, inputs=inputs),), (), ())


SMALL = Options(p_c=1, d=2, mixed=False, resamples=5, block=50)


def test_a_constant_input_is_left_out_with_a_note():
    problem = Problem.build(with_soc_input(lambda record: np.full(len(record), 0.5)), SMALL)
    assert problem.library.variables == ("e", "I", "c_e0")
    assert problem.notes == ("soc is constant over the training records; its terms were left out.",)


def test_records_at_rest_alone_were_refused_without_a_word_on_what_to_give():
    record = make_record(300)
    resting = replace(record, inputs=np.ones_like(record.inputs))
    with pytest.raises(DataError, match="train on records with a load"):
        Problem.build(Split((resting,), (), ()), SMALL)


def test_records_of_one_constant_current_lost_it_with_its_terms():
    """Intervals are calibrated over the current: their score ended in the index of a tuple."""
    record = make_record(300)
    held = replace(record, inputs=np.column_stack([np.full(len(record), 2.0), record.inputs[:, 1:]]))
    problem = Problem.build(Split((held,), (held,), ()), SMALL)
    assert problem.library.variables == ("e", "soc", "c_e0")
    for kept in (*problem.split.train, *problem.split.valid):
        np.testing.assert_array_equal(kept.current_a, held.current_a)


def test_a_repeated_input_is_left_out_with_a_note():
    problem = Problem.build(with_soc_input(lambda record: 5 + 3 * record.inputs[:, 0]), SMALL)
    assert "soc repeats I up to scale" in problem.notes[0]
    assert isinstance(evaluate(problem, whole(problem, p_c=1)), Candidate)


def test_an_input_that_repeats_another_upside_down_was_kept():
    problem = Problem.build(with_soc_input(lambda record: 5 - 3 * record.inputs[:, 0]), SMALL)
    assert "soc repeats I up to scale" in problem.notes[0]


def test_a_constant_error_is_refused():
    record = replace(make_record(300), error_v=np.full(300, 0.01))
    with pytest.raises(DataError, match="the voltage error is constant"):
        Problem.build(Split((record,), (), ()), SMALL)


def test_nan_is_refused_with_its_place():
    def broken(record):
        column = record.inputs[:, 1].copy()
        column[17] = np.nan
        return column

    with pytest.raises(DataError, match="soc is not a number in row 18, counted from 1"):
        Problem.build(with_soc_input(broken), SMALL)


@pytest.mark.parametrize(
    ("error_v", "sentence"),
    [
        (
            np.where(np.arange(200) == 150, np.nan, 1e-3),
            "v: error_v is not a number in row 151, counted from 1",
        ),
        (np.zeros(200), "the voltage error is zero over the validation records"),
    ],
)
def test_a_fault_of_a_validation_record_was_told_as_a_divergence_of_every_candidate(error_v, sentence):
    valid = replace(make_record(200), name="v", error_v=error_v)
    with pytest.raises(DataError, match=sentence):
        Problem.build(Split((make_record(300),), (valid,), ()), SMALL)


def test_a_validation_record_of_one_row_divided_by_nothing():
    with pytest.raises(DataError, match="1 samples are too few"):
        Problem.build(Split((make_record(300),), (make_record(300).take(slice(0, 1)),), ()), SMALL)


def test_a_library_larger_than_the_data_is_refused():
    with pytest.raises(DataError, match="needs more than the 99 training samples"):
        Problem.build(Split((make_record(100),), (), ()), Options(p_c=5, d=5))


def test_a_block_as_long_as_the_records_is_refused():
    with pytest.raises(
        DataError, match=r"a bootstrap block of 500 rows .* longest training record \(99 rows\)"
    ):
        Problem.build(Split((make_record(100),), (), ()), Options(p_c=1, d=1, block=500))


def test_no_records_is_refused():
    with pytest.raises(DataError, match="no training records"):
        Problem.build(Split((), (), ()))


def test_unequal_sampling_is_refused():
    slower = replace(make_record(200), dt_s=2.0)
    with pytest.raises(DataError, match="every 2 s, the first record every 1 s"):
        Problem.build(Split((make_record(200), slower), (), ()), SMALL)


def test_a_genome_of_another_library_is_refused(problem):
    with pytest.raises(ValueError, match="does not fit a library"):
        evaluate(problem, Genome("ff", 1e-3, 1e-2, 0.5, 1, 1))


def test_svd_scores_of_orthogonal_features_are_their_squared_sizes():
    # Orthogonal columns are their own singular vectors: score = sigma_j**2 / sum(sigma).
    features = np.asfortranarray(np.array([[3.0, 0.0], [0.0, 1.0], [0.0, 0.0]]))
    np.testing.assert_allclose(svd_scores(features), [9 / 4, 1 / 4])


def test_the_current_that_makes_the_error_is_ranked_first(problem, split):
    model = evaluate(problem, whole(problem, 1e-2, 2e-2, feedback=False)).bagging
    ranking = svd_ranking(model, split.train)
    assert {name for name, _ in ranking} == set(model.terms) - {"1"}
    # cosh(soc) and cos(soc) are close to a constant and cancel: no more than the first place is told apart.
    assert ranking[0][0].endswith("(I)")
    assert [score for _, score in ranking] == sorted((score for _, score in ranking), reverse=True)


def test_a_constant_ranks_nothing(problem, split):
    model = evaluate(problem, whole(problem, 1e-2, 2e-2, feedback=False)).bagging
    constant = replace(
        model, library=Library(model.library.variables, (Term(),)), coefficients=np.array([0.1])
    )
    assert svd_ranking(constant, split.train) == []


def test_a_first_error_that_was_not_measured_ended_the_ranking_of_terms_in_it(feedback_problem):
    model = evaluate(feedback_problem, whole(feedback_problem, 1e-2, 2e-2)).bagging
    assert model.has_feedback
    records = feedback_problem.split.train
    begun = [replace(each, error_v=np.append(np.nan, each.error_v[1:])) for each in records]
    cut = [each.take(slice(1, None)) for each in records]
    assert svd_ranking(model, begun) == svd_ranking(model, cut)


def test_one_lucky_validation_drive_does_not_choose_alone(split):
    # Half of the validation loss is on the left-out pieces, so that a drive that bears a candidate out by chance
    # cannot hide that it errs where training has been.
    valid = make_record(300, seed=8, name="valid")
    options = Options(p_c=1, d=2, mixed=False, resamples=10, block=60)
    pieces, both = (Problem.build(Split(split.train, records, ()), options) for records in ((), (valid,)))
    left_out = evaluate(pieces, whole(pieces, feedback=False, p_c=1)).valid_losses
    found = evaluate(both, whole(both, feedback=False, p_c=1))
    for loss, on_pieces, model in zip(found.valid_losses, left_out, found.ensembles, strict=True):
        free = mser(valid.error_v[1:], model.free_run(valid).error_v[1:])
        assert loss == pytest.approx(0.5 * (on_pieces + 1.0 - free / 100.0), abs=1e-3)


def test_pieces_so_long_that_nothing_is_left_to_fit_are_refused(split):
    longest = max(len(record.error_v) for record in split.train)
    alone = Split(split.train[:1], split.valid, split.test)
    with pytest.raises(DataError, match=r"leave no other training row to fit; lower search\.fold"):
        Problem.build(alone, Options(p_c=1, d=2, mixed=False, resamples=5, block=60, fold=longest))


def test_a_record_too_short_to_be_cut_was_told_to_lower_a_fold_that_nobody_gave():
    alone = Split((make_record(12),), (), ())
    with pytest.raises(
        DataError, match=r"\d+ rows of one training record are too few .* give a longer record"
    ):
        Problem.build(alone, Options(p_c=1, d=1, special=False, mixed=False, resamples=5, feedback=False))


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        ({"resamples": 0}, "resamples = 0 is not a whole number from 1"),
        ({"block": 2.5}, "block = 2.5 is not a whole number from 1"),
        ({"best": 0.0}, "best = 0.0: give the share of resamples"),
        ({"regime": "both"}, "regime = 'both': choose from free_run, one_step"),
        ({"inputs": ("I", "I")}, "inputs = I, I: give each name once"),
    ],
)
def test_options_that_no_search_can_have_are_refused(asked, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        Options(**asked)


def test_an_input_of_a_given_library_that_does_not_vary_is_named():
    flat = with_soc_input(lambda record: np.full(len(record), 0.5))
    library = Library.build(flat.train[0].input_names, p_c=1, d=1)
    with pytest.raises(DataError, match="soc is constant over the training records and has no range"):
        Problem.build(flat, SMALL, library)


def test_more_parts_than_rows_are_refused(split):
    with pytest.raises(DataError, match="fewer rows than the parts"):
        Problem.build(split, Options(p_c=1, d=1, mixed=False, cuts=2000))

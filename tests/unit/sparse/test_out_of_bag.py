import numpy as np

from aesi.sparse import Genome, STRidge
from aesi.sparse.search.out_of_bag import comparable_losses, out_of_bag


def test_who_is_judged_on_an_easy_piece_alone_does_not_win():
    # Two equal members leave 1 a row on the easy piece and 9 on the hard one; each is judged on one of them.
    squares = np.array([[10.0, 0.0, 10.0], [0.0, 90.0, 90.0]])
    rows = np.array([[10.0, 0.0, 10.0], [0.0, 10.0, 10.0]])
    np.testing.assert_allclose(comparable_losses(squares, rows, np.array([10.0, 10.0])), 5.0)


def test_the_better_member_on_the_same_rows_wins_by_what_it_is_better():
    squares = np.array([[10.0, 20.0, 30.0]])
    rows = np.full((1, 3), 10.0)
    np.testing.assert_allclose(comparable_losses(squares, rows, np.array([40.0])), [1.0, 2.0, 3.0])


def test_a_member_that_diverges_is_infinitely_bad_and_spoils_no_other():
    squares = np.array([[10.0, 20.0, np.inf]])
    rows = np.full((1, 3), 10.0)
    np.testing.assert_allclose(comparable_losses(squares, rows, np.array([10.0])), [1.0, 2.0, np.inf])


def test_who_does_well_where_most_fail_is_not_better_than_perfect():
    # Three of four members run away on the second piece; the loss of the one that does not is no less than zero.
    squares = np.array([[10.0, 10.0, 10.0, 10.0], [10.0, 9e4, 9e4, 9e4]])
    rows = np.array([[10.0, 10.0, 10.0, 10.0], [90.0, 10.0, 10.0, 10.0]])
    losses = comparable_losses(squares, rows, np.array([30.0, 90.0]))
    assert 0.0 < losses[0] < losses[1:].min() / 100


def test_a_piece_that_every_resample_holds_is_left_out():
    squares = np.array([[10.0, 20.0], [0.0, 0.0]])
    rows = np.array([[10.0, 10.0], [0.0, 0.0]])
    np.testing.assert_allclose(comparable_losses(squares, rows, np.array([10.0, 5.0])), [1.0, 2.0])


def test_losses_count_rows_as_the_fits_do(problem):
    # On a model without feedback the loss can be written down: weighted errors on the rows not drawn.
    genome = Genome.whole(problem.library, 1e-3, 1e-3, 0.5, 1, 1, feedback=False)
    active = np.flatnonzero(genome.active(problem.library))
    columns = np.append(active, len(problem.library))
    fits = np.stack([STRidge(1e-3, 1e-3).fit_factor(factor[:, columns]) for factor in problem.factors])
    losses = out_of_bag(problem, active, fits, np.arange(len(fits)))
    left = problem.row_weights[:, None] * (problem.target[:, None] - problem.theta(active).T @ fits.T) ** 2
    squares, rows = (
        np.stack([part[problem.piece_of_row == p].sum(axis=0) for p in range(len(problem.piece_sizes))])
        for part in (np.where(problem.out_of_bag_rows, left, 0.0), problem.out_of_bag_rows.astype(float))
    )
    bare = np.mean(problem.row_weights * problem.target**2)
    assert np.ptp(problem.row_weights) > 0.1
    np.testing.assert_allclose(
        losses, comparable_losses(squares, rows, problem.piece_sizes) / bare, rtol=1e-9
    )


def test_pieces_weigh_by_what_members_leave_there_in_the_middle():
    # Equation (1) by hand: the members in the middle leave 1 a row on the first piece and 5 on the second.
    squares = np.array([[10.0, 10.0, 40.0], [0.0, 50.0, 50.0]])
    rows = np.array([[10.0, 10.0, 10.0], [0.0, 10.0, 10.0]])
    np.testing.assert_allclose(comparable_losses(squares, rows, np.array([10.0, 10.0])), [3.0, 3.0, 4.5])

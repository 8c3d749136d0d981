"""Ranking of the terms of a model by singular values, the paper's equations (28) to (33).

    S = Theta diag(xi) = U Sigma V*,    S_j = sum_k u_jk U_k,    x_j = sum_k |u_jk| sigma_k / sum_k sigma_k

The least-squares coefficients u_jk are exactly sigma_k V_jk, as U is orthonormal. Their magnitude is used, since the
sign of a singular vector is arbitrary (the paper's formula has no magnitude, and depends on that sign). The sum in the
denominator runs over all m singular values.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import lapack

from aesi.numerics.typing import Array
from aesi.records import ErrorSeries
from aesi.sparse.model import SparseModel
from aesi.sparse.terms.inputs import with_inputs
from aesi.sparse.terms.library import evaluate_terms


def svd_scores(features: Array) -> Array:
    """(m,) importance of each column of S (n, m)."""
    packed, _, _, _ = lapack.dgeqrf(features)
    r = np.triu(packed[: features.shape[1]])
    _, sigma, vt = np.linalg.svd(r, full_matrices=False)
    total = sigma.sum()
    return np.asarray(np.abs(vt.T * sigma) @ sigma / total) if total > 0 else np.zeros(features.shape[1])


def svd_ranking(model: SparseModel, records: Sequence[ErrorSeries]) -> list[tuple[str, float]]:
    """Terms of a model with their scores along the records, the most important first; without the constant.

    Rows in which a term has no value are left out: of terms in the error those whose error was not measured (NaN).
    """
    variables = np.vstack(
        [np.column_stack([r.error_v, with_inputs(r, model.input_names).inputs]) for r in records]
    )
    features = (
        evaluate_terms(model.library.terms, model.scaling.apply(variables)) * model.coefficients[:, None]
    )
    kept = [j for j, term in enumerate(model.library.terms) if term.factors]
    if not kept:
        return []
    along = features[kept]
    scores = svd_scores(np.asfortranarray(along[:, np.isfinite(along).all(axis=0)].T))
    order = np.argsort(-scores, kind="stable")
    return [(model.terms[kept[j]], float(scores[j])) for j in order]

"""Weights of models: by their evidence, and by what each says of a record that it has not seen (stacking)."""

import numpy as np

from scruton.arrays import FloatArray

# Weight of the barrier at the end: how far from the optimum, in mean log score a record, per law.  A smaller one is
# lost in rounding, and laws that score alike no longer share alike.
SHARPEST = 1e-9


def posterior_weights(log_evidence: FloatArray, prior_weight: FloatArray) -> FloatArray:
    """Posterior probabilities of K models, (K,), from their log evidences and prior weights, (K,) each.

    A model with a prior weight of zero, or a log evidence of -inf, has none.

    Raises
    ------
    ValueError
        If no model is left.
    """
    with np.errstate(divide="ignore"):
        score = np.asarray(log_evidence, dtype=np.float64) + np.log(np.asarray(prior_weight, dtype=np.float64))
    top = score.max()
    if not np.isfinite(top):
        raise ValueError("no model has both a finite log evidence and a positive prior weight")
    weight: FloatArray = np.exp(score - top)
    return weight / weight.sum()


def stacking_weights(scores: FloatArray) -> FloatArray:
    r"""Weights that maximise the mean log score of the mixture of laws (Yao et al., Bayesian Analysis 13, 2018).

    .. math:: \max_w \sum_r \ln \sum_k w_k \exp s_{kr}, \qquad w_k \ge 0, \quad \sum_k w_k = 1

    Parameters
    ----------
    scores : (K, R) array
        Log joint density s of each left-out record under each law.  -inf is a record that a law excludes; a record
        that all laws exclude says nothing of them.

    Returns
    -------
    (K,) array
        Adds up to one.  Laws that score alike share alike.

    Raises
    ------
    ValueError
        If a score is NaN or +inf, or the array is no matrix with a law.

    Notes
    -----
    The problem is convex.  Newton's method with a logarithmic barrier solves it in relative steps of w; the weights
    add up to one at the optimum of :math:`\frac1R\sum_r \ln\sum_k w_k e^{s_{kr}} - \sum_k w_k` by themselves.
    """
    scores = np.asarray(scores, dtype=np.float64)
    if scores.ndim != 2 or not len(scores):
        raise ValueError(f"scores of shape {scores.shape}; (laws, records) with one law at least is wanted")
    if np.isnan(scores).any() or (scores == np.inf).any():
        raise ValueError("a score is NaN or +inf: that evidence was not found")
    laws = len(scores)
    weights = np.full(laws, 1.0 / laws)
    scores = scores[:, np.isfinite(scores).any(axis=0)]
    if not scores.shape[1]:
        return weights
    density = np.exp(scores - scores.max(axis=0))

    def objective(w: FloatArray, barrier: float) -> float:
        with np.errstate(divide="ignore"):
            return float(w.sum() - np.log(w @ density).mean() - barrier * np.log(w).sum())

    barrier = 0.1
    while barrier > 1.5 * SHARPEST:
        barrier *= 0.1
        for _ in range(100):
            share = weights[:, None] * density / (weights @ density)
            gradient = weights - share.mean(axis=1) - barrier
            # Of the relative step; the diagonal of w keeps it in proportion where a law's weight tends to zero.
            hessian = share @ share.T / share.shape[1] + np.diag(np.full(laws, barrier))
            step = -np.linalg.solve(hessian, gradient)
            decrement = -float(step @ gradient)
            if decrement < 1e-3 * barrier:
                break
            length = min(1.0, 0.95 / max(float(-step.min()), 1e-300))
            current = objective(weights, barrier)
            while length > 1e-10 and not objective(weights * (1.0 + length * step), barrier) < current:
                length *= 0.5
            if length <= 1e-10:
                break
            weights = weights * (1.0 + length * step)
    return np.asarray(weights / weights.sum())

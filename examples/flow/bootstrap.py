"""Intervals of mean errors over few windows and few trainings, and what they tell apart (percentile bootstrap)."""

import numpy as np

DRAWS = 10_000
LEVEL = 0.95
LEAST_WINDOWS = 5  # with fewer, there is no interval


def resampled_means(errors, seed=1):
    """Means over windows and trainings, which are both drawn with replacement; the same draws for all names.

    Parameters
    ----------
    errors : dict of name to (trainings, windows)
        In px; the same windows for all, and the same number of trainings (or one, which then counts for all).

    Returns
    -------
    dict of name to float64 (DRAWS,)
    """
    arrays = {name: np.atleast_2d(np.asarray(values, float)) for name, values in errors.items()}
    trainings, windows = np.max([array.shape for array in arrays.values()], axis=0)
    random = np.random.default_rng(seed)
    of_windows = random.multinomial(windows, np.full(windows, 1 / windows), DRAWS) / windows
    of_trainings = random.multinomial(trainings, np.full(trainings, 1 / trainings), DRAWS) / trainings
    return {name: np.einsum("dt,tw,dw->d", of_trainings, np.broadcast_to(array, (trainings, windows)), of_windows, optimize=True)
            for name, array in arrays.items()}


def interval(values):
    """The limits of the middle `LEVEL` of the values."""
    return tuple(np.quantile(values, [(1 - LEVEL) / 2, (1 + LEVEL) / 2]).tolist())


def compared(errors):
    """Mean errors with intervals, and the differences of all pairs.

    Parameters
    ----------
    errors : dict of name to (trainings, windows), px

    Returns
    -------
    means : dict of name to (mean, interval or None)
    pairs : list of (name, other name, mean difference, interval or None, verdict)
        The verdict is "lower", "higher" or "not distinguishable" (the interval of the differences contains 0): of the
        first name's errors. "too few windows" without intervals.
    """
    windows = np.atleast_2d(next(iter(errors.values()))).shape[1]
    means = {name: float(np.mean(values)) for name, values in errors.items()}
    if windows < LEAST_WINDOWS:
        pairs = [(a, b, means[a] - means[b], None, "too few windows") for a, b in pairs_of(errors)]
        return {name: (mean, None) for name, mean in means.items()}, pairs
    drawn = resampled_means(errors)
    pairs = []
    for a, b in pairs_of(errors):
        low, high = interval(drawn[a] - drawn[b])
        verdict = "lower" if high < 0 else "higher" if low > 0 else "not distinguishable"
        pairs.append((a, b, means[a] - means[b], (low, high), verdict))
    return {name: (means[name], interval(drawn[name])) for name in errors}, pairs


def pairs_of(names):
    names = list(names)
    return [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]

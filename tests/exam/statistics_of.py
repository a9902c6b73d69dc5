"""Shares with their exact intervals, quantiles, and calibration."""

import math


def tail(k, n, p):
    """P(X >= k) of n trials."""
    if k <= 0:
        return 1.0
    if p <= 0.0:
        return 0.0
    if p >= 1.0:
        return 1.0
    log = lambda j: math.lgamma(n + 1) - math.lgamma(j + 1) - math.lgamma(n - j + 1) + j * math.log(p) + (n - j) * math.log1p(-p)
    return min(math.fsum(math.exp(log(j)) for j in range(k, n + 1)), 1.0)


def solved(function, wanted):
    """Where a function that rises from 0 to 1 reaches a value."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) < wanted else (low, middle)
    return 0.5 * (low + high)


def clopper_pearson(k, n):
    """95 % interval of a share, by Clopper and Pearson."""
    if n == 0:
        return 0.0, 1.0
    low = 0.0 if k == 0 else solved(lambda p: tail(k, n, p), 0.025)
    high = 1.0 if k == n else solved(lambda p: tail(k + 1, n, p), 0.975)
    return low, high


def quantile(values, share):
    """Linear between the order statistics."""
    ordered = sorted(values)
    at = share * (len(ordered) - 1)
    low = math.floor(at)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (at - low) * (ordered[high] - ordered[low])


def calibration(said):
    """Expected calibration error in five bins of equal count, and (mean stated, share right, count) of each; said is (probability, right).
    Names of one probability all count with the share of them that is right, whichever bin they fall into."""
    together = {}
    for probability, right in said:
        together.setdefault(probability, []).append(right)
    said = sorted((p, sum(together[p]) / len(together[p])) for p, _ in said)
    bins, error = [], 0.0
    for b in range(5):
        part = said[b * len(said) // 5 : (b + 1) * len(said) // 5]
        if part:
            stated, right = sum(p for p, _ in part) / len(part), sum(r for _, r in part) / len(part)
            error += abs(stated - right) * len(part) / len(said)
            bins.append((stated, right, len(part)))
    return error, bins

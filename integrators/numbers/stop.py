"""When an iteration is at its end: one text for every loop, compiled or in Python.

The drivers of `compiler` have these functions as text, so they are of the compiled language and
import nothing. Sizes are of one correction in any norm; `noise` is the size of round-off in it.
"""


def over(size: float, before: float, noise: float, following: float, small: bool) -> bool:
    """Return True if an iteration is at its end after a correction of this size.

    It is at its end if the correction is round-off, or if the `following` one, as it is estimated,
    would be; or if a `small` correction is not half of the one `before`: then only the round-off of
    the residual is left. Without an estimate, `following` is the size itself.
    """
    return size <= noise or following <= noise or (size > before / 2 and small)


def steepness(size: float, before: float, noise: float, kappa: float, count: int) -> float:
    """Return κ after `count` corrections: a correction of size s is followed by one of at most κs².

    κ is estimated anew in each run of Newton's method. Corrections below 64 round-offs are noise
    and tell only that κ is smaller than they would let it be.
    """
    if count > 1:
        if size > 64 * noise:
            seen = size / (before * before) if before > 0 else kappa
            if seen > kappa or count == 2:
                kappa = seen
        elif 64 * noise < kappa * before * before:
            kappa = 64 * noise / (before * before)
    return kappa

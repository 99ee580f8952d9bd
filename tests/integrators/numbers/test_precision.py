"""Digits of mpmath, which all threads share."""

from concurrent.futures import ThreadPoolExecutor
from threading import Event

import mpmath

from discmech.integrators.numbers import working_digits


def test_threads_take_turns():
    """The second asks while the first is at work, and would change its digits."""
    begun, entered, read = Event(), Event(), Event()

    def first():
        with working_digits(50):
            begun.set()
            entered.wait(0.5)  # in vain, if they take turns
            digits = mpmath.mp.dps
            read.set()
            return digits

    def second():
        begun.wait()
        with working_digits(30):
            entered.set()
            read.wait()
            return mpmath.mp.dps

    before = mpmath.mp.dps
    with ThreadPoolExecutor(2) as pool:
        asked = [pool.submit(one) for one in (first, second)]
        assert [one.result() for one in asked] == [50, 30]
    assert mpmath.mp.dps == before

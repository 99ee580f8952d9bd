"""Fair timing: runs take turns, and a time is known when its samples agree."""

import itertools
import math
import time

import pytest

from discmech.studies.core import clocks
from discmech.studies.work_precision import racing


class Machine:
    """A clock that only moves when a run takes its time."""

    def __init__(self):
        self.now, self.calls = 0.0, []

    def run(self, name, seconds, cold=0.0):
        times = itertools.cycle(seconds)

        def call():
            self.now += next(times) + cold * (self.calls[-1:] != [name])
            self.calls.append(name)

        return call


def test_a_steady_run_is_known_after_the_least_rounds():
    machine = Machine()
    (timing,) = racing.race([machine.run("a", [0.25])], 1e9, lambda: machine.now)
    assert (timing.median, timing.low, timing.high) == (0.25, 0.25, 0.25)
    assert (timing.samples, timing.outliers) == (racing.LEAST, 0)


def test_runs_take_turns_and_only_the_unknown_go_on():
    machine = Machine()
    runs = [machine.run("steady", [1.0]), machine.run("rough", [1.0, 3.0])]
    steady, rough = racing.race(runs, 1e9, lambda: machine.now)
    assert (steady.samples, rough.samples) == (racing.LEAST, racing.MOST)
    rounds = machine.calls[2 : 2 + 2 * racing.LEAST]  # after one call each: long runs need no more
    pairs = list(zip(rounds[::2], rounds[1::2], strict=True))
    assert all(set(pair) == {"steady", "rough"} for pair in pairs)
    assert len(set(pairs)) == 2  # not always in the same order


def test_the_budget_ends_it():
    machine = Machine()
    (timing,) = racing.race([machine.run("rough", [1.0, 3.0])], 2.0, lambda: machine.now)
    assert timing.samples == racing.LEAST


def test_short_runs_are_repeated_within_a_sample():
    machine = Machine()
    (timing,) = racing.race([machine.run("a", [1e-6])], 1.0, lambda: machine.now)
    assert timing.median == pytest.approx(1e-6)
    assert len(machine.calls) >= racing.LEAST * racing.SHORTEST / 1e-6


def test_the_first_call_after_another_run_is_not_timed():
    """Else a sample of few repeats is longer than one of many, and the number is set by chance."""
    machine = Machine()
    runs = [machine.run(name, [3e-4], cold=5e-4) for name in "ab"]
    for timing in racing.race(runs, 1.0, lambda: machine.now):
        assert timing.high == pytest.approx(3e-4)
    stretches = [len(list(same)) for _, same in itertools.groupby(machine.calls)]
    assert set(stretches[2:]) <= {5, 10}  # after the plans: one call to warm up, and four of 1.2 ms


def test_a_disturbed_first_call_does_not_set_the_repeats():
    machine = Machine()
    times = [4e-3, *[3e-5] * 1000]
    (timing,) = racing.race([machine.run("a", times)], 1.0, lambda: machine.now)
    assert len(machine.calls) == 3 + racing.LEAST * (1 + 34) and timing.known


def test_close_quartiles_of_few_samples_are_no_knowledge():
    """The median of five samples is anywhere between the first and the last of them."""
    few = [1.0, 1.01, 1.02, 1.03, 1.3]
    assert not racing.Timing.of(few).known
    assert racing.Timing.of([*few[:4], 1.05]).known
    assert racing.Timing.of([*few, 1.0, 1.02, 1.01]).known  # of eight, one may lie apart
    assert not racing.Timing.of([1.0] * 4).known


@pytest.mark.parametrize("samples", range(1, racing.MOST + 1))
def test_the_interval_of_the_median_has_its_confidence(samples):
    """By the definition: fewer than r of n fair coins show heads, or fewer than r tails."""
    rank = racing._rank(samples)

    def sure(r):
        return 1 - 2 * sum(math.comb(samples, k) for k in range(r)) / 2**samples

    assert rank == 0 or sure(rank) >= racing.CONFIDENCE
    assert sure(rank + 1) < racing.CONFIDENCE


def test_an_outlier_is_flagged_and_kept():
    timing = racing.Timing.of([1.0, 1.01, 1.02, 0.99, 1.0, 50.0])
    assert (timing.samples, timing.outliers) == (6, 1)
    assert racing.Timing.of([1.0, 1.01, 1.02, 0.99, 1.0, 1.0]).outliers == 0


def test_nothing_to_time():
    assert racing.race([], 1.0) == []


@pytest.mark.parametrize("true", [3e-5, 3e-3, 2e-2])
def test_a_clock_of_long_ticks_times_as_well(true):
    """That of Windows counts processor time by 15.6 ms: a sample then takes many ticks."""
    machine = Machine()

    def clock():
        machine.now += 1e-5  # so it moves by itself
        return math.floor(machine.now / 0.015625) * 0.015625

    (timing,) = racing.race([machine.run("a", [true])], 1.0, clock)
    assert timing.median == pytest.approx(true, rel=2 * racing.KNOWN)


def test_the_clock_has_a_fine_tick_on_every_system(monkeypatch):
    assert 0 < clocks.tick_of(clocks.fine_clock()) <= clocks.FINE
    monkeypatch.setattr(clocks, "tick_of", lambda clock: 0.015625)
    assert clocks.fine_clock.__wrapped__() is time.perf_counter

"""Slopes, intervals and asymptotic windows on made-up errors whose truth is known."""

import math

import numpy as np
import pytest

from discmech.studies.core.fitting import BATCHES, asymptotic_window, batch_line, fit_line

STEPS = [0.1 / 2**k for k in range(12)]
EPS = 2.0**-53


def window(errors, floor=1e-13, straight=0.012, steps=STEPS):
    return asymptotic_window(steps[: len(errors)], errors, floor, straight)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 0.5, 2.2])
def test_a_pure_power_is_found_exactly_and_wholly(order):
    found = window([3 * h**order for h in STEPS], floor=1e-30)
    assert (found.first, found.last) == (0, len(STEPS) - 1)
    assert found.line.slope == pytest.approx(order, abs=1e-12)
    low, high = found.line.interval
    assert high - low < 1e-11


@pytest.mark.parametrize(("order", "size"), [(2, 1e-9), (4, 1e-13)])
@pytest.mark.parametrize("seed", range(5))
def test_round_off_is_left_out(order, size, seed):
    """The points on a floor of noise stay out, and those that the noise still bends."""
    chance = np.random.default_rng(seed)
    noise = size * np.abs(1 + chance.normal(size=len(STEPS)) / 3)
    errors = [h**order + n for h, n in zip(STEPS, noise, strict=True)]
    buried = next(k for k, h in enumerate(STEPS) if h**order < 30 * noise[k])
    found = window(errors, 3 * size)
    assert found is not None and found.last <= buried
    assert found.line.slope == pytest.approx(order, abs=0.02)


def test_a_bend_before_the_asymptotic_range_is_left_out():
    errors = [h + 40 * h**2 for h in STEPS]  # slope 1, but nearly 2 at the coarse end
    found = window(errors)
    assert found.first >= 5 and found.last == len(STEPS) - 1
    assert found.line.slope == pytest.approx(1, abs=0.05)
    assert found.line.slope > 1  # what is left of the bend is seen, and judged by the tolerance


def test_both_ends_at_once():
    errors = [h**2 * (1 + 20 * h) + 1e-10 for h in STEPS]
    found = window(errors, floor=1e-9)
    assert found.first > 0 and found.last < len(STEPS) - 1
    assert found.line.slope == pytest.approx(2, abs=0.05)


@pytest.mark.parametrize("count", range(4))
def test_fewer_than_four_points_are_no_order(count):
    assert window([h**2 for h in STEPS[:count]]) is None
    good = [h**2 for h in STEPS[:count]]
    assert window(good + [math.nan] * 5) is None
    assert window(good + [1e-20] * 5) is None  # below the floor


def test_nothing_straight_is_no_order():
    assert window([h**2 * (1 + (k % 2)) for k, h in enumerate(STEPS)]) is None


def test_errors_that_grow_are_never_a_positive_order():
    found = window([1e-6 / h**2 for h in STEPS])
    assert found.line.slope == pytest.approx(-2)
    assert found.line.interval[1] < 0


def test_errors_that_stand_still_have_order_zero():
    assert window([1e-6] * 12).line.slope == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_failed_run_is_never_bridged(bad):
    errors = [h**2 for h in STEPS[:8]]
    errors[2] = bad
    found = window(errors)
    assert (found.first, found.last) == (3, 7)
    errors[5] = bad
    assert window(errors) is None


def test_zero_error_is_round_off_not_a_crash():
    assert window([h**2 for h in STEPS[:5]] + [0.0] * 3).last == 4


def test_of_equally_long_stretches_the_finest_is_taken():
    errors = [h for h in STEPS[:4]] + [math.nan] + [h**2 for h in STEPS[5:9]]
    found = window(errors)
    assert (found.first, found.last) == (5, 8)
    assert found.line.slope == pytest.approx(2)


@pytest.mark.parametrize("points", [4, 9, 300])
def test_intervals_cover_the_truth_as_often_as_they_say(points):
    """95 % of 2000 intervals, give or take four standard deviations: 4·√(0.05·0.95/2000)."""
    chance, trials = np.random.default_rng(points), 2000
    x = np.log2(0.1) - np.arange(points)
    covered = 0
    for _ in range(trials):
        low, high = fit_line(x, 2 * x + chance.normal(scale=0.01, size=points)).interval
        covered += low <= 2 <= high
    assert covered / trials == pytest.approx(0.95, abs=0.0195)


def test_a_line_through_exact_points():
    line = fit_line([0, 1, 2], [1, 3, 5])
    assert line.slope == pytest.approx(2) and line.residual < 4 * EPS


def test_what_round_off_is_known_to_do_is_left_out_and_excused():
    errors = [h**2 + (k > 7) * 1e-6 for k, h in enumerate(STEPS)]
    assert window(errors) is None  # they leave the line far above the floor
    known = [(k > 7) * 1e-6 for k in range(len(STEPS))]
    found = asymptotic_window(STEPS, errors, 1e-13, 0.012, known)
    assert (found.first, found.last) == (0, 7)
    below = [2 * e for e in errors]  # nothing is known to the method
    assert asymptotic_window(STEPS, errors, 1e-13, 0.012, below) is None


def test_a_line_through_parts_takes_the_most_that_do_not_follow_one_another():
    """As many as leave |r₁| ≤ 2/√parts beside the line; of a short series each value."""
    seen = set()
    for seed in range(8):
        chance = np.random.default_rng(seed)
        for tied in (0.0, 0.9, 0.97):
            times, values = np.arange(640) / 64, chance.normal(size=640)
            for i in range(1, 640):
                values[i] += tied * values[i - 1]
            for count in BATCHES:
                x, y = (part.reshape(count, -1).mean(axis=1) for part in (times, values))
                line = fit_line(x, y)
                beside = y - y.mean() - line.slope * (x - x.mean())
                if abs(beside[1:] @ beside[:-1]) <= 2 / math.sqrt(count) * (beside @ beside):
                    break
            seen.add(count)
            assert batch_line(times, values).interval == pytest.approx(line.interval, rel=1e-9)
    assert {64, 32} <= seen


def test_a_line_through_parts_of_short_and_of_straight_series():
    times = np.arange(64) / 8
    wave = np.sin(5 * times)
    assert batch_line(times[:31], wave[:31]) == fit_line(times[:31], wave[:31])
    means = [part.reshape(8, 4).mean(axis=1) for part in (times[:32], wave[:32])]
    assert batch_line(times[:32], wave[:32]) == fit_line(*means)
    highest = wave.reshape(16, 4).max(axis=1)
    found = batch_line(times, wave, 0.99, np.max)
    middles = times.reshape(16, 4).mean(axis=1)
    eight = fit_line(times.reshape(8, 8).mean(axis=1), wave.reshape(8, 8).max(axis=1), 0.99)
    assert found in (fit_line(middles, highest, 0.99), eight)
    assert batch_line(times, 3 * times).slope == pytest.approx(3)

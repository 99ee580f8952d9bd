"""A floor is a grid that every output of a program lies on; no amount of error is one."""

import numpy as np
import pytest

from discmech import black_box, scenes
from discmech.studies.evidence.grid import Grid, grids_of

from .judging import judged
from .methods import kick_drift_kick

GRIDS = {
    "numbers rounded to 13 decimals": lambda v: np.round(v, 13),
    "numbers rounded to 9 decimals": lambda v: np.array([float(f"{e:.9f}") for e in v]),
    "numbers rounded to 11 decimals": lambda v: np.floor(v * 1e11) / 1e11,
    "numbers of 12 significant digits": lambda v: np.array([float(f"{e:.12g}") for e in v]),
    "multiples of 2^-40": lambda v: np.rint(v * 2.0**40) / 2.0**40,
    "numbers of 34 bits": lambda v: v + v * 2.0**19 - v * 2.0**19,
}
#: seen where outputs are near each other, since a unit is no simple number
OTHER = {"multiples of 1.8897e-09": lambda v: np.rint(v / 1.8897e-9) * 1.8897e-9}
SINGLE = "numbers of single precision"
ALL = {
    **GRIDS, SINGLE: lambda v: v.astype(np.float32).astype(float),
    "numbers of 11 bits": lambda v: v.astype(np.float16).astype(float),
    "whole numbers": lambda v: np.round(100 * v),
    "multiples of 0.0037": lambda v: np.rint(100 * v) * 0.0037,
}  # fmt: skip


def step_of(given, method=kick_drift_kick, **options):
    """Return Verlet, or another method, that gives out its numbers so."""

    @black_box(order=2, name="told", **options)
    def told(q, p, h, system):
        return tuple(map(given, method(q, p, h, system)))

    return told


def heavier(part):
    """Return Verlet with a potential that is too large by this part of it."""

    def method(q, p, h, s):
        p = p - h / 2 * (1 + part) * s.gradient(q, p)
        q = q + h * s.velocity(q, p)
        return q, p - h / 2 * (1 + part) * s.gradient(q, p)

    return method


def euler(q, p, h, s):
    a, b = s.f(q, p)
    return q + h * a, p + h * b


def jitter(size):
    """Return an error of that size that looks random, but is the same for the same number."""
    return lambda v: v + size * np.sin(7.3e13 * v)


NO_FLOORS = {
    "jitter": step_of(jitter(1e-9)),
    "jitter, on a fine grid": step_of(lambda v: np.round(jitter(1e-9)(v), 13)),
    "jitter of 30 units": step_of(lambda v: np.round(jitter(3e-8)(v), 9)),
    "jitter of 8 units": step_of(lambda v: np.round(jitter(8e-9)(v), 9)),
    "a constant": step_of(lambda v: v + 1e-9),
    "a constant, on a grid": step_of(lambda v: np.round(v, 9) + 3e-8),
    "a potential": step_of(lambda v: v, heavier(1e-7)),
    "a potential, on a grid": step_of(lambda v: np.round(v, 13), heavier(1e-7)),
    "Euler's method, on a grid": step_of(lambda v: np.round(v, 9), euler),
    "one number for all": step_of(lambda v: 0 * v + 0.5),
    "whole numbers": step_of(np.round),
}


@pytest.mark.slow
@pytest.mark.parametrize("attack", NO_FLOORS)
def test_no_error_of_a_method_is_a_floor(attack):
    found = judged("order", "pendulum", NO_FLOORS[attack], causes=attack == "whole numbers")
    assert found["verdict"] == "fail"
    if attack == "whole numbers":
        assert "single precision" not in found["reason"]
        assert found["diagnosis"]["cause"] == "rounded"


@pytest.mark.dear(but=("40]",))
@pytest.mark.parametrize("words", {**GRIDS, **OTHER})
def test_a_method_has_its_order_down_to_the_floor_of_its_numbers(words):
    found = judged("order", "pendulum", step_of({**GRIDS, **OTHER}[words]))
    assert found["verdict"] == "pass" and words in found["reason"]
    assert "down to a floor of its own of" in found["reason"]


@pytest.mark.parametrize(("power", "said"), [(24, ", numbers of single precision"), (12, "")])
def test_a_grid_that_differences_of_single_numbers_leave_is_called_so(power, said):
    """Multiples of 2⁻¹² of numbers of size 1 are coarser than these are in single precision."""
    (grid,) = grids_of(np.arange(1, 2**power, 2**power // 97, dtype=float)[:, None] / 2.0**power)
    assert grid.words == f"multiples of 2^-{power}{said}"


@pytest.mark.slow
def test_a_grid_of_velocities_is_one_of_momenta():
    """The numbers that the program itself gives are looked at, before they become momenta."""

    def method(q, v, h, s):
        q, p = kick_drift_kick(q, s.momentum(q, v), h, s)
        return q, s.velocity(q, p)

    heavy = scenes.get("pendulum").with_values(
        parameters={"mass": "2.3", "length": 1, "gravity": 1}
    )
    box = step_of(GRIDS["numbers rounded to 13 decimals"], method, state="qv")
    found = judged("order", heavy, box, causes=False)
    assert found["verdict"] == "pass" and "rounded to 13 decimals" in found["reason"]


@pytest.mark.dear("[6]")
@pytest.mark.parametrize("decimals", [3, 6])
def test_a_floor_that_hides_the_order_is_inconclusive(decimals):
    found = judged("order", "pendulum", step_of(lambda v: np.round(v, decimals)))
    assert found["verdict"] == "inconclusive"
    assert f"{10.0**-decimals:.1g} (numbers rounded to {decimals} decimals)" in found["reason"]
    assert found["diagnosis"]["cause"] == "rounded"


@pytest.mark.slow
def test_single_precision_has_to_be_said():
    found = judged("order", "pendulum", step_of(ALL[SINGLE]))
    assert found["verdict"] == "inconclusive" and 'say numbers="float32"' in found["reason"]
    assert found["diagnosis"]["cause"] == "single precision"


@pytest.mark.parametrize("words", ALL)
def test_a_grid_holds_every_output(words):
    """Of random numbers of some sizes it is found; one that lies beside it denies it."""
    drawn = np.random.default_rng(len(words))
    on = ALL[words](drawn.uniform(0.1, 9, 120) * drawn.choice([-1, 1], 120))
    (grid, none) = grids_of(np.column_stack([on, drawn.standard_normal(120)]))
    assert grid is not None and grid.words == words and none is None
    beside = on.copy()
    beside[7] += grid.units(beside[7:8])[0] * 0.37
    (other,) = grids_of(beside[:, None])
    assert other is None or other.units(beside)[7] < grid.units(beside)[7]


def test_a_component_at_rest_lies_on_no_grid():
    assert grids_of(np.full((100, 2), [0.5, 0.0])) == [None, None]
    assert grids_of(1e200 * np.random.default_rng(0).standard_normal((100, 1))) == [None]
    assert Grid(10, 3).chance(np.array([0.125, 0.1251])) == 0.0

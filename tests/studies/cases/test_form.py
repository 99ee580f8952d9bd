"""Form, adjoint, stability and chosen steps on inputs that were once judged wrongly."""

import importlib.util
import itertools
from pathlib import Path

import numpy as np
import pytest

from discmech import Scheme, scenes
from discmech.integrators import BadInput, rules
from discmech.studies.stability.measuring import gaps_of
from discmech.studies.user.assertions import Missed, assert_reversible

HERE = Path(__file__).parents[3] / "docs" / "attacks" / "form.py"


def _loaded(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


attacks, of_order = _loaded(HERE), _loaded(HERE.with_name("order.py"))


@pytest.mark.parametrize("scene", ["pendulum", "heavy-top", "wong"])
def test_what_moves_nothing_is_its_own_adjoint(scene):
    assert Scheme(scenes.get(scene), attacks.nothing).self_adjoint


@pytest.mark.parametrize("rule", ["implicit-midpoint", "dual-gauss-2"])
def test_a_self_adjoint_map_is_so_where_it_moves_nothing(rule):
    assert Scheme(attacks.ball, rules.get(rule)).self_adjoint


@pytest.mark.slow
def test_no_coordinate_hides_another_ones_way_back():
    assert_reversible("midpoint", attacks.two_parts, digits=16)
    with pytest.raises(Missed, match="not the inverse"):
        assert_reversible("rectangle", attacks.two_parts, digits=16)


@pytest.mark.sampled
@pytest.mark.parametrize("method", ["kahan-li-8:midpoint", "sofroniou-spaletta-10:midpoint"])
@pytest.mark.parametrize("scene", ["henon-heiles", "rigid-body"])
def test_long_compositions_hide_no_wrong_momentum(scene, method):
    """At 32 times the step a bound of bounds grew by some 10¹⁵ and more over the substeps."""
    scheme = Scheme(scenes.get(scene), rules.get(method))
    flow = scheme.flow(32 * scheme.scene.step)
    run = flow.trajectory(2)
    start, end, mu = (run.base[1], run.mu[1]), run.base[2], run.mu[2]
    assert flow.step_defect(*start, end, mu, u0=run.u[1]) < 64 * 2.0**-53
    assert flow.step_defect(*start, end, mu * (1 + 1e-10), u0=run.u[1]) > 64 * 2.0**-53


def test_the_exponential_of_an_algebra_without_a_closed_form_runs_in_stages():
    flow = Scheme(attacks.aff1, rules.get("gauss-2")).flow("0.05", 20)
    flow.stages.alone = True
    end = flow.trajectory(4).mu[-1].astype(float)
    assert end == pytest.approx([0.19449855, 1.05087612], abs=1e-8)  # by dual-gauss-4


@pytest.mark.parametrize("rule", ["gauss-2", "midpoint"])
def test_a_tolerance_that_no_run_can_check_is_refused(rule):
    """With ω = 10⁶ runs of h and h/2 agree to 1e-3, and share an error of 0.75 in μ."""
    stiff = scenes.get("spring-pendulum").with_values(parameters={"stiffness": "1e12"})
    with pytest.raises(BadInput, match="the fastest motion there, of the rate 1e"):
        Scheme(stiff, rules.get(rule)).flow(tolerance="1e-3")


def test_a_fast_motion_that_rests_needs_no_short_step():
    scheme = Scheme(attacks.fast_at_rest, rules.get("midpoint"))
    flow = scheme.flow(tolerance="1e-3")
    assert flow.choice.steps < 1000  # the pilot resolved ω = 1000 with 8192
    assert flow.trajectory(flow.choice.steps).x[-1, 0] == pytest.approx(np.cos(6), abs=1e-3)


@pytest.mark.slow
def test_a_step_back_is_judged_off_the_plane_of_the_motion():
    with pytest.raises(Missed, match=r"a place that was drawn (on|beside) the motion"):
        assert_reversible(of_order.damped_off_plane, of_order.planar, digits=16)


def test_a_slow_force_opens_gaps_in_an_impulse_method():
    ((low, high),) = gaps_of(attacks.impulse)
    assert (low, high) == (pytest.approx(2.82701, abs=1e-5), pytest.approx(2.82984, abs=1e-5))
    assert gaps_of(rules.get("imex")) == []


def test_a_component_of_a_billionth_part_is_solved_to_its_own_round_off():
    """Midpoint ended where the sum of all unknowns did: 5e-10 of the small one was left."""
    scheme = Scheme(attacks.two_sizes, rules.get("midpoint"))
    flow = scheme.flow("1.6")
    run = flow.trajectory(60)
    rows = list(zip(run.base, run.mu, run.u, strict=True))
    for (x, mu, u), (y, after, _) in itertools.pairwise(rows):
        assert flow.step_defect(x, mu, y, after, u0=u) < 64 * 2.0**-53


@pytest.mark.slow
def test_random_methods_have_the_verdicts_that_they_deserve(monkeypatch):
    monkeypatch.chdir(HERE.parent)
    assert not _loaded(HERE.with_name("random_forms.py")).main("a test", 5, 10)

"""Recorded runs on the bench: what they are judged by, and a sentence for runs that are none."""

import numpy as np
import pytest

from discmech import Scene, Scheme, black_box, pair, recorded, scenes, trapezoidal
from discmech.integrators import BadInput
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.rules import get
from discmech.studies import check
from discmech.studies.command import main
from discmech.studies.evidence.rows import DIFFERENCES, _moved_by, of_rows
from discmech.studies.order.records import Row
from discmech.studies.order.window import off_its_neighbours, off_the_line


def save(folder, rule="trapezoidal", scene="pendulum", levels=5, x0=None, every=1, form="npz",
         coarser=1):  # fmt: skip
    """Runs of a rule, one a file, each of half the step of the one before."""
    made = scenes.get(scene)
    for k in range(levels):
        steps = made.steps_for(made.step) * 2**k // coarser
        rule = get(rule) if isinstance(rule, str) else rule
        run = Scheme(made, rule).flow(made.duration / steps).trajectory(steps, every, x0=x0,
              mu0=None if x0 is None else [0.3])  # fmt: skip
        if form == "npz":
            np.savez(folder / f"run{k}.npz", t=run.t, q=run.x, p=run.mu)
            continue
        names = [f"{letter}{i + 1}" for letter, part in (("q", run.x), ("p", run.mu))
                 for i in range(part.shape[1])]  # fmt: skip
        table = np.column_stack([run.t, run.x, run.mu])
        lines = [",".join(form.format(v) for v in row) for row in table.tolist()]
        folder.joinpath(f"run{k}.csv").write_text("\n".join([",".join(["t", *names]), *lines]))


def order(folder, claimed=2, scene="pendulum", **more):
    rule = recorded([str(folder / "*.npz")], claimed, **more)
    (case,) = check("order", [scene], [rule], digits=[16])["cases"]
    return case


@pytest.mark.slow
def test_the_order_of_runs_is_judged_from_both_sides(tmp_path):
    save(tmp_path)
    case = order(tmp_path)
    assert case["verdict"] == "pass" and case["measured"]["order"] == pytest.approx(2, abs=2e-3)
    for wrong in (1, 3):
        assert order(tmp_path, wrong)["verdict"] == "fail"
    assert order(tmp_path, None)["verdict"] == "measured"


@pytest.mark.dear("heun")
@pytest.mark.parametrize(("rule", "claimed"), [("heun", 2), ("runge-kutta-4", 4)])
def test_errors_on_no_line_pass_where_all_steps_have_the_order_and_they_come_to_it(
    rule, claimed, tmp_path
):
    """Four runs of the pendulum: local orders of 2.28, 2.06, 2.00, and of 3.88, 3.93, 3.96."""
    save(tmp_path, rule, levels=4)
    case = order(tmp_path, claimed)
    assert case["verdict"] == "pass" and "come to the declared one" in case["reason"]
    for wrong in (claimed - 1, claimed + 1):
        assert order(tmp_path, wrong)["verdict"] != "pass"


@pytest.mark.slow
@pytest.mark.parametrize("k", [0, 4])
def test_a_run_of_another_method_is_named(tmp_path, k):
    save(tmp_path)
    other = tmp_path / "other"
    other.mkdir()
    save(other, "runge-kutta-4")
    (other / f"run{k}.npz").replace(tmp_path / f"run{k}.npz")
    case = order(tmp_path)
    assert case["verdict"] == "inconclusive" and "record all runs by one method" in case["reason"]


@pytest.mark.parametrize(("errors", "named"), [
    ([4e-3, 1e-3, 2.5e-4, 6.25e-5, 1.5625e-5], None),
    ([6e-3, 1e-3, 2.5e-4, 6.25e-5, 1.5625e-5], 0),  # a longer step by another method
    ([4e-3, 1e-3, 2.5e-4, 6.25e-5, 1e-11], 4),  # a shorter one
    ([0.06, 4.4e-3, 1e-3, 2.5e-4, 6.25e-5, 1.5625e-5], None),  # h⁴ of other powers
    ([1.2, 1e-3, 2.5e-4, 6.25e-5, 1.5625e-5], None),  # a step that is too long
    ([4e-8, 1e-8, 2.5e-9, 6.25e-10, 1.8e-10, 2e-10], None),  # round-off
    ([4.05e-3, 1e-3, 2.6e-4, 6.25e-5, 1.5625e-5], 2),  # one in the middle, by 4 %
    ([4.1e-3, 1.1e-3, 2.5e-4, 6.25e-5, 1.5625e-5], 1),
    ([5e-3, 1.1e-3, 2.6e-4, 6.3e-5, 1.57e-5], None),  # two powers
    ([h**2 * (1 + h / 2) for h in (1, 0.1, 0.01, 1e-3, 1e-4)], None),  # and steps by tens
])  # fmt: skip
def test_what_is_on_no_line_is_another_power_or_round_off_or_another_run(errors, named):
    on_line = [k for k, e in enumerate(errors) if e in (1e-3, 2.5e-4, 6.25e-5, 1e-8, 2.5e-9)
               or e in (4e-3, 1.5625e-5, 4e-8, 6.25e-10)]  # fmt: skip
    rows = [Row(10 * 2**k, 2.0**-k, e, used=k in on_line) for k, e in enumerate(errors)]
    other = off_the_line(rows, 2) or off_its_neighbours(rows, 2)
    assert other is (None if named is None else rows[named])


@pytest.mark.slow
def test_rows_may_be_each_so_many_steps(tmp_path):
    save(tmp_path, every=10)
    assert order(tmp_path)["verdict"] == "pass"


@pytest.mark.slow
def test_another_start_has_its_own_reference(tmp_path):
    save(tmp_path, x0=[1.0])
    case = order(tmp_path)
    assert case["verdict"] == "pass" and case["measured"]["order"] == pytest.approx(2, abs=2e-3)


@pytest.mark.parametrize(("of", "factors", "words"), [
    ("pendulum", (1.0001, 1), "the gradient of the potential is off by 0.0001"),
    ("pendulum", (1, 0.99), "the motion of x comes 0.99 times"),
    ("pendulum", (-1, 1), "wrong sign"),
    ("henon-heiles", (1.001, 1.001), "every step is 0.001 of it too long"),
    ("pendulum", (1, 1), ""),
])  # fmt: skip
def test_runs_of_another_motion_are_told_which(of, factors, words, tmp_path):
    """Kick and drift of a leapfrog times a factor each."""
    kick, drift = factors

    @black_box(order=2)
    def leapfrog(q, p, h, system):
        p = p - h / 2 * kick * system.gradient(q, p)
        q = q + h * drift * system.velocity(q, p)
        return q, p - h / 2 * kick * system.gradient(q, p)

    save(tmp_path, leapfrog, of)
    case = order(tmp_path, scene=of)
    assert (case["verdict"] == "pass") is (not words)
    assert words in case["reason"] and ("Cause" in case["reason"]) is bool(words)


def test_rows_of_an_angle_within_one_turn_are_told(tmp_path):
    @black_box(order=2)
    def within(q, p, h, system):
        p = p - h / 2 * system.gradient(q, p)
        q = q + h * system.velocity(q, p)
        return q % (2 * np.pi), p - h / 2 * system.gradient(q, p)

    save(tmp_path, within, x0=[3.5])
    case = order(tmp_path)
    assert case["verdict"] == "fail" and "by whole turns, first at t = " in case["reason"]


def test_few_runs_or_few_digits_are_inconclusive(tmp_path):
    save(tmp_path, levels=3)
    case = order(tmp_path)
    assert case["verdict"] == "inconclusive" and "recorded are 3" in case["reason"]
    save(tmp_path, levels=5, form="{:.3f}")
    rule = recorded(str(tmp_path / "*.csv"), 2)
    (case,) = check("order", ["pendulum"], [rule], digits=[16])["cases"]
    assert case["verdict"] == "inconclusive" and "17 digits" in case["reason"]


def test_energy_and_momenta_of_runs_are_judged_where_they_are_claimed(tmp_path):
    save(tmp_path, "trapezoidal", "kepler", 4)
    claimed = recorded(str(tmp_path / "*.npz"), 2, symplectic=True, keeps=("momentum",))
    assert check("momentum", ["kepler"], [claimed])["verdict"] == "pass"
    for k in range(4):
        with np.load(tmp_path / f"run{k}.npz") as file:
            held = dict(file)
        slower = 1 - 1e-9 * np.arange(len(held["t"]))[:, None]
        np.savez(tmp_path / f"run{k}.npz", t=held["t"], q=held["q"], p=held["p"] * slower)
    lossy = recorded(str(tmp_path / "*.npz"), 2, keeps=("momentum",))
    assert check("momentum", ["kepler"], [lossy])["verdict"] == "fail"
    silent = recorded(str(tmp_path / "*.npz"), 2)
    assert check("momentum", ["kepler"], [silent])["verdict"] == "measured"
    for claim in ({"reversible": True}, {"keeps": "volume"}):
        with pytest.raises(BadInput, match="tell of no step back and of no volume"):
            recorded(str(tmp_path / "*.npz"), 2, **claim)


@pytest.mark.parametrize(("rule", "verdict"), [
    ("average-vector-field", "pass"), ("trapezoidal", "fail"),
])  # fmt: skip
def test_an_energy_that_each_step_keeps_is_kept_from_row_to_row(rule, verdict, tmp_path):
    """Of the trapezoidal rule it stays in a band, as of every symplectic one."""
    save(tmp_path, rule, "kepler", 4)
    claimed = recorded(str(tmp_path / "*.npz"), 2, keeps=("energy",))
    found = check("energy", ["kepler"], [claimed])
    assert found["verdict"] == verdict
    assert verdict == "pass" or "the energy changes by" in found["cases"][0]["reason"]


def test_runs_take_the_place_of_flows(tmp_path):
    save(tmp_path)
    scheme = Scheme(scenes.get("pendulum"), recorded(str(tmp_path / "*.npz"), 2))
    run = scheme.flow("0.05").trajectory(100, every=10)
    same = Scheme(scenes.get("pendulum"), trapezoidal).flow("0.05").trajectory(100, every=10)
    assert np.array_equal(run.x, same.x) and run.steps == 100 and len(run.u) == 11
    for ask, words in {
        (lambda: scheme.flow("0.03")): "no run of the step 0.03; recorded are 0.1, 0.05, 0.025",
        (lambda: scheme.flow("0.05", digits=50)): "digits=16",
        (lambda: scheme.flow("0.05").trajectory(10**6)): "no others can be had",
        (lambda: scheme.flow("0.05").trajectory(10, x0=[1])): "from one start",
    }.items():
        with pytest.raises(CannotMeasure, match=words):
            ask()


def test_a_study_that_makes_steps_says_so(tmp_path):
    save(tmp_path, levels=1)
    with pytest.raises(BadInput, match="symplecticity makes steps of its own"):
        check("symplecticity", ["pendulum"], [recorded(str(tmp_path / "*.npz"), 2)])


def test_runs_that_do_not_belong_together_are_a_sentence(tmp_path):
    save(tmp_path, levels=2)
    rule = recorded(str(tmp_path / "*.npz"), 2)
    with pytest.raises(CannotMeasure, match="has 1 coordinates and 1 momenta, but kepler has 2"):
        Scheme(scenes.get("kepler"), rule)
    held = np.load(tmp_path / "run1.npz")
    np.savez(tmp_path / "run1.npz", t=held["t"], q=held["q"] + 1e-6, p=held["p"])
    with pytest.raises(BadInput, match="begin at different states"):
        Scheme(scenes.get("pendulum"), recorded(str(tmp_path / "*.npz"), 2))
    with pytest.raises(CannotMeasure, match="are runs of kepler, not of pendulum"):
        rule = recorded(str(tmp_path / "run0.npz"), 2, scene="kepler")
        Scheme(scenes.get("pendulum"), rule)


def test_a_start_that_the_scene_cannot_have_is_a_sentence(tmp_path):
    t = np.arange(5) / 10
    np.savez(tmp_path / "run.npz", t=t, x=np.full((5, 3), 0.3), mu=np.ones((5, 3)))
    with pytest.raises(BadInput, match="heavy-top"):
        Scheme(scenes.get("heavy-top"), recorded(str(tmp_path / "run.npz"), 2))
    np.savez(tmp_path / "run.npz", t=t, q=np.full((5, 2), 0.3), p=np.ones((5, 2)))
    with pytest.raises(BadInput, match="cartesian-pendulum"):
        Scheme(scenes.get("cartesian-pendulum"), recorded(str(tmp_path / "run.npz"), 2))


FILE = 'from discmech import recorded\nruns = recorded("*.npz", order=2, symplectic=True)\n'


def test_verify_finds_the_scene_that_the_runs_begin_like(tmp_path, capsys, monkeypatch):
    save(tmp_path)
    tmp_path.joinpath("mine.py").write_text(FILE)
    monkeypatch.chdir(tmp_path.parent)
    words = ["verify", f"{tmp_path.name}/mine.py", "--study", "order", "--jobs", "1"]
    assert main(words) == 0
    assert "pendulum, runs," in capsys.readouterr().out
    for scene, said in (("nothing", 'no scene "nothing"'), ("kepler", "kepler has 2 and 2")):
        odd = f'odd = recorded("*.npz", order=2, scene="{scene}")\n'
        tmp_path.joinpath("mine.py").write_text(FILE + odd)
        assert main(words) == 2
        told = capsys.readouterr()
        assert "pendulum, runs," in told.out and said in told.err
    own = 'from discmech import scenes\nown = scenes.get("pendulum").with_values(name="pend")\n'
    for scene in ("own", '"mine.py:own"', '"pend"'):
        of = f'again = recorded("*.npz", order=2, scene={scene})\n'
        tmp_path.joinpath("mine.py").write_text(FILE + own + of)
        again = f"{words[1]}:again"
        assert main(["order", f"{words[1]}:own", "--rule", again, "--jobs", "1"]) == 0
        assert "pend" in capsys.readouterr().out
        assert main(["order", "pendulum", "--rule", again]) == 2
        assert "are runs of pend, not of pendulum" in capsys.readouterr().err
        assert main(words) == 0 and "pend, again, 16 digits" in capsys.readouterr().out
    save(tmp_path, x0=[1.0])
    tmp_path.joinpath("mine.py").write_text(FILE + "# again\n")
    assert main(words) == 2
    assert "no scene of discmech or of the file begins at" in capsys.readouterr().err
    assert main([*words, "--scene", "pendulum"]) == 0


def garbled(folder, change):
    """Runs of the trapezoidal rule to t = 4, whose rows (q, p) a function changes in place."""
    save(folder)
    runs = [dict(np.load(folder / f"run{k}.npz")) for k in range(5)]
    changed = [{name: held[name][: 40 * 2**k + 1].copy() for name in "tqp"}
               for k, held in enumerate(runs)]  # fmt: skip
    for k, held in enumerate(changed):
        change(held, runs[min(k + 1, 4)])
        np.savez(folder / f"run{k}.npz", **held)


def scaled(held, finer):
    held["q"][1:-1] *= 0.9
    held["p"][1:-1] *= 0.9


def a_row_late(held, finer):
    for name in "qp":
        held[name][2:-1] = held[name][1:-2].copy()


def smoothed(held, finer):
    for name in "qp":
        mean = np.convolve(held[name][:, 0], np.ones(5) / 5, "same")
        held[name][3:-3, 0] = mean[3:-3]


def every_second_of_the_finer(held, finer):
    for name in "qp":
        held[name][1:-1:2] = finer[name][2 : 2 * len(held[name]) - 3 : 4]


def noisy(held, finer):
    held["q"][1:-1, 0] += 0.1 * held["t"][1] ** 2 * np.sin(1000 * np.arange(len(held["t"]) - 2))


def of_another_clock(held, finer):
    t = held["t"]
    late = t + 0.3 * t[1] * np.sin(np.pi * t / t[-1])
    for name in "qp":
        held[name][:, 0] = np.interp(late, t, held[name][:, 0])


@pytest.mark.dear("scaled", "clock")
@pytest.mark.parametrize("change", [scaled, a_row_late, smoothed, every_second_of_the_finer, noisy,
                                    of_another_clock])  # fmt: skip
def test_rows_that_are_no_steps_of_one_method_never_pass(change, tmp_path):
    """The first and the last row are right, and the energy stays near the motion's."""
    garbled(tmp_path, change)
    rule = recorded([str(tmp_path / "*.npz")], 2, symplectic=True, keeps=("energy",))
    for study in ("order", "energy"):
        (case,) = check(study, ["pendulum"], [rule], digits=[16])["cases"]
        assert case["verdict"] in ("fail", "inconclusive"), study


@pytest.mark.parametrize(("size", "word"), [(1e-3, "is no step"), (1e-8, "was moved"),
                                            (1e-11, "was moved"), (0, "")])  # fmt: skip
def test_a_row_of_one_run_alone_is_named(size, word, tmp_path):
    def move(held, finer):
        if len(held["t"]) == 161:
            held["q"][70] += size

    garbled(tmp_path, move)
    steps = of_rows(Scheme(scenes.get("pendulum"), recorded(str(tmp_path / "*.npz"), 2)))
    assert steps.refused is bool(word) and word in steps.unknown
    assert not word or "of run2.npz (t = 1.7" in steps.unknown


@pytest.mark.parametrize(("change", "moved"), [
    ({40: 1, 41: -0.9}, 1), ({40: 1}, 0), (dict.fromkeys(range(40, 80), 1), 0), ({}, 0),
])  # fmt: skip
def test_a_moved_row_changes_two_defects_oppositely_and_no_other(change, moved):
    """One kick and a jump, as where a solver takes an iteration less, are no moved row."""
    defects = np.exp(np.arange(80) / 40)[:, None]
    defects[list(change), 0] += list(change.values())
    for order_of_differences in DIFFERENCES:
        by = [_moved_by(defects, first, order_of_differences) for first in range(34, 46)]
        assert max(by) == pytest.approx(moved, rel=1e-2)


@pytest.mark.parametrize(("rule", "levels", "coarser"), [("heun", 5, 4), ("runge-kutta-4", 4, 1)])
def test_runs_that_are_late_by_their_errors_and_those_near_round_off_are_steps(
    rule, levels, coarser, tmp_path
):
    """At one time the runs are at other places; near the apocentre, the defects are round-off."""
    save(tmp_path, rule, "kepler", levels, coarser=coarser)
    made = recorded(str(tmp_path / "*.npz"), 2 if rule == "heun" else 4)
    steps = of_rows(Scheme(scenes.get("kepler"), made))
    assert not steps.unknown and steps.order == made.order


@pytest.mark.parametrize(("rule", "every", "form"), [
    ("midpoint", 1, "{:.12g}"), ("trapezoidal", 20, "{:.9g}"), ("gauss-2", 5, "{:.17g}"),
])  # fmt: skip
def test_sound_rows_are_steps_however_they_are_written(rule, every, form, tmp_path):
    save(tmp_path, rule, every=every, form=form)
    made = recorded(str(tmp_path / "*.csv"), 4 if rule == "gauss-2" else 2)
    steps = of_rows(Scheme(scenes.get("pendulum"), made))
    assert steps is None or (not steps.unknown and steps.order == made.order)


@pytest.mark.slow
def test_few_long_rows_are_steps_of_their_order(tmp_path):
    """Errors cancel along a row, and the run with the fewest rows passes through small states."""
    save(tmp_path, levels=4, every=40)
    assert len(np.load(tmp_path / "run0.npz")["t"]) == 3
    steps = of_rows(Scheme(scenes.get("pendulum"), recorded(str(tmp_path / "*.npz"), 2)))
    assert steps.order == 2 and not steps.unknown


@pytest.mark.slow
def test_a_chaotic_motion_is_followed_as_far_as_it_is_known(tmp_path):
    """Errors at the end are all that the motion allows; the steps are of their order."""
    save(tmp_path, "gauss-2", "double-pendulum", 5)
    assert order(tmp_path, 4, "double-pendulum")["verdict"] in ("pass", "inconclusive")


def in_numbers(folder, x0):
    """A pendulum in numbers, and runs of Verlet's method on it to t = 1, with five rows each."""
    made = Scene(
        name="numeric-pendulum", groupoid=pair(1), x0=["1"], mu0=["0.3"], duration=1, step="0.05",
        numeric_hamiltonian=lambda q, p: p[0] ** 2 / 2 - np.cos(q[0]),
        gradient=lambda q, p: (np.sin(q), p),
    )  # fmt: skip
    for k in range(4):
        h, q, p = 0.05 / 2**k, np.array([x0]), np.array([0.3])
        rows = [(q, p)]
        for _ in range(20 * 2**k):
            p = p - h / 2 * np.sin(q)
            q = q + h * p
            p = p - h / 2 * np.sin(q)
            rows.append((q, p))
        qs, ps = map(np.array, zip(*rows[:: 5 * 2**k], strict=True))
        np.savez(folder / f"run{k}.npz", t=np.arange(5) / 4, q=qs, p=ps, h=np.full(5, h))
    return made


@pytest.mark.parametrize("x0", [1.0, 0.8])
def test_runs_on_a_scene_in_numbers_begin_at_a_momentum(x0, tmp_path):
    made = in_numbers(tmp_path, x0)
    scheme = Scheme(made, recorded(str(tmp_path / "*.npz"), 2))
    assert scheme.begins_there is (x0 == 1.0)
    assert [float(e) for e in (*scheme.scene.x0, *scheme.scene.mu0)] == pytest.approx([x0, 0.3])
    steps = of_rows(scheme)
    assert steps.order == 2 and not steps.unknown


def test_a_scene_is_not_that_of_runs_off_its_constraint_and_their_mistakes_are_told(tmp_path):
    for k, moved in enumerate((0, 0, 0, 1e-3)):
        t = np.arange(8 * 2**k + 1) / 2 ** (k + 3)
        q = 0.3 + t[:, None] * [1, 2]
        np.savez(tmp_path / f"run{k}.npz", t=t, q=q + moved, p=np.full_like(q, 0.1))
    pendulum = scenes.get("cartesian-pendulum")
    assert not recorded(str(tmp_path / "run[0-2].npz"), 2).begins_at(pendulum)
    with pytest.raises(BadInput, match="begin at different states"):
        recorded(str(tmp_path / "*.npz"), 2).begins_at(pendulum)


@pytest.mark.slow
@pytest.mark.parametrize("clock", [1.001, 1.01, 1.05])
def test_runs_of_another_motion_fail(clock, tmp_path):
    """Their energy is that of the scene, and still they do not pass it."""
    save(tmp_path)
    for k in range(5):
        with np.load(tmp_path / f"run{k}.npz") as file:
            held = dict(file)
        np.savez(tmp_path / f"run{k}.npz", t=held["t"] * clock, q=held["q"], p=held["p"])
    assert order(tmp_path)["verdict"] == "fail"
    rule = recorded([str(tmp_path / "*.npz")], 2, symplectic=True, keeps=("energy",))
    (case,) = check("energy", ["pendulum"], [rule], digits=[16])["cases"]
    assert case["verdict"] == "inconclusive" and "the motion is another" in case["reason"]

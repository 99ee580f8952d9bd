"""A run of any kind that is killed continues from its checkpoint, to the numbers of a whole run."""

from dataclasses import fields, replace

import numpy as np
import pytest
import sympy
from scipy.linalg import expm

from discmech import BadInput, Scheme, black_box, scenes
from discmech.integrators import rules
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.extensions.lattices.scenes.linkages import rods
from discmech.integrators.extensions.steps import vary
from discmech.integrators.runs import checkpoint
from tests.integrators.extensions.lattices.test_bodies_as_sites import SITES
from tests.integrators.extensions.lattices.test_lattices import SCATTERED, fput


class Killed(BaseException):
    """Ends a run where nothing can be saved any more."""


def radius(x, mu, p):
    return x[0] ** 2 + x[1] ** 2


def flow_of(scene, rule="midpoint", step=None, digits=16, edge="refuse", **how):
    rule = rules.get(rule) if isinstance(rule, str) else rule
    scene = scenes.get(scene) if isinstance(scene, str) else scene
    given = {"on_edge": edge} if edge != "refuse" else {}
    return Scheme(scene, rule).flow(step or scene.step, digits, **given, **how)


def reversible():
    return vary(rules.get("trapezoidal"), radius, "reversible")


@black_box(order=2)
def leapfrog(q, p, h, system):
    p = p + h / 2 * system.force(q, p)
    q = q + h * system.velocity(q, p)
    return q, p + h / 2 * system.force(q, p)


@black_box(order=1, numbers="any")
def euler(q, p, h, system):
    p = p + h * system.force(q, p)
    return q + h * system.velocity(q, p), p


def stiffening():
    """Masses with gaps, whose free steps are solved by Newton's method."""
    return replace(
        systems.fput(6, beta=9), name="stiffening", fixed_ends=False, restitution="1/2",
        bond_contact=lambda x, y, p: [y[0] - x[0] + sympy.Rational(1, 10)],
        x0=np.zeros((6, 1)), v0=np.linspace(1, -1, 6)[:, None],
    )  # fmt: skip


LISTED = {"bonds": SCATTERED, "parameters": {"alpha": "1/4", "mass": 2, "stiff": 1}, "fixed": [0]}
#: a first step of a rigid body, farther than half of a quarter turn
FAR = expm(np.array([[0, -1.2, 0.3], [1.2, 0, 0], [-0.3, 0, 0]]))
#: one flow of each kind: (flow, number of steps, every, its start)
FLOWS = {
    "Newton": (lambda: flow_of("heavy-top"), 40, 3),
    "50 digits": (lambda: flow_of("kepler", digits=50), 200, 7),
    "single": (lambda: flow_of("pendulum", digits=7), 200, 7),
    "fixed point": (lambda: flow_of("kepler", "gauss-3"), 40, 3),
    "fixed point, Newton": (lambda: flow_of("kepler", "gauss-4", "1"), 200, 7),
    "fixed point, 50 digits": (lambda: flow_of("heavy-top", "gauss-2", digits=50), 70, 7),
    "composition": (lambda: flow_of("kepler", "suzuki:trapezoidal"), 40, 1),
    "shrink": (lambda: flow_of("heavy-top", step=8, edge="shrink"), 40, 3),
    "bisect": (lambda: flow_of("moser-veselov", step=1, edge="bisect"), 40, 3, {"element0": FAR}),
    "constraints": (lambda: flow_of("suslov"), 40, 3),
    "one-step map": (lambda: flow_of("heavy-top", "rkmk-4"), 40, 3),
    "varied": (lambda: flow_of("kepler", reversible(), "1/20"), 40, 3),
    "varied, 50 digits": (lambda: flow_of("kepler", reversible(), "1/20", 50), 70, 7),
    "stepped": (lambda: flow_of("bouncing-ball", impacts="stepped"), 400, 3),
    "located": (lambda: flow_of("bouncing-ball", impacts="located"), 400, 3),
    "located, 30 digits": (lambda: flow_of("bouncing-ball", digits=30, impacts="located"), 60, 3),
    "sites": (lambda: Scheme(systems.rotors(6), rules.get("midpoint")).flow("1/20"), 40, 3),
    "sites, 30 digits": (
        lambda: Scheme(systems.rotors(4), rules.get("midpoint")).flow("1/20", 30), 20, 3
    ),
    "sites by stages": (lambda: Scheme(fput(), rules.get("gauss-3")).flow("1/20"), 40, 10),
    "sites by stages, listed": (lambda: Scheme(fput("list", **LISTED), rules.get("gauss-3"))
                                .flow("1/20"), 40, 10),
    "bodies by stages": (lambda: Scheme(SITES["group"](), rules.get("gauss-3")).flow("1/20"),
                         40, 10),
    "jointed sites": (lambda: Scheme(rods(3), rules.get("trapezoidal")).flow("1/50"), 20, 5),
    "jointed sites, 50 digits": (
        lambda: Scheme(rods(3), rules.get("trapezoidal")).flow("1/50", 50), 20, 5
    ),
    "degenerate": (lambda: flow_of("vortex-pair", "projected-gauss-1"), 40, 3),
    "sites with contact": (
        lambda: Scheme(systems.bead_chain(8), rules.get("midpoint")).flow("1/50"), 40, 3
    ),
    "program": (lambda: flow_of("kepler", leapfrog), 40, 3),
    "program, 30 digits": (lambda: flow_of("pendulum", euler, digits=30), 40, 3),
    "program in time": (lambda: flow_of("kapitza-pendulum", leapfrog), 40, 3),
    "sites with contact, stiffening": (
        lambda: Scheme(stiffening(), rules.get("midpoint")).flow("1/10"), 60, 3
    ),
}  # fmt: skip


QUICK = ("Newton", "50 digits", "shrink", "located", "program", "sites by stages",
         "jointed sites, 50 digits")  # fmt: skip


@pytest.fixture(autouse=True)
def often(monkeypatch):
    """A state after every stretch, and stretches of a few steps."""
    from discmech.integrators.extensions.contact import contact_flow
    from discmech.integrators.extensions.foreign import box_motion
    from discmech.integrators.flows import free_motion

    monkeypatch.setattr(box_motion, "CHUNK", 5)
    monkeypatch.setattr(checkpoint, "SECONDS", 0)
    monkeypatch.setattr(free_motion, "CHUNK", 5)
    monkeypatch.setattr(contact_flow, "MOST_AT_ONCE", 8)


def written(run):
    """All that a run tells, as text and bytes."""
    found = {f.name: getattr(run, f.name) for f in fields(run) if f.name != "scheme"}
    for name, value in [*found.items()]:
        if hasattr(value, "__dataclass_fields__"):
            del found[name]
            found |= {f"{name} {word}": part for word, part in vars(value).items()}
    return {name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in found.items()}  # fmt: skip


@pytest.mark.dear(but=("[Newton]", "[located]", "[program]", "[sites by stages]",
                       "jointed sites, 50"))  # fmt: skip
@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=() if kind in QUICK else pytest.mark.slow) for kind in FLOWS]
)
def test_a_killed_run_continues_to_the_same_numbers(tmp_path, kind):
    make, steps, every, *given = FLOWS[kind]
    start = given[0] if given else {}
    draw, seen = np.random.default_rng(sum(map(ord, kind))), []
    whole = make().trajectory(steps, every, **start, progress=seen.append)
    stops = sorted(draw.choice(seen[:-1], min(3, len(seen) - 1), replace=False).tolist())
    assert stops
    for stop in stops:

        def killed(done, stop=stop):
            if done >= stop:
                raise Killed

        with pytest.raises(Killed):
            make().trajectory(steps, every, **start, checkpoint=tmp_path / "run", progress=killed)
    later = []
    for _ in range(2):  # the second time nothing is left to do
        done = len(later)
        run = make().trajectory(
            steps, every, **start, checkpoint=tmp_path / "run", progress=later.append
        )
        assert written(run) == written(whole)
    assert min(later) > max(stops) and done == len(later)


def test_the_checkpoint_of_another_run_is_refused(tmp_path):
    scene, file = scenes.get("kepler"), tmp_path / "run"
    flow = flow_of(scene)
    flow.trajectory(20, checkpoint=file)
    other = scene.with_values(parameters={name: 2 for name in scene.parameters})
    for run in (
        lambda: flow.trajectory(21, checkpoint=file),
        lambda: flow.trajectory(20, 2, checkpoint=file),
        lambda: flow.trajectory(20, x0=[1, 1], mu0=[0, 1], checkpoint=file),
        lambda: flow.trajectory(20, t0=1, checkpoint=file),
        lambda: flow_of(scene, digits=20).trajectory(20, checkpoint=file),
        lambda: flow_of(scene, "trapezoidal").trajectory(20, checkpoint=file),
        lambda: flow_of(scene, step="1/7").trajectory(20, checkpoint=file),
        lambda: flow_of(scene, edge="shrink").trajectory(20, checkpoint=file),
        lambda: flow_of(other).trajectory(20, checkpoint=file),
    ):
        with pytest.raises(BadInput, match="checkpoint of another run"):
            run()


@pytest.mark.parametrize("kind", ["Newton", "50 digits", "fixed point", "constraints", "varied"])
def test_rows_that_are_not_there_or_not_its_own_are_refused(kind, tmp_path):
    """They were said not to fit into memory."""
    flow = FLOWS[kind][0]()
    flow.trajectory(3, checkpoint=tmp_path / "run")
    (tmp_path / "run.u.npy").unlink()
    with pytest.raises(BadInput, match=r"run\.u\.npy of the checkpoint are gone or damaged"):
        flow.trajectory(3, checkpoint=tmp_path / "run")
    (tmp_path / "other.mu.npy").write_text("mine")
    with pytest.raises(BadInput, match=r"would overwrite .*other\.mu\.npy"):
        flow.trajectory(3, checkpoint=tmp_path / "other")


def test_gaps_and_restitution_belong_to_a_run(tmp_path):
    ball, file = scenes.get("bouncing-ball"), tmp_path / "run"
    flow_of(ball).trajectory(20, checkpoint=file)
    for other in (
        replace(ball, restitution="1/3"),
        replace(ball, contact=lambda x, p: [x[-1] + 1]),
        replace(ball, impacts="located" if ball.impacts == "stepped" else "stepped"),
    ):
        with pytest.raises(BadInput, match="checkpoint of another run"):
            flow_of(other).trajectory(20, checkpoint=file)


def test_parameters_that_only_gaps_or_the_time_use_belong_to_a_run(tmp_path):
    def beads(gap, rate):
        lattice = replace(
            stiffening(), name="beads", parameters={"gap": gap, "rate": rate},
            on_site=lambda x, v, p, t: v[0] ** 2 / 2 + sympy.sin(p.rate * t) * x[0],
            on_bond=lambda x, y, p: 0, bond_contact=lambda x, y, p: [y[0] - x[0] + p.gap],
        )  # fmt: skip
        return Scheme(lattice, rules.get("trapezoidal")).flow("1/10")

    beads(1, 1).trajectory(3, checkpoint=tmp_path / "run")
    for gap, rate in ((2, 1), (1, 2)):
        with pytest.raises(BadInput, match="checkpoint of another run"):
            beads(gap, rate).trajectory(3, checkpoint=tmp_path / "run")


def test_a_program_that_is_more_than_its_text_and_the_state_has_no_checkpoint(tmp_path):
    @black_box(order=2)
    class Remembers:
        def start(self, q, p, h):
            return q, p

        def step(self, state, h):
            return state

        def read(self, state):
            return state

    counts = [0]

    @black_box(order=1)
    def counting(q, p, h):
        counts[0] += 1
        return q + h * p, p - h * counts[0] * q

    @black_box(order=1)
    def by_chance(q, p, h):
        return q + h * np.random.random() * p, p

    flow = flow_of("pendulum", Remembers)
    with pytest.raises(BadInput, match="needs more than the state: leave checkpoint"):
        flow.trajectory(3, checkpoint=tmp_path / "run")
    with pytest.raises(BadInput, match="by random: leave checkpoint"):
        flow_of("pendulum", by_chance).trajectory(3, checkpoint=tmp_path / "run")
    with pytest.raises(BadInput, match="its steps change what it reads"):
        flow_of("pendulum", counting).trajectory(3, checkpoint=tmp_path / "run")


def test_starts_that_differ_in_the_last_digits_are_two_runs_of_a_program(tmp_path):
    flow = flow_of("pendulum", euler, digits=50)
    flow.trajectory(3, x0=[1], mu0=[0], checkpoint=tmp_path / "run")
    with pytest.raises(BadInput, match="checkpoint of another run"):
        flow.trajectory(3, x0=[1 + sympy.Rational(1, 10**30)], mu0=[0], checkpoint=tmp_path / "run")


@pytest.mark.parametrize(
    "kind",
    ["Newton", "varied", "located", "sites", "sites with contact", "program", "program in time"],
)
def test_members_of_an_ensemble_are_runs_with_files_of_their_own(tmp_path, kind):
    flow = FLOWS[kind][0]()
    run = flow.trajectory(6, 2)
    kept = flow.ensemble(run.base, run.mu, steps=9, checkpoint=tmp_path / "run")
    for k in range(4):
        alone = flow.trajectory(9, x0=run.base[k], mu0=run.mu[k])
        for rows, member in ((kept.x, alone.x), (kept.u, alone.u), (kept.mu, alone.mu)):
            assert np.array_equal(rows[k], member)
    assert len([*tmp_path.glob("run.*.x.npy")]) == 4

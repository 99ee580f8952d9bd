"""`discmech explain SCENE RULE`: a method on a scene, on one page of a terminal."""

from __future__ import annotations

import argparse
import sys
import textwrap
from typing import TYPE_CHECKING, Any

from discmech.integrators.errors import BadInput, arguments_checked

from ..core import lookup
from .options import RULE_HELP, scene_asked
from .output import DERIVED, progress_shown

if TYPE_CHECKING:
    from discmech.integrators import Discretisation, Scene, Scheme

WIDTH = 100
MOST_ROWS, FEW = 8, 2  # more equations than this are represented by a few
LONGEST = 500  # longest side of an equation in letters; the report shows it in full
STEPS = 200  # steps of the run that counts Newton's corrections
CONTACT_STEPS = 20  # steps of the timed run with contact, which compiles nothing


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "explain", help="a method on a scene: its equations, order, symmetry, cost of a step"
    )
    parser.add_argument("scene")
    parser.add_argument("rule", help=RULE_HELP)
    parser.add_argument("--retraction", metavar="NAME")
    parser.set_defaults(action=_explain)


def _explain(options: argparse.Namespace) -> int:
    from discmech.integrators import Scheme

    with progress_shown("deriving") as show:
        show("deriving", 0.0)
        scheme = Scheme(scene_asked(options), lookup.rule(options.rule))
        show("writing and compiling", DERIVED)
        page = explanation(scheme)
    sys.stdout.write(page)
    return 0


@arguments_checked
def explain(scene: Scene | str, rule: Discretisation | str) -> str:
    """Return a page of text about a method on a scene: `print(explain(scene, rule))`.

    It has the Lagrangian, discrete Lagrangian, momenta, equations, order, self-adjointness, the
    savings of a step and its measured cost. Scene and rule are objects or names. Raises `BadInput`
    like `Scheme`.
    """
    from discmech.integrators import Scheme

    return explanation(Scheme(lookup.scene(scene), lookup.rule(rule)))


def explanation(scheme: Scheme) -> str:
    """Return the page of a scheme; raises `BadInput` for a program, which has no equations."""
    if not scheme.rule.is_formula:
        raise BadInput(
            f"{scheme.rule.name} is a program, so there are no equations to show: "
            "`discmech verify` says what it is worth."
        )
    return "".join(f"{line.rstrip()}\n" for line in _lines(scheme))


def _lines(scheme: Scheme) -> list[str]:
    from ..report.wording import CONSTRAINED
    from .equations import notation, plain_text, subscript, written

    scene, rule = scheme.scene, scheme.rule
    title = f"{scene.name} by {rule.name}"
    where = f"groupoid {scene.groupoid.name}, dim x {scene.groupoid.dim_x}, "
    where += f"dim u {scene.groupoid.dim_u}"
    where += f", retraction {scene.groupoid.retraction}" if scene.groupoid.retraction else ""
    lines = [title, "=" * len(title), where]
    method = ["", "Method", *(f"  {line}" for line in (*_facts(scheme), *_work(scheme)))]
    if scheme.equations.discrete is None:
        said = f"A one-step map on the dual algebroid, without a discrete Lagrangian: {rule.source}"
        return [*lines, *textwrap.wrap(said, WIDTH), *_contact(scheme), *method]
    most = None if len(scheme.s.u) <= MOST_ROWS else FEW
    out = written(scheme, most)
    others = [f"  … and so on; discmech report {scene.name} typesets all"] if most else []

    def formula(left: str, terms: Any) -> list[str]:
        shown = plain_text(terms, out.letters)
        left = left if len(left) <= LONGEST else f"({len(left)} letters)"
        if len(shown) > LONGEST:
            shown = f"({len(shown)} letters; discmech report {scene.name} typesets them)"
        return wrapped(f"{left} = {shown}")

    lines += textwrap.wrap(notation(scheme), WIDTH)
    if out.lagrangian:
        time = ", t" if scheme.scene.timed else ""
        lines += ["", "Lagrangian", *formula(f"l(x, u{time})", out.lagrangian)]
    for head, rows in (("Force", out.force), ("Constraints", out.constraints)):
        lines += ["", head] if rows else []
        for number, terms in enumerate(rows, 1):
            force = subscript(f"f_{number}") if len(rows) > 1 else "f"
            lines += formula(force if rows is out.force else "0", terms)
    lines += _contact(scheme)
    staged = bool(len(scheme.s.stages))
    left = "L_d(x, u, s)" if staged else "L_d(x, u)"
    lines += ["", "Discrete Lagrangian", *formula(left, out.discrete_lagrangian)]
    for letter, terms in out.points:
        lines += formula(plain_text([letter], out.letters), terms)
    lines += others if out.points else []
    before, after = "μ = F⁻(x, u)/h", "F⁺(x, u)/h = F⁻(y, v)/h"
    head = "Discrete Euler–Lagrange equations"
    if staged:  # their derivatives would fill pages
        said = f"∂L_d/∂s = 0; {before}; {after}"
        return [*lines, "", "Stages and momenta, by derivatives of that sum", f"  {said}", *method]
    if out.constraints:
        (before, after), head = CONSTRAINED, "Momentum after the step"
    lines += ["", f"Momentum before the step, {before}"]
    for mu, terms in out.momenta:
        lines += formula(plain_text(mu, out.letters), terms)
    lines += others
    for letter, value in out.shared:
        lines += formula(plain_text([letter], out.letters), [value])
    lines += ["", f"{head}, {after}"]
    for here, there in out.residual:
        lines += formula(plain_text(here, out.letters), there)
    return [*lines, *others, *method]


def _contact(scheme: Scheme) -> list[str]:
    """Return lines on the gaps of a scene with contact, and on impacts; [] without contact."""
    from discmech.integrators.extensions.contact import gap_expressions

    from .equations import letters_of, plain_text

    scene = scheme.scene
    if scene.contact is None:
        return []
    lines, letters = ["", "Contact"], letters_of(scheme)
    for gap, plane in zip(*gap_expressions(scheme.equations.s, scene.contact), strict=True):
        said = f"0 ≤ {plain_text([gap], letters)}"
        if plane is not None:
            said += f", slips along {', '.join(plain_text([e], letters) for e in plane)}"
        lines += wrapped(said)
    coefficients = scene.friction if isinstance(scene.friction, tuple) else (scene.friction,)
    friction = ", ".join(map(str, coefficients))
    return [
        *lines,
        f"  friction {friction}, restitution {scene.restitution}, impacts {scene.impacts}",
    ]


def wrapped(formula: str) -> list[str]:
    """Return a formula in lines of a terminal, indented."""
    return textwrap.wrap(
        formula, WIDTH, initial_indent="  ", subsequent_indent="      ",
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip


def _facts(scheme: Scheme) -> list[str]:
    """Return lines on order and symmetry."""
    rule, order = scheme.rule, scheme.order
    said = "only measured: the rule declares none"
    if order is not None:
        said = f"{order}, as the rule declares"
        if order != rule.order:
            said = f"{order} on this scene (the rule declares {rule.order})"
    if rule.effective is not None:
        said += f"; {rule.effective} once it is processed, as the rule declares"
    is_adjoint = "" if scheme.self_adjoint else "not "
    lines = [f"order          {said}", f"symmetry       {is_adjoint}self-adjoint (derived)"]
    return lines + _leading(scheme)


def _leading(scheme: Scheme) -> list[str]:
    """Return the line on the leading error of a rule on a pair groupoid, where it is known."""
    from discmech.integrators.errors import CannotMeasure

    from ..proof.leading import TERMS, of_rule

    rule, scene = scheme.rule, scheme.scene
    free = not (scene.all_constraints or scene.force or scene.timed or scene.contact)
    if not (scene.groupoid.canonical and free and scheme.has_arrows and not rule.splits):
        return []
    if TERMS.get(rule.order or 0, ("",))[0] == "quadratic" and not _is_separable(scheme):
        return []  # on other scenes there are more terms
    try:
        terms = " + ".join(f"({c}) {name}" for name, c in of_rule(rule).items())
    except (CannotMeasure, ArithmeticError, BadInput):  # one that needs this very scene
        return []
    power = (rule.order or 0) + 1
    return [f"leading error  L_d − exact = h^{power} ({terms}) + …"] if terms else []


def _is_separable(scheme: Scheme) -> bool:
    """True if L = v·Mv/2 − V(x): ∂L/∂v is linear in v, and contains no x."""
    from discmech.integrators.equations import momentum
    from discmech.integrators.numbers import jacobian

    s = scheme.s
    p = momentum(s)
    slope = jacobian(p, s.u)
    return not {*s.x} & p.free_symbols and not {*s.u} & slope.free_symbols


def _work(scheme: Scheme) -> list[str]:
    """Return lines on the solution of a step and its cost."""
    from discmech.integrators.compiler import SAVINGS
    from discmech.integrators.errors import CannotMeasure, StepFailure

    from ..work_precision.kernel_work import operations, savings_made
    from ..work_precision.racing import race

    flow = scheme.flow(scheme.scene.step)
    made = savings_made(flow)
    unknowns = len(flow.system.w)
    how = "one linear solve" if made["direct"] else "Newton's iteration"
    if scheme.equations.explicit:
        how = "no equation: the map is explicit"
    if flow.stages is not None:
        how = "a fixed point (Newton where that does not contract)"
    lines = [f"unknowns       {unknowns} a step, by {how}"]
    lines += [f"left out       {words}" for name, words in SAVINGS.items() if made[name]]
    touching = scheme.scene.contact is not None
    try:
        run = flow.trajectory(CONTACT_STEPS if touching else STEPS)
    except StepFailure as failure:
        return [*lines, f"cost           not counted: {failure.cause} at step {failure.step_index}"]
    corrections = run.newton_mean
    steps = CONTACT_STEPS if touching else 20 * STEPS
    (timing,) = race([lambda: flow.trajectory(steps, steps)], 0.3)
    cost = f"{timing.median / steps * 1e6:.3g} µs"
    step = float(scheme.scene.step)
    if touching:
        return [*lines, f"cost           {cost} a step of {step:g}, of the first {steps}"]
    try:
        if flow.stages is not None:
            raise CannotMeasure("the operations are those of Newton's kernels")
        solve, update = operations(flow)
        cost = f"{solve * corrections + update:.0f} operations, {cost}"
    except CannotMeasure:
        pass
    return [*lines, f"cost           {cost} a step of {step:g}, {corrections:.2f} corrections"]

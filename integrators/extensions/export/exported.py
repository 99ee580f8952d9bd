"""What an exported file holds, whatever its language: constants, the state's fields, functions.

The functions are the drivers of the bench with the scheme's own kernels, as its flow compiles them,
and the shell of `scene_stepping`, written by `specialised`.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import prod
from pathlib import Path
from textwrap import wrap
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...compiler import (
    Entry,
    KernelText,
    Step,
    kernel_text,
    kinds_of,
    names_of,
    text_of_stages,
    texts_of,
)
from ...compiler.lanes import lane_namespace, tables
from ...equations import closed_velocity, energy, mass_matrix, momentum, rates, stage_source
from ...errors import CannotMeasure
from ...numbers import Double, numeric_text
from ...scene import entries_of
from .specialised import Specialised
from .written import Joined, Nowhere, Registers

#: what a status says; also the constants' names
STATUSES = {
    "OK": "the step was done", "NOT_CONVERGED": "Newton's method did not converge",
    "SINGULAR": "a correction is infinite or no number", "EDGE":
    "the step is at or beyond the edge of its chart", "STRAYED":
    "the step is on another branch of solutions than the one before",
    "GAVE_WAY": "corrections site by site do not fade: take a smaller step",
}  # fmt: skip
EPS, LARGE = 2.0**-53, 1e300
WIDTH = 92  # of the lines of a file's page of comments
HERE = Path(__file__).parent
#: functions that scenes and lattices have
STEPS = (
    "steps_done(s: State, h: float, steps: int) -> int:",
    "one_step(s: State, h: float) -> int:",
    "rows_of_run(s: State, h: float, steps: int, every: int, xs: Out, mus: Out) -> int:",
)
#: text for the stages' kernels
PREPARING = """
def prepare_stages(s):
    save(s.stage_c[0], 0, RULE.prepare(load(s.q, slice(0, WIDE))))
"""
MOST_SITES = 64  # of a lattice: each is written out, and a compiler takes minutes for more


@dataclass(frozen=True)
class Parameter:
    """A parameter of the scene: its name, its shape, () or (k,) or (k, l), and its values."""

    name: str
    shape: tuple[int, ...]
    values: tuple[float, ...]


def exportable(scheme: Any, loops: bool = True) -> Any:
    """Return the scheme that a file holds: itself, or the scene of a small lattice.

    loops: True if the language has a lattice's loops over sites. Constraints of bonds, and bonds
    whose equations need a sparse factorisation, are solved as those of one scene. Raises
    `CannotMeasure` for what no file can hold.
    """
    from ...flows import Scheme
    from ..lattices import LatticeScheme, scene_of

    lattice = getattr(scheme, "lattice", None)
    scene = getattr(scheme, "scene", lattice)
    name, rule = getattr(scene, "name", str(scheme)), getattr(scheme, "rule", None)
    what = ""
    if rule is not None and not rule.is_formula:
        what = f"{rule.name} is a program, which is code already"
    elif getattr(scene, "has_contact", False):
        what = f"{name} has contact, whose impacts are searched in each step"
    elif type(scheme) not in (Scheme, LatticeScheme) or scene is None:
        what = f"{name} is made by loops of its own (a control, steps that vary)"
    elif lattice is not None:
        why = "" if loops else "this language has no loops over sites"
        if scheme.constraints:
            why = "its bonds have constraints"
        elif loops and not scheme.local and lattice.shape == "list" and not _relaxes(scheme):
            why = "its bonds need a sparse factorisation"
        if not why:
            return scheme
        if lattice.sites <= MOST_SITES:
            return Scheme(scene_of(lattice), rule)
        what = f"{name} has {lattice.sites} sites, and {why}, so a file writes at most {MOST_SITES}"
    if what:
        raise CannotMeasure(
            f"{what}, so it cannot be exported: a scene or a lattice without contact, by a rule, a "
            "composition or a one-step map can."
        )
    return scheme


def _relaxes(scheme: Any) -> bool:
    """Return True if a lattice's first step is solved site by site."""
    from ..lattices.lattice_run import LatticeRun

    flow = scheme.flow(scheme.lattice.step)
    run = LatticeRun(flow, *flow.own_start)
    return run.by_stages or (run.sparse is not None and run.sparse.relaxing)


class Exported:
    """A scene as data for the writers; raises `CannotMeasure` if no file can hold it.

    lanes: the nodes of a collocation are filled up to a multiple of it; 0: Newton's method alone.
    """

    def __init__(self, scheme: Any, lanes: int) -> None:
        self.lanes = lanes
        self.scheme, self.scene, self.s = scheme, scheme.scene, scheme.equations.s
        self.flow = scheme.flow(self.scene.step)
        self.step: Step = self.flow.system
        parts, whole = self.flow.parts, Fraction(self.flow.step)
        self.shares = [float(Fraction(part.step) / whole) for part in parts]
        base = self.flow.context.equations
        self.kinds = [int(part.equations is not base) for part in parts]
        self.timed, self.first = bool(self.s.clocked), 1 + len(self.s.parameter_list)
        self.text = kernel_text(self.step)
        own = names_of(self.text, Double())
        self.layout = own["LAYOUT"]
        self.affine = [bool(e.affine) for e in own["SYSTEMS"]]
        #: the numbers of the rule, behind the parameters in q; where a group's Newton starts
        self.of_rule = [float(e) for e in self.flow.context.q[self.first :]]
        v0 = self.flow.starting.own.guess[: len(self.s.mu)] if (
            self.scheme.equations.arrows is not None) else self.scene.v0  # fmt: skip
        self.v0 = [float(e) for e in v0]

    @cached_property
    def start(self) -> tuple[list[float], list[float]]:
        """x, with the time, and μ of the scene's own start."""
        own = self.flow.starting.own
        return [float(e) for e in own.x], [float(e) for e in own.mu]

    @cached_property
    def _letters(self) -> dict[str, Any]:
        s = self.s
        return {"x": s.x, "v": s.u, "mu": s.mu, "q": [s.h, *s.parameter_list]}

    @cached_property
    def has_energy(self) -> bool:
        """True if the scene has an energy: a Lagrangian or a Hamiltonian."""
        return self.scene.has_lagrangian or self.scene.hamiltonian is not None

    @cached_property
    def speed(self) -> KernelText | None:
        """The correction of a velocity with μ = ∂l/∂ξ; None where a Hamiltonian gives it."""
        s = self.s
        if s.hamiltonian is not None or not self.scene.has_lagrangian:
            return None
        step = Step(
            name=s.name, q=tuple(s.q), x=tuple(s.x), u=tuple(s.u), w=tuple(s.u), mu=tuple(s.mu),
            y=(), rows=list(momentum(s)), slope=mass_matrix(s).tolist(), increment=[], gain=[],
            kinds=kinds_of(("velocity", s.u)),
        )  # fmt: skip
        kernel = KernelText(step, "_of_speed", {"carried"}, parts=("solver", "prepare"))
        _ = kernel.text  # writing finds the coefficients
        return kernel

    @cached_property
    def formulas(self) -> dict[str, str]:
        """The texts of energy, momenta, rates and of a velocity in closed form, by name."""
        expressions = dict[str, Sequence[Any]]()
        if self.has_energy:
            expressions["energy_at"] = [energy(self.s)]
        if self.conserved:
            expressions["momenta_at"] = [e for _, e in self.conserved]
        if self.needs_rates:
            expressions["rates_at"] = list(rates(self.s))
        if self.needs_speed and self.speed is None:
            speed = closed_velocity(self.s)
            assert speed is not None  # a Hamiltonian gives it
            expressions["speed_at"] = list(speed)
        texts = {name: numeric_text(self._letters, [e]) for name, e in expressions.items()}
        return {k: re.sub(r"return array\(\[(.*)\], \d+\)$", r"return (\1,)", e).replace(
            "def function(", f"def {k}(") for k, e in texts.items()}  # fmt: skip

    @cached_property
    def needs_speed(self) -> bool:
        """True if the velocity of a state is asked for, by the energy or by the first guess."""
        return self.speed is not None or any("s.v" in e or "rates" in e for e in self.guess)

    @property
    def quantities(self) -> tuple[str, ...]:
        """The names of the momenta, entry by entry."""
        return tuple(name for name, _ in self.conserved)

    @cached_property
    def conserved(self) -> list[tuple[str, Any]]:
        """(name, expression) of the scene's quantities, entry by entry."""
        quantities = list[tuple[str, Any]]()
        for quantity in self.scene.symmetries:
            if quantity.of_step or quantity.attitude:
                continue
            entries = entries_of(self.s.conserved(quantity))
            names = [quantity.name] if len(entries) == 1 else [
                f"{quantity.name} {i}" for i in range(len(entries))]  # fmt: skip
            quantities += zip(names, entries, strict=True)
        return quantities

    @cached_property
    def needs_rates(self) -> bool:
        """True if Newton's method starts from the vector field: slopes are unknowns."""
        arrows = self.scheme.equations.arrows is not None
        return self.layout.iterated and not arrows and "slope" in self.step.kinds

    @cached_property
    def guess(self) -> list[str]:
        """Where each unknown starts: the scene's velocity, or what a state's vector field gives."""
        m, size = len(self.s.mu), len(self.s.x) + len(self.s.mu)
        guess, seen = [], dict[str, int]()
        arrows = self.scheme.equations.arrows is not None
        for i, kind in enumerate(self.step.kinds or ["velocity"] * len(self.step.w)):
            at = seen[kind] = seen.get(kind, -1) + 1
            of_state = {"velocity": f"s.v[{at % m}]", "slope": f"s.rates[{at % size}]",
                        "place": f"s.x[{at}] / s.q[0]"}  # fmt: skip
            of_scene = f"V0[{i}]" if i < m else "0.0"
            guess.append(of_scene if arrows else of_state.get(kind, "0.0"))
        return guess if self.layout.iterated else ["0.0"] * len(guess)

    def _first_guess(self, state: Any) -> Any:
        of = self.module.names.__getitem__
        x, mu, q = of("here")(state)
        v = of("speed")(x, mu, q) if self.needs_speed else mu
        record = SimpleNamespace(x=x, v=v, q=q)
        if self.needs_rates:
            record.rates = of("rates_at")(x, v, mu, q)
        return tuple(eval(e, {"s": record, "V0": self.v0}) for e in self.guess)

    @cached_property
    def module(self) -> Specialised:
        """The text of the rule, of velocities and quantities, and of the shell."""
        speed, several = self.speed, len(self.shares) > 1
        of_speed = "affine=False, prepare=None, solver=speed_at" if speed is None else (
            f"affine={speed.affine}, prepare=prepare_of_speed, solver=solver_of_speed")  # fmt: skip
        facts = [
            f"STAGED, CLOSED, SPEED = {self.stages is not None}, {speed is None}, "
            + (f"Record({of_speed})" if self.needs_speed else "None"),
            f"OF_RULE, V0 = {tuple(self.of_rule)}, {tuple(self.v0)}",
            f"FIRST, WIDE = {self.first}, {len(self.s.q)}",
            f"FIRST_RULE = {'ADJOINT' if self.kinds[0] else 'RULE'}",
            *([] if several else ["SUBSTEPS, SHARES, KINDS = 1, (1.0,), (0,)"]),
        ]
        parts = [self.text, *([] if speed is None else [speed.text]), *self.formulas.values()]
        parts += ["\n".join(facts), texts_of(HERE / "scene_stepping", HERE / "stepping")]
        known = {*STATUSES, *([] if several else ["SUBSTEPS", "SHARES", "KINDS"])}
        named = {k: v for k, v in self.constants.items() if k not in known}
        return Specialised(
            "\n\n".join(parts), {"first_guess": self._first_guess}, self.fields, named
        )

    @cached_property
    def stages(self) -> Specialised | None:
        """The text of a step's stages, if the flow solves them by a fixed point."""
        if not self.lanes or self.flow.stages is None:
            return None
        nodes = self.flow.context.equations.rule.nodes
        source = stage_source(self.flow.context.equations.s, nodes)
        names = lane_namespace(nodes.count, Double(), -(-nodes.count // self.lanes) * self.lanes)
        text = text_of_stages(source.derived())
        numbers = tables(nodes, nodes.count, names["WIDTH"], Double())
        text = f"{text}\n\nWIDE = {len(self.s.q)}\n\n{PREPARING}"
        stages = Specialised(text, {**names, **numbers}, {}, {}, names["WIDTH"])
        used = {e: numbers[e] for e in re.findall(r"\b[A-Z_]+\b", text) if e in numbers}
        stages.constants = {**self._numbers, **used}
        return stages

    def _drive(self, module: Specialised, memory: str) -> Any:
        """Return what writes a driver; memory: the field of what it remembers."""

        def write(of: Any, s: Any, steps: Any) -> Any:
            layout, branched = module.names["LAYOUT"], module.names["RULE"].branched
            state = Joined([(layout.n, s.x), (layout.m, s.mu), (layout.n + layout.m, s.lost),
                            (layout.reused, s.k), (0, getattr(s, memory))])  # fmt: skip
            totals = Registers(module.routine, {
                Entry.REACH: module.names["REACH"], Entry.SLACK: module.names["SLACK"],
                Entry.BRANCH: s.branch if branched else module.names["HUGE"]})  # fmt: skip
            c, kinds = s.c if memory == "memory" else s.stage_c, self.module.names["KINDS"]
            s.done[0], status = of("advance")(
                state, c, kinds, len(self.shares), 0, steps, 1, *[Nowhere()] * 4, totals
            )
            return status

        return write

    @cached_property
    def functions(self) -> list[ast.FunctionDef]:
        """The functions of a file, each after those that it calls."""
        module, stages, made = self.module, self.stages, dict[str, ast.FunctionDef]()
        state = "(s: State) -> None:"
        if stages is not None:
            stages.fields, drive = self.fields, self._drive(stages, "stages")
            stages.function("def drive_stages(s: State, steps: int) -> int:", drive,
                            "Do steps by sweeps over the stages.")  # fmt: skip
            stages.function(f"def prepare_stages{state}")
            made |= stages.made
            module.knows(made["drive_stages"], made["prepare_stages"])
            module.function(f"def forget_stages{state}")
        module.function("def drive(s: State, steps: int) -> int:", self._drive(module, "memory"),
                        "Do steps by Newton's method.")  # fmt: skip
        for head, there in (
            (f"seed{state}", self.layout.iterated), (f"undo{state}", True), (f"start{state}", True),
            ("begin_steps(s: State, h: float) -> None:", True), *((head, True) for head in STEPS),
            ("energy(s: State) -> float:", self.has_energy),
            ("momenta(s: State, values: Out) -> None:", self.conserved),
            ("multipliers(s: State, values: Out) -> None:",
             self.layout.iterated and self.step.multipliers),
        ):  # fmt: skip
            if there:
                module.function(f"def {head}")
        return [*(made | module.made).values()]

    @cached_property
    def parameters(self) -> list[Parameter]:
        """The scene's parameters with their values."""
        values, entries = iter(float(e) for e in self.scene.parameter_values), []
        for name, letters in vars(self.s.parameters).items():
            shape: tuple[int, ...] = tuple(map(int, getattr(letters, "shape", ())))
            shape = shape[:1] if shape[1:] == (1,) else shape
            entries.append(Parameter(name, shape, tuple(next(values) for _ in range(prod(shape)))))
        return entries

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        step, edge = self.step, self.flow.edge
        hidden = {"slope", "impulse"} & {*step.kinds}
        return {
            "EPS": EPS, "ROOT_EPS": 2.0**-26, "HUGE": LARGE, "LARGE": LARGE, "DECAY": 0.999,
            "MARGIN": 8.0, "FAINT": 64 * EPS * (EPS if hidden else 1.0),
            "REACH": float(edge.reach),
            "SLACK": float(edge.slack) if step.branch is not None else LARGE,
        }  # fmt: skip

    @cached_property
    def constants(self) -> dict[str, Any]:
        """The numbers of a file by their names."""
        layout = self.layout
        return {
            **{e: i for i, e in enumerate(STATUSES)}, **self._numbers,
            "N": layout.n, "M": layout.m, "LOST": layout.n + layout.m, "SOLVED": layout.solved,
            "MULTIPLIERS": layout.multipliers, "SUBSTEPS": len(self.shares), "KINDS": self.kinds,
            "SHARES": self.shares, **(self.stages.constants if self.stages else {}),
        }  # fmt: skip

    @cached_property
    def fields(self) -> dict[str, tuple[str, tuple[int, ...]]]:
        """Name → (kind, lengths) of the state's fields: what a step leaves for the next."""
        layout, j = self.layout, len(self.shares)
        numbers = {
            "x": layout.n, "mu": layout.m, "q": len(self.s.q), "lost": layout.n + layout.m,
            "k": layout.reused, "memory": j * layout.row,
        }  # fmt: skip
        fields: dict[str, Any] = {k: ("float", (e,)) for k, e in numbers.items()}
        fields |= {"c": ("float", (j, layout.width)), "h": ("float", ()), "branch": ("float", ())}
        fields |= {e: ("int", ()) for e in ("fresh", "done", "by_newton", "stretch")}
        if self.stages is not None:
            at = self.stages.names["LAYOUT"]
            fields |= {"stages": ("float", (at.row,)), "stage_c": ("float", (1, at.width))}
        return fields


def used_fields(model: Any) -> dict[str, tuple[str, int | None]]:
    """Return name → (kind, length, or None of a single number) of the fields that a file has."""
    used = {e.attr for f in model.functions for e in ast.walk(f) if isinstance(e, ast.Attribute)}
    used |= {"x", "mu", "q"}
    return {name: (kind, prod(lengths) if lengths else None)
            for name, (kind, lengths) in model.fields.items() if name in used}  # fmt: skip


#: how parameters are set in a language, and what a compiler has to be told
SET = {"C": ": set them, then start", "Python with numpy": ": begin(x, mu, name=value)",
       "Python with JAX": ": begin(x, mu, name=value)"}  # fmt: skip
NO_FAST = ", so do not let a compiler reorder additions (no -ffast-math)"


def head(model: Any, language: str, said: Sequence[str]) -> list[str]:
    """Return the lines of the page of comments: what the file is, and what was verified.

    said: lines about the command, the version and what was verified.
    """
    scheme, scene, rule = model.scheme, model.scene, model.scheme.rule
    order = scheme.order
    lines = [f"{scene.name} by {rule.name}, in {language}", ""]
    sites = getattr(scene, "sites", 0)
    of_sites = f" at each of {sites} sites, whose rows follow one another" if sites else ""
    word = "" if sites or scheme.self_adjoint else "not "
    of_adjoint = "" if sites else f"The step is {word}self-adjoint."
    paragraphs = [
        f"System: {scene.name}, on {scene.groupoid.name}{of_sites}. {scene.source}",
        f"Rule: {rule.name}. {' '.join(str(rule.source).split())}",
        f"Order in (x, mu): {'not stated, measure it' if order is None else order}. " + of_adjoint,
        f"x has {model.constants['N']} entries{', the last of which is the time' * model.timed}; "
        f"mu has {model.constants['M']}: momenta in the natural basis, dL/dv on a vector space.",
        f"Parameters stay parameters{SET.get(language, '')}. Sums of x and mu are compensated"
        f"{NO_FAST * (language == 'C')}.",
        *said,
    ]
    for text in paragraphs:
        lines += [*wrap(" ".join(text.split()), WIDTH), ""]
    return lines[:-1]


def constants(model: Any) -> Iterator[tuple[str, Any]]:
    """Yield the constants that the functions use, by name."""
    used = {e.id for f in model.functions for e in ast.walk(f) if isinstance(e, ast.Name)}
    always = {"N", "M", *STATUSES}
    for name, value in model.constants.items():
        if name in used | always:
            yield name, np.ravel(value).tolist() if isinstance(value, tuple) else value

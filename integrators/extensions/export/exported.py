"""What an exported file holds, whatever its language: constants, the state's fields, functions.

The functions are the scheme's own kernels, as its flow compiles them, and the driver of `stepping`.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import factorial, prod
from typing import Any

from ...compiler import KernelText, Step, kinds_of
from ...compiler.lanes import SWEEPS, tables
from ...compiler.layout import INNER
from ...compiler.stage_text import StageText
from ...equations import closed_velocity, energy, mass_matrix, momentum, rates, stage_source
from ...errors import CannotMeasure
from ...numbers import Double, numeric_text, over, steepness
from ...scene import entries_of
from . import staging, stepping
from .statements import (
    OF_STAGES,
    RESULTS,
    at_lanes,
    folded,
    of_called,
    of_kernel,
    parsed,
    reached,
    source_of,
)

#: what a status says; also the constants' names
STATUSES = {
    "OK": "the step was done", "NOT_CONVERGED": "Newton's method did not converge",
    "SINGULAR": "a correction is infinite or no number", "EDGE":
    "the step is at or beyond the edge of its chart", "STRAYED":
    "the step is on another branch of solutions than the one before",
    "GAVE_WAY": "corrections site by site do not fade: take a smaller step",
}  # fmt: skip
EPS = 2.0**-53
#: results of the functions that are no kernels, as in `statements.RESULTS`
COLUMNS: dict[str, tuple[tuple[str, ...], bool]] = {
    "energy_at": ((), True), "momenta_at": (("values",), False), "rates_at": (("rates",), False),
    "speed_at": (("speed",), False),
}  # fmt: skip
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
    elif getattr(scene, "contact", None) or getattr(scene, "has_contact", False):
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
    """A scheme as data for the writers; raises `CannotMeasure` if no file can hold it.

    lanes: the nodes of a collocation are filled up to a multiple of it; 0: Newton's method alone.
    """

    def __init__(self, scheme: Any, lanes: int) -> None:
        self.lanes = lanes
        self.scheme, self.scene, self.s = scheme, scheme.scene, scheme.equations.s
        self.flow = scheme.flow(self.scene.step)
        self.step: Step = self.flow.system
        self.steps = [self.step] if self.step.adjoint is None else [self.step, self.step.adjoint]
        parts, whole = self.flow.parts, Fraction(self.flow.step)
        self.shares = [float(Fraction(part.step) / whole) for part in parts]
        base = self.flow.context.equations
        self.kinds = [int(part.equations is not base) for part in parts]
        self.mixed, self.timed = len(self.steps) > 1, bool(self.s.clocked)

    @cached_property
    def texts(self) -> list[KernelText]:
        """The kernels' texts of the rule and of its adjoint."""
        suffixed = list(zip(self.steps, ("", "_of_adjoint"), strict=False))
        found = [KernelText(*e) for e in suffixed]
        if len({str(text.carried) for text in found}) > 1:  # one may not use the other's
            found = [KernelText(*e, {"carried"}) for e in suffixed]
        for text in found:
            _ = text.text  # writing finds the coefficients
        return found

    @cached_property
    def kernels(self) -> list[ast.FunctionDef]:
        """The kernels as statements."""
        return [f for text in self.texts for f in written_kernels(text)]

    # -- collocation -------------------------------------------------------------------------------

    @cached_property
    def stages(self) -> StageText | None:
        """The kernels of a step's stages, if the flow solves them by a fixed point."""
        if not self.lanes or self.flow.stages is None:
            return None
        equations = self.flow.context.equations
        found = StageText(stage_source(equations.s, equations.rule.nodes).derived())
        _ = found.text  # writing finds the coefficients
        return found

    @cached_property
    def of_stages(self) -> list[ast.FunctionDef]:
        """Those kernels as statements: what is known at the nodes is a loop over them."""
        found = []
        for f in parsed("" if self.stages is None else self.stages.text):
            if f.name not in OF_STAGES:
                continue
            columns, at_nodes = OF_STAGES[f.name]
            f.args.args = [a for a in f.args.args if a.arg not in ("own", "pull")]
            made = of_kernel(f, columns, False)
            found.append(at_lanes(made, (*columns, "w", "p", "xi", "given")) if at_nodes else made)
            made.name += "_of_stages"
        return found

    @cached_property
    def at_nodes(self) -> dict[str, Any]:
        """The numbers of a collocation."""
        if self.stages is None:
            return {}
        nodes, count = self.stages.system.nodes, self.stages.system.count
        wide = -(-count // self.lanes) * self.lanes
        made = {k: v[0] for k, v in tables(nodes, count, wide, Double()).items()}
        flat = {k: [float(e) for column in made[k][:count] for e in column]
                for k in ("MU", "MU_OF_MOMENTUM", "OF_VELOCITY", "OF_MOMENTUM")}  # fmt: skip
        last = [float(e) for e in made["OF_MOMENTUM"][-1]]
        return {"STAGES": count, "LANES": wide, "TURNING": len(self.stages.turning), "INNER": INNER,
                "MOST_SWEEPS": 16 * SWEEPS, "WEIGHTS": [float(e) for e in made["WEIGHTS"]],
                **flat, "LAST_OF_MOMENTUM": last}  # fmt: skip

    @cached_property
    def start(self) -> tuple[list[float], list[float]]:
        """x, with the time, and μ of the scene's own start."""
        own = self.flow.starting.own
        return [float(e) for e in own.x], [float(e) for e in own.mu]

    # -- energy, velocity, momenta -----------------------------------------------------------------

    @cached_property
    def _letters(self) -> dict[str, Any]:
        s = self.s
        return {"x": s.x, "v": s.u, "mu": s.mu, "q": [s.h, *s.parameter_list]}

    def _numeric(self, name: str, values: Sequence[Any]) -> ast.FunctionDef:
        """Return a function of x, v, μ and q that returns a tuple."""
        text = numeric_text(self._letters, [list(values)])
        (function,) = [f for f in parsed(text) if f.name == "function"]
        function.name, last = name, function.body[-1]
        assert isinstance(last, ast.Return) and isinstance(last.value, ast.Call)
        entries = last.value.args[0]  # array([...], k)
        assert isinstance(entries, ast.List)
        last.value = ast.Tuple(entries.elts)
        return ast.fix_missing_locations(function)

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
            y=(), rows=tuple(momentum(s)), slope=tuple(mass_matrix(s)), increment=(), gain=(),
            kinds=kinds_of(("velocity", s.u)),
        )  # fmt: skip
        found = KernelText(step, "_of_speed", {"carried"}, parts=("solver", "prepare"))
        _ = found.text  # writing finds the coefficients
        return found

    @cached_property
    def formulas(self) -> list[ast.FunctionDef]:
        """The functions of energy, momenta and rates, which return tuples."""
        found = []
        if self.has_energy:
            found.append(self._numeric("energy_at", [energy(self.s)]))
        if self.conserved:
            found.append(self._numeric("momenta_at", [e for _, e in self.conserved]))
        if self.needs_rates:
            found.append(self._numeric("rates_at", list(rates(self.s))))
        if self.needs_speed and self.speed is None:
            speed = closed_velocity(self.s)
            assert speed is not None  # a Hamiltonian gives it
            found.append(self._numeric("speed_at", list(speed)))
        return found

    @cached_property
    def needs_speed(self) -> bool:
        """True if the velocity of a state is asked for, by the energy or by the first guess."""
        return self.speed is not None or any("s.v" in e or "rates" in e for e in self.guess)

    @cached_property
    def more(self) -> list[ast.FunctionDef]:
        """The functions of energy, velocities and momenta as statements."""
        found = [of_kernel(f, *COLUMNS[f.name]) for f in map(deepcopy, self.formulas)]
        return found + ([] if self.speed is None else written_kernels(self.speed))

    @property
    def quantities(self) -> tuple[str, ...]:
        """The names of the momenta, entry by entry."""
        return tuple(name for name, _ in self.conserved)

    @cached_property
    def conserved(self) -> list[tuple[str, Any]]:
        """(name, expression) of the scene's quantities, entry by entry."""
        found = list[tuple[str, Any]]()
        for quantity in self.scene.symmetries:
            if quantity.of_step or quantity.attitude:
                continue
            entries = entries_of(self.s.conserved(quantity))
            names = [quantity.name] if len(entries) == 1 else [
                f"{quantity.name} {i}" for i in range(len(entries))]  # fmt: skip
            found += zip(names, entries, strict=True)
        return found

    # -- the first guess ---------------------------------------------------------------------------

    @cached_property
    def needs_rates(self) -> bool:
        """True if Newton's method starts from the vector field: slopes are unknowns."""
        arrows = self.scheme.equations.arrows is not None
        return self.iterated and not arrows and "slope" in self.step.kinds

    @cached_property
    def iterated(self) -> bool:
        """True if some substep is solved by Newton's method."""
        return not all(self.affine)

    @cached_property
    def guess(self) -> list[str]:
        """Where each unknown starts: the scene's velocity, or what a state's vector field gives."""
        m, size = len(self.s.mu), len(self.s.x) + len(self.s.mu)
        found, seen = [], dict[str, int]()
        arrows = self.scheme.equations.arrows is not None
        for i, kind in enumerate(self.step.kinds or ["velocity"] * len(self.step.w)):
            at = seen[kind] = seen.get(kind, -1) + 1
            of_state = {"velocity": f"s.v[{at % m}]", "slope": f"s.rates[{at % size}]",
                        "place": f"s.x[{at}] / s.q[0]"}  # fmt: skip
            of_scene = f"V0[{i}]" if i < m else "0.0"
            found.append(of_scene if arrows else of_state.get(kind, "0.0"))
        return found if self.iterated else ["0.0"] * len(found)

    @property
    def first_guess(self) -> str:
        """The text that writes the guess."""
        lines = ['    """Write where Newton\'s method starts at a new state."""']
        if self.scheme.equations.arrows is None:
            lines += ["    speed(s)"] * self.needs_speed
            lines += ["    rates_at(s.rates, s.x, s.v, s.mu, s.q)"] * self.needs_rates
        lines += [f"    s.w[{i}] = {value}" for i, value in enumerate(self.guess)]
        return "\n".join(["def first_guess(s: State) -> None:", *lines])

    # -- all together ------------------------------------------------------------------------------

    @cached_property
    def constants(self) -> dict[str, Any]:
        """The numbers of a file by their names."""
        step, s = self.step, self.s
        m = max(len(e.w) for e in self.steps)
        reused = max(len(text.carried) for text in self.texts)
        numbers: dict[str, Any] = {e: i for i, e in enumerate(STATUSES)}
        hidden = {"slope", "impulse"} & {*step.kinds}
        numbers |= {
            "N": len(s.x), "M": len(s.mu), "SOLVED": m, "REUSED": reused,
            "SUBSTEPS": len(self.shares),
            "WIDTH": max([1, *(len(text.coefficients.values) for text in self.texts)]),
            "SIZES": sum(kind == "size" for kind, _ in step.extents),
            "RESTS": sum(kind == "rest" for kind, _ in step.extents),
            "QUANTITIES": len(self.conserved), "MULTIPLIERS": step.multipliers,
            "FIRST": 1 + len(s.parameter_list),
            "NUMBERS": len(s.q) - 1 - len(s.parameter_list),
            "EPS": EPS, "ROOT_EPS": 2.0**-26, "LARGE": 1e300, "DECAY": 0.999, "MARGIN": 8.0,
            "FAINT": 64 * EPS * (EPS if hidden else 1.0),
            "REACH": float(self.flow.edge.reach), "SLACK": float(self.flow.edge.slack)
            if step.branch is not None else 1e300,
            "KINDS": self.kinds, "SHARES": self.shares,
            "OF_RULE": [float(e) for e in self.flow.context.q[1 + len(s.parameter_list) :]],
            "V0": [float(e) for e in self.flow.starting.own.guess[: len(s.mu)]]
            if self.scheme.equations.arrows is not None else [float(e) for e in self.scene.v0],
        }  # fmt: skip
        several = {} if len({*self.affine}) == 1 else {"AFFINE": [int(e) for e in self.affine]}
        return numbers | self.at_nodes | several | over_factorials(
            [*self.kernels, *self.of_stages, *self.more])  # fmt: skip

    @cached_property
    def fields(self) -> dict[str, tuple[str, tuple[int, ...]]]:
        """Name → (kind, lengths) of the state's fields: what a step leaves for the next.

        The kind is "float" or "int".
        """
        c = self.constants
        n, m, w, k, j = (c[e] for e in ("N", "M", "SOLVED", "REUSED", "SUBSTEPS"))

        def of(names: str, *lengths: int, kind: str = "float") -> Any:
            return {name: (kind, lengths) for name in names.split()}

        found = (of("x", n) | of("mu", m) | of("ex", n) | of("emu", m) | of("q", len(self.s.q))
                 | of("h") | of("fresh", kind="int") | of("w dw", w) | of("dx", n) | of("dmu", m)
                 | of("k new_k", k) | of("c", j, c["WIDTH"]) | of("kept", 2 * (n + m)))  # fmt: skip
        if self.iterated:
            found |= of("past", j, 5 * w) | of("kappa scale", j) | of("age degree", j, kind="int")
        if self.step.extents:
            found |= of("sizes", c["SIZES"]) | of("rests", c["RESTS"])
        if self.step.branch is not None:
            found |= of("branch")
        if self.stages is not None:
            found |= of("node_w node_p node_xi node_mu moves gains turned", m * c["LANES"])
            found |= of("turns", c["TURNING"] * c["LANES"]) | of("ahead end last sum_p more", m)
            found |= of("sum_f", c["TURNING"]) | of("moved large units left", 2 * m) | of("gate")
            found |= of("stage_c", len(self.stages.coefficients.values))
            found |= of("known by_newton stretch", kind="int")
        found |= of("v", m)
        if self.speed is not None:
            found |= of("dv", m) | of("speed_c", len(self.speed.coefficients.values))
        return found | (of("rates", n + m) if self.needs_rates else {})

    @property
    def dispatch(self) -> str:
        """The text of functions that call the rule's kernel or its adjoint's."""
        texts = []
        for f in self.kernels if self.mixed else ():
            if f.name not in RESULTS:
                continue
            given = ", ".join(a.arg for a in f.args.args)
            one, other = f"{f.name}({given})", f"{f.name}_of_adjoint({given})"
            kind, answer = "float", f"    return {one} if kind == 0 else {other}\n"
            if not RESULTS[f.name][1]:
                kind = "None"
                answer = f"    if kind == 0:\n        {one}\n    else:\n        {other}\n"
            head = f"def either_{f.name}(kind: int, {ast.unparse(f.args)}) -> {kind}:"
            texts.append(f"{head}\n{answer}")
        return "\n".join(texts)

    @cached_property
    def parameters(self) -> list[Parameter]:
        """The scene's parameters with their values."""
        values, found = iter(float(e) for e in self.scene.parameter_values), []
        for name, letters in vars(self.s.parameters).items():
            shape: tuple[int, ...] = tuple(map(int, getattr(letters, "shape", ())))
            shape = shape[:1] if shape[1:] == (1,) else shape
            found.append(Parameter(name, shape, tuple(next(values) for _ in range(prod(shape)))))
        return found

    @cached_property
    def affine(self) -> list[bool]:
        """For the rule and its adjoint, True if no step is iterated."""
        return [bool(text.affine) for text in self.texts]

    @cached_property
    def flags(self) -> dict[str, Any]:
        """What is known when a file is written, and decides what it has."""
        stages, c = self.stages, self.constants
        return {
            "WATCHED": bool(self.step.extents), "BRANCHED": self.step.branch is not None,
            "ITERATED": self.iterated, "SPEED": self.speed is not None,
            "SPEED_OF_STATE": self.needs_speed, "SPEED_CLOSED": self.speed is None,
            "SPEED_AFFINE": self.speed is not None and self.speed.affine,
            "STAGED": stages is not None, "SHIFTED": stages is not None and stages.shifted,
            "ROTATING": stages is not None and stages.system.moved is not None,
            "TURNING": c.get("TURNING", 0),
            **{e: c[e] for e in ("REUSED", "SIZES", "RESTS", "NUMBERS", "SUBSTEPS")},
            **({} if "AFFINE" in c else {"AFFINE": self.affine[0]}),
        }  # fmt: skip

    @cached_property
    def functions(self) -> list[ast.FunctionDef]:
        """The functions of a file, each after those that it calls."""
        words = {"correct": "solver", **{e: e for e in RESULTS if e != "solver"}}
        driver = source_of(over, steepness) + functions_of(stepping) + functions_of(staging)
        for f in driver:
            for e in ast.walk(f):
                if isinstance(e, ast.Call) and isinstance(e.func, ast.Name) and e.func.id in words:
                    e.func.id = f"{'either_' * self.mixed}{words[e.func.id]}"
        kernels = [] if self.mixed else [*RESULTS]
        driver = folded(
            [*driver, *parsed(self.first_guess), *parsed(self.dispatch)], self.flags, kernels
        )
        roots = ["start", "advance", "rows_of_run"]
        roots += ["energy"] * self.has_energy + ["momenta"] * bool(self.conserved)
        roots += ["multipliers"] * bool(self.iterated and self.step.multipliers)
        return reached([*self.kernels, *self.of_stages, *self.more, *driver], roots)

    @cached_property
    def sources(self) -> list[ast.FunctionDef]:
        """The kernels as they were, for a language that has tuples."""
        texts = [*self.texts, *([self.speed] if self.speed is not None else [])]
        return [f for text in texts for f in parsed(text.text)] + self.formulas


def written_kernels(text: KernelText) -> list[ast.FunctionDef]:
    """Return the kernels of a text as statements; each solver takes w and returns a size."""
    found, lengths = [], dict[str, int]()
    for function in parsed(text.text):
        word, last = function.name.removesuffix(text.suffix), function.body[-1]
        assert isinstance(last, ast.Return) and isinstance(last.value, ast.Tuple)
        if word not in RESULTS:
            lengths[function.name] = len(last.value.elts)
            found.append(of_called(function, lengths))
            continue
        if word == "solver" and text.affine:
            function.args.args.insert(1, ast.arg("w"))
            last.value = ast.Tuple([last.value, ast.Constant(0.0)])
        found.append(of_kernel(function, *RESULTS[word], lengths))
    return found


def functions_of(part: Any) -> list[ast.FunctionDef]:
    """Return the functions of a text of ours, a module."""
    own = [e for e in vars(part).values() if getattr(e, "__module__", "") == part.__name__]
    return source_of(*filter(callable, own))


def over_factorials(functions: Sequence[ast.FunctionDef]) -> dict[str, Any]:
    """Return the numbers of Stumpff's functions, as many as these functions need."""
    words = {e for f in functions for e in ast.walk(f)
             if isinstance(e, ast.Call) and ast.unparse(e.func) == "stumpff"}  # fmt: skip
    most = max((ast.literal_eval(e.args[1]) for e in words), default=0)
    terms = next(n for n in range(99) if 4 * factorial(2) < EPS * factorial(2 * n + 4))
    return {"TERMS": terms, "OVER": [1 / factorial(n) for n in range(2 * terms + most + 1)]}

"""What an exported file holds, whatever its language: constants, the state's fields, functions.

The functions are the scheme's own kernels, as its flow compiles them, and the driver of `stepping`.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import prod
from typing import Any

from ...compiler import KernelText, Step, kinds_of
from ...equations import closed_velocity, energy, mass_matrix, momentum, rates
from ...errors import CannotMeasure
from ...numbers import numeric_text, over, steepness
from ...scene import entries_of
from . import stepping
from .statements import RESULTS, folded, of_called, of_kernel, parsed, reached, source_of

#: what a status says; also the constants' names
STATUSES = {
    "OK": "the step was done", "NOT_CONVERGED": "Newton's method did not converge",
    "SINGULAR": "a correction is infinite or no number", "EDGE":
    "the step is at or beyond the edge of its chart", "STRAYED":
    "the step is on another branch of solutions than the one before",
}  # fmt: skip
EPS = 2.0**-53
#: results of the functions that are no kernels, as in `statements.RESULTS`
COLUMNS: dict[str, tuple[tuple[str, ...], bool]] = {
    "energy_at": ((), True), "momenta_at": (("values",), False), "rates_at": (("rates",), False),
    "speed_at": (("speed",), False),
}  # fmt: skip
LONGEST = 20_000  # operations of all kernels, which a compiler takes in some seconds


@dataclass(frozen=True)
class Parameter:
    """A parameter of the scene: its name, its shape, () or (k,) or (k, l), and its values."""

    name: str
    shape: tuple[int, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class Exported:
    """A scheme as data for the writers.

    constants: name → int, float or list of these. fields: name → (kind, lengths) of the state, the
    kind "float" or "int". functions: trees in the order in which each comes after those that it
    calls. sources: the kernels as they were, for a language that has tuples; flags: what is known
    of them. quantities: names of the momenta, entry by entry. guess: where each unknown of a step
    starts, as expressions. affine: for the rule and its adjoint, True if no step is iterated.
    """

    scheme: Any
    parameters: tuple[Parameter, ...]
    constants: Mapping[str, Any]
    fields: Mapping[str, tuple[str, tuple[int, ...]]]
    functions: Sequence[ast.FunctionDef]
    flags: Mapping[str, Any]
    quantities: tuple[str, ...]
    timed: bool
    energy: bool
    sources: Sequence[ast.FunctionDef] = ()
    guess: Sequence[str] = ()
    affine: Sequence[bool] = ()

    @property
    def scene(self) -> Any:
        """The scene with its values."""
        return self.scheme.scene


def exported(scheme: Any) -> Exported:
    """Return what a file of the scheme holds; raises `CannotMeasure` if no file can hold it."""
    refuse(scheme)
    return _Export(scheme).result


def refuse(scheme: Any) -> None:
    """Raise `CannotMeasure` for what has no straight-line step."""
    from ...flows import Scheme

    scene = getattr(scheme, "scene", None)
    name, rule = getattr(scene, "name", str(scheme)), getattr(scheme, "rule", None)
    what = ""
    if rule is not None and not rule.is_formula:
        what = f"{rule.name} is a program, which is code already"
    elif getattr(scene, "contact", None) is not None:
        what = f"{name} has contact, whose impacts are searched in each step"
    elif type(scheme) is not Scheme or scene is None:
        what = f"{name} is made by loops of its own (a lattice, a control, steps that vary)"
    if what:
        raise CannotMeasure(
            f"{what}, so it cannot be exported: a scene without contact by a rule, a composition "
            "or a one-step map can."
        )


class _Export:
    """Collects what a file of one scheme holds."""

    def __init__(self, scheme: Any) -> None:
        self.scheme, self.scene, self.s = scheme, scheme.scene, scheme.equations.s
        self.flow = scheme.flow(self.scene.step)
        self.step: Step = self.flow.system
        self.steps = [self.step] if self.step.adjoint is None else [self.step, self.step.adjoint]
        parts, whole = self.flow.parts, Fraction(self.flow.step)
        self.shares = [float(Fraction(part.step) / whole) for part in parts]
        base = self.flow.context.equations
        self.kinds = [int(part.equations is not base) for part in parts]
        self.mixed = len(self.steps) > 1

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
        if self.quantities:
            found.append(self._numeric("momenta_at", [e for _, e in self.quantities]))
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

    @cached_property
    def quantities(self) -> list[tuple[str, Any]]:
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
        return not all(text.affine for text in self.texts)

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
            "QUANTITIES": len(self.quantities), "FIRST": 1 + len(s.parameter_list),
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
        return numbers

    @cached_property
    def fields(self) -> dict[str, tuple[str, tuple[int, ...]]]:
        """The state beside x, mu and the parameters: what a step leaves for the next."""
        c = self.constants
        n, m, w, k, j = (c[e] for e in ("N", "M", "SOLVED", "REUSED", "SUBSTEPS"))
        found: dict[str, tuple[str, tuple[int, ...]]] = {
            "x": ("float", (n,)), "mu": ("float", (m,)), "ex": ("float", (n,)),
            "emu": ("float", (m,)), "q": ("float", (len(self.s.q),)),
            "h": ("float", ()), "fresh": ("int", ()),
            "w": ("float", (w,)), "dw": ("float", (w,)), "dx": ("float", (n,)),
            "dmu": ("float", (m,)), "k": ("float", (k,)), "new_k": ("float", (k,)),
            "c": ("float", (j, c["WIDTH"])), "kept": ("float", (2 * (n + m),)),
        }  # fmt: skip
        if self.iterated:
            found["past"] = "float", (j, 5 * w)
            found |= {"kappa": ("float", (j,)), "scale": ("float", (j,))}
            found |= {"age": ("int", (j,)), "degree": ("int", (j,))}
        if self.step.extents:
            found |= {"sizes": ("float", (c["SIZES"],)), "rests": ("float", (c["RESTS"],))}
        if self.step.branch is not None:
            found["branch"] = "float", ()
        found["v"] = "float", (m,)
        if self.speed is not None:
            width = len(self.speed.coefficients.values)
            found |= {"dv": ("float", (m,)), "speed_c": ("float", (width,))}
        if self.needs_rates:
            found["rates"] = "float", (n + m,)
        return found

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

    @property
    def result(self) -> Exported:
        """Everything."""
        values = iter(float(e) for e in self.scene.parameter_values)
        parameters = []
        for name, letters in vars(self.s.parameters).items():
            shape: tuple[int, ...] = tuple(map(int, getattr(letters, "shape", ())))
            shape = shape[:1] if shape[1:] == (1,) else shape
            held = tuple(next(values) for _ in range(prod(shape)))
            parameters.append(Parameter(name, shape, held))
        c = self.constants
        affine = [int(text.affine) for text in self.texts]
        flags = {
            "WATCHED": bool(self.step.extents), "BRANCHED": self.step.branch is not None,
            "ITERATED": self.iterated, "SPEED": self.speed is not None,
            "SPEED_OF_STATE": self.needs_speed, "SPEED_CLOSED": self.speed is None,
            "SPEED_AFFINE": self.speed is not None and self.speed.affine,
            **{e: c[e] for e in ("REUSED", "SIZES", "RESTS", "NUMBERS", "SUBSTEPS")},
        }  # fmt: skip
        if len(set(affine)) == 1:
            flags["AFFINE"] = bool(affine[0])
        else:
            c["AFFINE"] = affine
        words = {"correct": "solver", **{e: e for e in RESULTS if e != "solver"}}
        driver = [f for f in source_of(*_driver())]
        for f in driver:
            for e in ast.walk(f):
                if isinstance(e, ast.Call) and isinstance(e.func, ast.Name) and e.func.id in words:
                    e.func.id = f"{'either_' * self.mixed}{words[e.func.id]}"
        kernels = [] if self.mixed else [*RESULTS]
        driver = folded(
            [*driver, *parsed(self.first_guess), *parsed(self.dispatch)], flags, kernels
        )
        roots = ["start", "advance", "rows_of_run"]
        roots += ["energy"] * self.has_energy + ["momenta"] * bool(self.quantities)
        functions = reached([*self.kernels, *self.more, *driver], roots)
        texts = [*self.texts, *([self.speed] if self.speed is not None else [])]
        sources = [f for text in texts for f in parsed(text.text)] + self.formulas
        return Exported(
            self.scheme, tuple(parameters), c, self.fields, functions, flags,
            tuple(name for name, _ in self.quantities), bool(self.s.clocked), self.has_energy,
            sources, self.guess, [bool(e) for e in affine],
        )  # fmt: skip


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


def _driver() -> list[Any]:
    """Return the functions of the driver, with the rule by which Newton's method ends."""
    own = [e for e in vars(stepping).values() if getattr(e, "__module__", "") == stepping.__name__]
    return [over, steepness, *(e for e in own if callable(e))]

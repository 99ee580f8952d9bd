"""What an exported file of a lattice holds: its driver, with loops over sites and bonds.

The driver is the text that the bench compiles (`lattices.lattice_driver`), specialised for the
lattice; the state has the arrays of `lattices.lattice_run`, row after row.
"""

from __future__ import annotations

import ast
from functools import cached_property
from typing import Any

import numpy as np

from ...compiler import KNOWN_ZEROS, Entry
from ...compiler.kernels import names_of
from ...compiler.llvm_values import Value
from ...numbers import Double, flatten
from ..lattices.lattice_run import ranges_of, segments_of
from ..lattices.lattice_text import lattice_text
from . import lattice_stepping, stepping
from .exported import EPS, STATUSES, Parameter, functions_of, over_factorials
from .specialised import Entries, Specialised, Table
from .statements import folded, parsed, reached

MOST = 4  # segments of bonds that have loops of their own; more of them are a table
ORDER = ("x", "nu", "mu", "w", "w1", "w2", "w3", "work", "ties", "p", "q", "coefficients", "given")
BEGIN, RUN, SHOW, RELAXED = 0, 1, 2, 5  # tasks of the driver


class ExportedLattice:
    """A lattice's scheme as data for the writers, like `Exported`."""

    stages = speed = None
    affine = (False,)
    sources = ()
    has_energy = False
    quantities: tuple[str, ...] = ()

    def __init__(self, scheme: Any) -> None:
        self.scheme, self.scene = scheme, scheme.lattice
        lattice = scheme.lattice
        self.flow, self.timed = scheme.flow(lattice.step), scheme.timed
        text = lattice_text(scheme.system, lattice.shape, bool(scheme.substeps))
        self.module = Specialised(text, names_of(text, Double(), **KNOWN_ZEROS))
        self.names = self.module.names
        self.order, self.segments = segments_of(lattice.pairs)
        self.n, self.m, self.solved = (self.names[e] for e in ("n", "m", "S"))

    @cached_property
    def start(self) -> tuple[list[float], list[float]]:
        """x, with the time, and μ of the lattice's own start."""
        x, mu = self.flow.own_start
        return [*map(float, x.ravel()), *[0.0] * self.timed], [*map(float, mu.ravel())]

    # -- parameters --------------------------------------------------------------------------------

    @cached_property
    def parameters(self) -> list[Parameter]:
        """The shared parameters, and those that each site or bond has."""
        found = list[Parameter]()
        for word, parts in self.scene.split_parameters.items():
            for name, value in parts.items():
                if all(e.name != name for e in found):
                    values = tuple(map(float, flatten(value) if word == "shared"
                                       else np.ravel(value)))  # fmt: skip
                    found.append(Parameter(name, tuple(np.shape(value)), values))
        return found

    @cached_property
    def places(self) -> dict[str, int]:
        """Where each parameter begins in q."""
        found, at = {}, 1
        for parameter in self.parameters:
            found[parameter.name] = at
            at += len(parameter.values)
        return found

    @property
    def own_rows(self) -> str:
        """The text that brings parameters into rows of sites and of bonds (`own_rows`)."""
        parts, lines = self.scene.split_parameters, list[str]()
        width = {k: a[0].size for part in ("site", "bond") for k, a in parts[part].items()}

        def copied(array: str, row: str, columns: list[tuple[str, str]]) -> list[str]:
            wide, at, made = sum(width[k] for k, _ in columns), 0, []
            for key, which in columns:
                for j in range(width[key]):
                    source = f"{self.places[key]} + {which} * {width[key]} + {j}"
                    made.append(f"        s.{array}[{row} * {wide} + {at}] = s.q[{source}]")
                    at += 1
            return made

        of_sites = copied("p", "i", [(k, "i") for k in parts["site"]])
        of_bonds = [(k, "BONDS[3 * k]") for k in parts["bond"]]
        ends = [(k, f"BONDS[3 * k + {e}]") for k in parts["site"] if k not in parts["bond"]
                for e in (1, 2)]  # fmt: skip
        ties = copied("b", "k", [*of_bonds, *ends])
        lines += ["    for i in range(SITES):", *of_sites] if of_sites else []
        lines += ["    for k in range(TIES):", *ties] if ties else []
        said = '    """Give each site and each bond its own parameters."""'
        return "\n".join(["def own_rows(s: State) -> None:", said, *(lines or ["    pass"])])

    # -- functions ---------------------------------------------------------------------------------

    def _entries(self, word: str) -> Entries:
        field = {"q": "b"}.get(word, word)
        return Entries("f", f"s.{field}", self.names["WIDTHS"].get(word), self.module.routine)

    def _drive(self, of: Any) -> Any:
        """Write the driver; return the status."""
        routine = self.module.routine
        task, steps = (Value("i", e, routine) for e in ("task", "steps"))
        kinds = Entries("i", "KINDS", None, routine)
        tables: list[Any] = []
        for name, rows in (("RANGES", ranges_of(self.scene.free)), ("SEGMENTS", self.segments)):
            if len(rows) <= MOST:
                tables += [Table(rows.tolist(), routine), len(rows)]
            else:  # a count that no loop is unrolled for
                tables += [Entries("i", name, rows.shape[1], routine),
                           Value("i", str(len(rows)), routine)]  # fmt: skip
        return of("advance")(
            task, steps, *map(self._entries, ORDER), kinds, len(self.scheme.kinds), *tables,
            self._entries("totals"),
        )[1]  # fmt: skip

    def _prepare(self, of: Any) -> None:
        """Write the coefficients of each substep, and what they come from if the time is there."""
        rows = self.scheme.q_values(self.flow.step, Double())
        routine, shared = self.module.routine, len(flatten(tuple(
            self.scene.split_parameters["shared"].values())))  # fmt: skip
        c, given = self._entries("coefficients"), self._entries("given")
        q, before = Entries("f", "s.q", None, routine), 0.0
        for j, (kind, row) in enumerate(zip(self.scheme.kinds, rows, strict=True)):
            share = float(row[0]) / float(self.flow.step)
            h = q[0] * share
            own = [q[1 + i] for i in range(shared)]
            clock = [0.0] * self.timed
            numbers = [*map(float, row[1 + self.timed + shared :])]
            values = (h, *clock, *own, *numbers)
            system = self.names["ADJOINT" if kind else "RULE"]
            if self.timed:
                t0 = routine.get("f", ast.parse("s.t0", mode="eval").body)
                for i, e in enumerate((t0 + before * q[0], q[0], *values)):
                    given[j, i] = e
                before += share
            else:
                for i, e in enumerate(system.prepare(values)):
                    c[j, i] = e

    @cached_property
    def functions(self) -> list[ast.FunctionDef]:
        """The functions of a file, each after those that it calls."""
        drive = self.module.function("def drive(s: State, task: int, steps: int) -> int:",
                                     self._drive)  # fmt: skip
        prepare = self.module.function("def prepare_sites(s: State) -> None:", self._prepare)
        for f, said in (
            (drive, "Do a task: 0 begins, 1 does steps, 2 writes mu."),
            (prepare, "Write what depends on the step and the parameters alone."),
        ):
            f.body.insert(0, ast.Expr(ast.Constant(said)))
            ast.fix_missing_locations(f)
        tools = [f for f in functions_of(stepping) if f.name in ("eliminate", "stumpff")]
        shell = folded([*functions_of(lattice_stepping), *parsed(self.own_rows)],
                       {"TIMED": self.timed, "LISTED": self.listed,
                        "HELD": int((~self.scene.free).sum())}, [])  # fmt: skip
        return reached([*tools, drive, prepare, *shell], ["start", "advance", "rows_of_run"])

    @property
    def listed(self) -> bool:
        """True if any pairs of sites may have bonds that tie their unknowns."""
        return bool(self.names["LISTED"]) and not self.scheme.local

    # -- constants and fields ----------------------------------------------------------------------

    @cached_property
    def constants(self) -> dict[str, Any]:
        """The numbers of a file by their names."""
        lattice = self.scene
        pairs = np.c_[self.order, lattice.pairs[self.order]]
        v0 = (lattice.start[1] * lattice.free[:, None]).ravel()
        return {
            **{e: i for i, e in enumerate(STATUSES)}, "N": len(self.start[0]),
            "M": len(self.start[1]), "SITES": lattice.sites, "TIES": len(pairs),
            "SOLVED": self.solved, "MOVING": self.m, "ENTRIES": len(Entry),
            "BEGIN": BEGIN, "RUN": RELAXED if self.listed else RUN, "SHOW": SHOW,
            "KAPPA": int(Entry.KAPPA), "STEPS": int(Entry.STEPS), "EPS": EPS, "LARGE": 1e300,
            "KINDS": self.scheme.kinds, "V0": [*map(float, v0)],
            "FIXED": np.flatnonzero(~lattice.free).tolist(),
            "BONDS": [int(e) for e in pairs.ravel()],
            "RANGES": ranges_of(lattice.free).ravel().tolist(),
            "SEGMENTS": self.segments.ravel().tolist(), "MULTIPLIERS": 0,
            **over_factorials(self.functions),
        }  # fmt: skip

    @cached_property
    def fields(self) -> dict[str, tuple[str, tuple[int, ...]]]:
        """Name → (kind, lengths) of the state's fields."""
        widths, c = self.names["WIDTHS"], self.constants
        sites, count = self.scene.sites, len(self.scheme.kinds)
        rows = {**dict.fromkeys(("nu", "w", "w1", "w2", "w3"), sites), "p": sites,
                "coefficients": count, "given": count}  # fmt: skip
        rows |= {} if self.scheme.local else {"work": sites}
        rows |= {"ties": c["TIES"]} if self.listed else {}
        size = 1 + sum(len(e.values) for e in self.parameters)
        found: dict[str, tuple[str, tuple[int, ...]]] = {
            "x": ("float", (c["N"],)), "mu": ("float", (c["M"],)), "q": ("float", (size,)),
            "b": ("float", (c["TIES"] * widths["q"],)), "h": ("float", ()), "t0": ("float", ()),
            "totals": ("float", (len(Entry),)), "kept": ("float", (c["N"] + c["M"],)),
        }  # fmt: skip
        found |= {e: ("float", (k * widths[e],)) for e, k in rows.items()}
        used = {e.attr for f in self.functions for e in ast.walk(f) if isinstance(e, ast.Attribute)}
        return {name: of for name, of in found.items() if name in used | {"x", "mu", "q"}}

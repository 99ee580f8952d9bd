"""The cost of a step against the number of sites, beside plain C if there is a compiler."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import tempfile
import tracemalloc
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from discmech.integrators import Scheme
from discmech.integrators.extensions.lattices import Lattice, LatticeRun

from ..core.clocks import fine_clock
from ..core.fingerprint import own_name
from ..core.fitting import fit_line

SIZES = (100, 1_000, 10_000, 100_000)
MILLION = 1_000_000  # sites of a further size if run time does not matter
LARGE = 1_000  # sites from which memory is fitted: below, the constant part shows
LONG = 0.01  # seconds of a timed run
ROUNDS = 5
LANDED = 25  # steps until some sites of a lattice with contact touch
C_FILE = Path(__file__).with_name("lattice.c")
#: the rules that the C file has, by their names there
IN_C = {"trapezoidal": "stoermer_verlet", "midpoint": "midpoint"}
C_STEP = 0.125


def costs(
    make: Callable[[int], Lattice],
    rule: Any,
    thorough: bool = False,
    sizes: tuple[int, ...] = SIZES,
) -> list[dict[str, Any]]:
    """Return rows {kind, sites, nanoseconds, bytes, c}: per site and step, and per site beside the
    rows.

    Times are the least processor time of some runs, in nanoseconds; all sizes, and C, take turns,
    so that disturbances affect all alike. c: the time of C, for the chain "fput" with the two rules
    of the file, otherwise None. thorough: a million sites too.
    """
    timed = [_Timed(make(size), rule) for size in ((*sizes, MILLION) if thorough else sizes)]
    for _ in range(ROUNDS):
        for one in timed:
            one.run()
    return [one.row() for one in timed]


class _Timed:
    """Some steps of a lattice, and the least seconds of a step: of ours, and of C."""

    def __init__(self, lattice: Lattice, rule: Any) -> None:
        known_in_c = own_name(lattice) == "fput" and rule.name in IN_C
        flow: Any = Scheme(lattice, rule).flow(C_STEP if known_in_c else lattice.step)
        flow.kernels  # noqa: B018 - compiled before the clock runs
        self.flow, self.sites, self.advance, self.steps = flow, lattice.sites, _steps_of(flow), 2
        while (first := _seconds(self.advance, self.steps)) < LONG / 4:
            self.steps *= 2
        self.steps = max(1, int(self.steps * LONG / first))
        self.in_c: tuple[Any, ...] | None = None
        if known_in_c and c_library() is not None:
            self.in_c = (rule.name, *(e[:, 0] for e in lattice.start), self.steps)
        self.least = self.least_in_c = math.inf

    def run(self) -> None:
        """Run once, and once in C, each after a short untimed run, as others leave caches cold."""
        if self.steps > 1:
            self.advance(self.steps)
        self.least = min(self.least, _seconds(self.advance, self.steps) / self.steps)
        if self.in_c is not None:
            seconds, *_ = c_states(c_library(), *self.in_c)
            self.least_in_c = min(self.least_in_c, seconds / self.steps)

    def row(self) -> dict[str, Any]:
        """Return the row of costs per site and step."""
        N = self.sites
        return {"kind": "cost", "sites": N, "nanoseconds": self.least / N * 1e9,
                "bytes": _bytes(self.flow) / N,
                "c": None if self.in_c is None else self.least_in_c / N * 1e9}  # fmt: skip


def slopes(rows: list[dict[str, Any]]) -> dict[str, float | None]:
    """Return {"time", "memory"}: powers of N with which a step's time and a run's memory grow.

    None where a clock of coarse ticks shows a time of 0.
    """
    powers: dict[str, float | None] = {}
    for name, key, least in (("time", "nanoseconds", 0), ("memory", "bytes", LARGE // 2)):
        sizes = [(r["sites"], r[key] * r["sites"]) for r in rows if r["sites"] >= least]
        seen = all(of > 0 for _, of in sizes)
        powers[name] = fit_line(*np.log(np.array(sizes)).T).slope if seen else None
    return powers


def _start(flow: Any) -> tuple[np.ndarray, np.ndarray]:
    start = flow.trajectory(0)
    return start.x[0], start.mu[0]


def _steps_of(flow: Any) -> Callable[[int], Any]:
    """Return a function that takes further steps; with contact after some sites touch."""
    if flow.lattice.has_contact:
        there = flow.trajectory(LANDED, LANDED)
        return lambda steps: flow.trajectory(steps, steps, x0=there.x[-1], mu0=there.mu[-1])
    run = LatticeRun(flow, *_start(flow))
    return lambda steps: run.checked(run.advance(steps))


def _seconds(advance: Callable[[int], Any], steps: int) -> float:
    clock = fine_clock()
    begun = clock()
    advance(steps)
    return clock() - begun


def _bytes(flow: Any) -> int:
    """Return the most bytes that a run holds at once, beside its rows."""
    x, mu = _start(flow)
    tracemalloc.start()
    try:
        if flow.lattice.has_contact:
            flow.trajectory(2, 2)
        else:
            LatticeRun(flow, x, mu).advance(2)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@cache
def c_library() -> Any:
    """Return the C file as a library; None if there is no compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "lattice.so"
        flags = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC"]
        made = subprocess.run([compiler, *flags, "-o", library, C_FILE], capture_output=True)
        return None if made.returncode else ctypes.CDLL(str(library))


def c_states(
    library: Any, rule: str, x: np.ndarray, p: np.ndarray, steps: int
) -> tuple[float, np.ndarray, np.ndarray]:
    """Return (seconds, x, p) after so many steps of size C_STEP from x and p, (N,) each."""
    x, p, sites = x.copy(), p.copy(), len(x)
    arrays = [x, p, *([p.copy(), np.zeros(2 * sites)] if rule == "midpoint" else [])]
    numbers = map(ctypes.c_double, (C_STEP, 0.25, 0.1))
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in arrays]
    clock = fine_clock()
    begun = clock()
    getattr(library, IN_C[rule])(ctypes.c_long(sites), ctypes.c_long(steps), *numbers, *pointers)
    return clock() - begun, x, p

"""rebound: integrators for scenes of bodies that attract each other (Rein, Liu 2012).

WHFast is the symplectic map of Wisdom and Holman around the first body (Rein, Tamayo 2015), with
its corrector of order 17 and synchronised only at the end, as its documentation advises for
accuracy and speed; IAS15 is adaptive, of order 15 (Rein, Spiegel 2015).
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from discmech.integrators.equations import SceneSymbols
from discmech.integrators.numbers import sympy
from discmech.integrators.scene import Scene, remembered

from ..contestants import MOST_ROWS, Contestant, NoEnd, Problem, States, steps_between

#: for IAS15; the last is its own default, and above the first its corrector does not converge
EPSILONS = [10.0**-k for k in range(3, 10)]


@dataclass(frozen=True)
class Bodies:
    """Masses that attract each other by Newton's law with the constant G, in `dim` dimensions."""

    masses: tuple[float, ...]
    G: float
    dim: int


@remembered(maxsize=64)
def bodies(scene: Scene) -> Bodies | None:
    """Return the bodies of a scene; None if its Lagrangian is not theirs.

    They are known by names: parameters "masses" and "G" (1 if there is none), with the positions of
    the bodies one after another as x.
    """
    masses = scene.parameters.get("masses", ())
    count = len(masses) if isinstance(masses, tuple | list) else 0
    if not scene.groupoid.canonical or scene.force is not None or scene.clocked or count < 2:
        return None
    s = SceneSymbols(scene)
    dim, rest = divmod(len(s.x), count)
    if rest or dim not in (2, 3) or scene.lagrangian is None:
        return None
    places, speeds = (
        [sympy.Matrix(list(z)[i * dim : (i + 1) * dim]) for i in range(count)] for z in (s.x, s.u)
    )
    m, G = list(s.parameters.masses), getattr(s.parameters, "G", 1)
    kinetic = sum(e * v.dot(v) for e, v in zip(m, speeds, strict=True)) / 2
    pairs = combinations(zip(m, places, strict=True), 2)
    wanted = kinetic + sum(G * e * f / sympy.sqrt((a - b).dot(a - b)) for (e, a), (f, b) in pairs)
    if (s.lagrangian - wanted).expand() != 0:
        return None
    constant = float(scene.parameters.get("G", 1))
    return Bodies(tuple(float(e) for e in masses), constant, dim)


class ReboundContestant(Contestant):
    """IAS15; the settings are its tolerances ε."""

    settings, what = EPSILONS, "ε"

    def __init__(self, name: str, problem: Problem, equations: Any) -> None:
        import rebound

        system = bodies(problem.scene)
        assert system is not None  # `peers.on` has checked it
        self.name, self.problem, self.dim = name, problem, system.dim
        self.end = float(problem.duration)
        self.masses = np.array(system.masses)
        self.start = rebound.Simulation()
        self.start.G, self.start.integrator = system.G, name.lower()
        for m in self.masses:
            self.start.add(m=m)
        self.start = self.begun((self.start, None), problem.start)

    def state(self, simulation: Any) -> np.ndarray:
        """Return (x, μ) of a simulation."""
        x, v = np.zeros((2, len(self.masses), 3))
        simulation.serialize_particle_data(xyz=x, vxvyvz=v)
        mu = self.masses[:, None] * v
        return np.concatenate([x[:, : self.dim].ravel(), mu[:, : self.dim].ravel()])

    def begun(self, made: Any, start: np.ndarray) -> Any:
        """Return a copy of the simulation at a start."""
        simulation = made[0].copy()
        x, v = np.zeros((2, len(self.masses), 3))
        places, momenta = (part.reshape(-1, self.dim) for part in np.split(start, 2))
        x[:, : self.dim], v[:, : self.dim] = places, momenta / self.masses[:, None]
        simulation.set_serialized_particle_data(xyz=x, vxvyvz=v)
        return simulation

    def made(self, setting: Any) -> Any:
        """Return a simulation at the start, and its setting."""
        simulation = self.start.copy()
        simulation.ri_ias15.epsilon = setting
        return simulation, setting

    def solve(self, made: Any, simulation: Any) -> Any:
        """Return the simulation, at the end by its own steps."""
        simulation.integrate(self.end)
        return simulation

    def _watched(self, made: Any, every: int) -> list[np.ndarray]:
        """Return states every so many steps, within the patience; the last is the timed run's."""
        begun, simulation = time.process_time(), made[0].copy()
        rows, reach = [self.state(simulation)], self.end * (1 - 2.0**-40)
        while simulation.t < reach:
            if time.process_time() - begun > self.problem.patience:
                raise NoEnd(self.name)
            simulation.steps(every)
            simulation.synchronize()
            rows.append(self.state(simulation))
        return [*rows[:-1], self.state(self.solve(made, made[0].copy()))]

    def states(self, made: Any) -> States:
        """Return its own steps; at earlier checkpoints by steps that are cut to end there."""
        path = self._watched(made, 1)
        steps, ends, simulation = len(path) - 1, [], made[0].copy()
        for t in self.problem.times[:-1] if self.problem.checkpoints else ():
            simulation.integrate(float(t))
            ends.append(self.state(simulation))
        checkpoints = np.array([*ends, path[-1]])[: self.problem.checkpoints]
        rows = np.array([*path[: -1 : max(1, -(-steps // MOST_ROWS))], path[-1]])
        return States(checkpoints, rows, steps)


class WisdomHolman(ReboundContestant):
    """WHFast; the settings are numbers of steps, each twice the one before."""

    def ladder(self) -> Iterator[int]:
        """Yield numbers of steps, from a quarter of the scene's own on."""
        parts = max(1, self.problem.checkpoints)
        usual = math.floor(self.problem.duration / self.problem.scene.step) // 4
        return (max(1, round(usual / parts)) * parts * 2**k for k in range(40))

    def made(self, steps: int) -> Any:
        """Return a simulation at the start, and its steps."""
        simulation = self.start.copy()
        simulation.ri_whfast.corrector, simulation.ri_whfast.safe_mode = 17, 0
        simulation.ri_whfast.keep_unsynchronized = 1  # reading states does not change the run
        simulation.dt = self.end / steps
        return simulation, steps

    def solve(self, made: Any, simulation: Any) -> Any:
        """Run a number of equal steps, synchronised only at the end."""
        simulation.steps(made[1])
        simulation.synchronize()
        return simulation

    def states(self, made: Any) -> States:
        """Return states at equal distances, including the checkpoints."""
        path = np.array(self._watched(made, steps_between(self.problem, made[1])))
        return States.along(self.problem, path, made[1])

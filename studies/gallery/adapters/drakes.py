"""Drake on the pendulum: MultibodyPlant with steps of its own (discrete), as it is used."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator


@lru_cache(maxsize=64)
def simulator(h: float, g: float) -> Any:
    """A simulator of one point mass of 1 on a rod of 1."""
    plant = MultibodyPlant(time_step=h)
    inertia = SpatialInertia(1.0, np.array([0.0, 0.0, -1.0]), UnitInertia(1.0, 1.0, 0.0))
    body = plant.AddRigidBody("bob", inertia)
    place = np.array([0.0, 1.0, 0.0])
    plant.AddJoint(RevoluteJoint("pin", plant.world_frame(), body.body_frame(), place))
    plant.mutable_gravity_field().set_gravity_vector(np.array([0.0, 0.0, -g]))
    plant.Finalize()
    return plant, Simulator(plant)


def run(q: Any, v: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""
    if h < 0:
        raise ValueError("MultibodyPlant has no steps back")  # it would end the process
    plant, made = simulator(float(h), float(system.parameters.gravity))
    context = made.get_mutable_context()
    context.SetTime(0.0)
    plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
    made.Initialize()
    rows = [np.concatenate([q, v])]
    for k in range(1, steps // every + 1):
        made.AdvanceTo(k * every * h)
        rows.append(plant.GetPositionsAndVelocities(context))
    return np.array(rows)[:, :1], np.array(rows)[:, 1:]

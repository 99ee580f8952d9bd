"""A study of your own: what is measured of a method on a scene, and what that may be at most.

Try: discmech FILE:NAME pendulum
"""

from __future__ import annotations

from typing import Any

from discmech.studies import Study


class Starter(Study):
    name = "starter"
    title = "Corrections of a step"
    summary = "how many of Newton's corrections a step takes"
    about = (
        "Each step is solved by Newton's iteration from an extrapolated start; counted is how many "
        "corrections it takes. It can mislead: at smaller steps fewer are needed."
    )
    limits = {"mean": 10.0}  # Newton doubles the digits with each, so a sound start needs four

    def measure(self, case: Any, progress: Any) -> dict[str, Any]:
        """The numbers of one scene by one rule. Rows are optional; tables are made of them."""
        run = case.scheme.flow(case.scene.step).trajectory(case.steps or 1000)
        measured = {"mean": float(run.newton_mean), "most": int(run.newton_max)}
        return {"measured": measured, "rows": [measured]}


STUDY = Starter()

"""The possible axes of a work-precision diagram; `plot` has the words."""

WORK = ("seconds", "steps", "evaluations", "iterations")
#: relative errors (`accuracy.Yardstick`)
ERRORS = (
    "error", "error-x", "error-mu", "error-max", "error-x-max", "error-mu-max",
    "energy", "energy-max", "momentum", "momentum-max",
)  # fmt: skip

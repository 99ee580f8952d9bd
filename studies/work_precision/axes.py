"""The possible axes of a work-precision diagram, and their words."""

WORK = {
    "seconds": "run time in seconds",
    "steps": "steps",
    "evaluations": "evaluations of the right-hand side or the kernel",
    "iterations": "Newton iterations",
}
#: relative errors (`accuracy.Yardstick`)
ERRORS = {
    "error": "error in (x, μ) at the end",
    "error-x": "error in x at the end",
    "error-mu": "error in μ at the end",
    "error-max": "largest error in (x, μ)",
    "error-x-max": "largest error in x",
    "error-mu-max": "largest error in μ",
    "energy": "energy error at the end",
    "energy-max": "largest energy error",
    "momentum": "drift of the momenta at the end",
    "momentum-max": "largest drift of the momenta",
}

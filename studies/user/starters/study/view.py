"""How the numbers are shown; without this file they are shown plainly."""

from discmech.studies.report.view import View, measured_column
from discmech.studies.report.wording import limit

VIEW = View(columns=[measured_column("mean", "Corrections"), measured_column("most", "Most")],
            wanted=limit)  # fmt: skip

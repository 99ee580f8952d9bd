"""Lets `python -m discmech.studies.command` be the command."""

import sys

from . import main

if __name__ == "__main__":
    sys.exit(main())

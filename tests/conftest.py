"""How the tests run, whatever they test."""

import gc

# Expressions are many small objects that stay: looked through at every turn of the garbage
# collector they cost a fifth of the processor time.
gc.set_threshold(200_000, 50, 100)


def pytest_collection_finish():
    """What was imported and collected stays to the end as well."""
    gc.freeze()

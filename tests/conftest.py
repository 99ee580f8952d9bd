"""How the tests run, whatever they test."""

import gc
from contextlib import ExitStack
from itertools import groupby

import pytest

from discmech.studies.core.environment import collect_rarely, one_thread
from tests.objects.schedule import sample

collect_rarely()


def pytest_configure(config):
    """Tests run side by side, in processes of pytest that begin later."""
    settings = ExitStack()
    settings.enter_context(one_thread())
    config.add_cleanup(settings.close)


@pytest.hookimpl(tryfirst=True)  # before the slow ones are left out
def pytest_collection_modifyitems(items):
    """Slow are the cases that a law calls dear, and of one that is `sampled` all but a few.

    Those few hold every value of every argument.
    """
    for item in items:
        for mark in item.iter_markers("dear"):
            if any(word in item.name for word in mark.args):
                item.add_marker("slow")
    cases = [i for i in items if i.get_closest_marker("sampled") and hasattr(i, "callspec")]
    often = [i for i in cases if not i.get_closest_marker("slow")]
    for _, group in groupby(often, key=lambda item: (item.path, item.originalname)):
        law = list(group)
        taken = sample([item.callspec.params for item in law])
        for k in set(range(len(law))) - taken:
            law[k].add_marker("slow")


def pytest_collection_finish():
    """What was imported and collected stays to the end as well."""
    gc.freeze()

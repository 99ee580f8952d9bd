"""Shared by all tests; that this file is here lets any of them say `from everything import ...`."""

"""Causes: why a case did not pass."""

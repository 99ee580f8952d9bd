"""Schemes and their flows: starts, steps, runs, failures."""

"""Mutation of the bench's own judges and references: `make mutants`."""

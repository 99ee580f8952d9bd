"""Adapters of libraries: one file each, a few lines, imported where the library is."""

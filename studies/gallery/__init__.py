"""Widely used integrators, judged by the claims of their documentation.

Each has an adapter in `adapters/`, a few lines that give the library a state and read one back, and
an entry in `entries.py`: the scene, the documented claim and its place. Nothing here is loaded
unless `discmech gallery` asks for it.
"""

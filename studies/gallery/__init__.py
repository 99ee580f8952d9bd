"""Integrators that people use, judged by what their documentation says of them.

Each is an adapter in `adapters/`, a few lines that give the library a state and read one back, and
an entry in `entries.py`: the scene, the documented claim and the place where it stands. Nothing
here is loaded unless `discmech gallery` asks for it.
"""

"""From a question to its answer: how many digits are certain, why, and where they are kept.

Nothing is loaded here, so that `import discmech.reference` stays light.
"""

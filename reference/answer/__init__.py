"""The path from a question to its answer: certain digits, their evidence, and files of results.

Nothing is loaded here, so that `import discmech.reference` stays light.
"""

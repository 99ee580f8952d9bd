"""Starter files of `discmech new`, each in the form in which a user would write it."""

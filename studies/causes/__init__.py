"""The causes of cases that did not pass."""

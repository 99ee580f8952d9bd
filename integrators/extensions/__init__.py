"""What a scene or a scheme may be asked beside its motion; the core imports none of it."""

"""The modified Hamiltonian of a method on a scene, and whether runs keep it to its order."""

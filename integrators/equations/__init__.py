"""What is derived from one discrete Lagrangian: Legendre maps, residual, FL, W, Ω."""

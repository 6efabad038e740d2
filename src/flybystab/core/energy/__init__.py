"""The energy criterion: potential, perturbations, least critical energies."""

"""The rubble pile: body, material, equilibrium and stability."""

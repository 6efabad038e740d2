"""What the asteroid is: its body, its material, its equilibrium and its stability."""

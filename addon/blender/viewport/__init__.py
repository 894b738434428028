"""The 3D view: where it looks, and what is drawn over it."""

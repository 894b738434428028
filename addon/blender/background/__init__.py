"""What goes on while the artist looks on: tasks in slices and threads, fits, live faces."""

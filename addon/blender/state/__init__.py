"""What is kept: in preferences, in the scene, in faces; and what it means."""

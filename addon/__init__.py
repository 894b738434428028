"""The application: the only layer that composes the others.

``pipeline`` and ``cli`` know nothing of Blender; ``blender`` is the shell around them.
"""

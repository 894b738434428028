"""What is taken for a sketch, and the error for what is not. Light: read when Blender starts."""

FORMATS = ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "GIF", "PPM", "TGA")


class SketchError(ValueError):
    """A sketch that cannot be used; the text is one sentence for the artist."""

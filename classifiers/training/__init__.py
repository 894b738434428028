"""Making the detector: networks, drawing over, training, calibration, evaluation. Needs torch.

Nothing here is needed to read a drawing, and nothing of it ships to artists.
"""

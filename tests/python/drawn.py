"""What a picture shows, beside its axes and words, which are grey."""
import matplotlib.image
import numpy as np


def colours(path):
    """How many hues, of twelve, cover something. A PNG of 300 by 300 pixels at least."""
    pixels = matplotlib.image.imread(path)[..., :3]
    assert min(pixels.shape[:2]) >= 300, pixels.shape
    coloured = pixels[np.ptp(pixels, axis=2) > 0.2]
    red, green, blue = coloured.T
    hues = np.arctan2(np.sqrt(3) * (green - blue), 2 * red - green - blue)
    return int((np.histogram(hues, bins=12, range=(-np.pi, np.pi))[0] > 100).sum())

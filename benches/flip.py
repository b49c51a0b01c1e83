"""NVIDIA's FLIP of the image pairs of tests/flip.rs (pip install flip-evaluator).

    flip.py                 a line for each pair: mean, largest of a pixel, and of HDR-FLIP the exposures
    flip.py TEST REFERENCE  the mean of two files, .png (LDR-FLIP) or .exr (HDR-FLIP), as `vitrum compare` takes them

The tool is told nothing but the images: its default is 67 pixels per degree and the ACES tone curve.
"""

import sys

import flip_evaluator
import numpy

WIDTH, HEIGHT = 96, 64


def noise(x, y, channel, salt):
    """0 to 255, by the mixer `lowbias32` of C. Wellons."""
    n = (x + 1024 * (y + 1024 * (channel + 4 * salt))).astype(numpy.uint32)
    n = (n ^ n >> 16) * numpy.uint32(0x7FEB352D)
    n = (n ^ n >> 15) * numpy.uint32(0x846CA68B)
    return ((n ^ n >> 16) >> 24).astype(int)


def grain(x, y, c):
    reference = noise(x // 8, y // 8, c, 0)
    return reference + noise(x, y, c, 1) // 8 - 16, reference


def shift(x, y, c):
    board = lambda x: numpy.where((x // 6 + y // 6) % 2 == 1, 255, 2 * x + 20 * c)
    return board(x + 1), board(x)


def tint(x, y, c):
    ramp = 2 * x + y + 0 * c
    return numpy.choose(c, [ramp + 12, ramp, ramp - ramp // 16]), ramp


def blocks(x, y, c):
    reference = noise(x // 4, y // 4, c, 2) / 256 * 2.0 ** (noise(x // 16, y // 16, 0 * c, 3) // 32 - 3)
    return reference * (1 + (noise(x, y, c, 4) - 128) / 512), reference


def fireflies(x, y, c):
    reference = (x + 2 * y + 10 * c + 1) / 256
    return numpy.where(noise(x, y, 0 * c, 5) < 4, 64, reference), reference


def night(x, y, c):
    reference = numpy.where((x // 8 + y // 8) % 4 == 0, (2 * x + y) / 64, 0) + 0 * c
    return reference + noise(x, y, c, 6) / 65536, reference


def measure(test, reference, kind):
    errors, _, settings = flip_evaluator.evaluate(reference, test, kind, applyMagma=False)
    # The tool's own mean is a sum in 32 bits: of a million pixels it has three digits.
    line = "%.7f %.7f" % (errors.mean(dtype=numpy.float64), errors.max())
    if kind == "HDR":
        line += " %.5f %.5f %d" % tuple(settings[name] for name in ("startExposure", "stopExposure", "numExposures"))
    return line


if len(sys.argv) == 3:
    print(measure(*sys.argv[1:], "HDR" if sys.argv[1].endswith(".exr") else "LDR"))
    sys.exit()
for name, pair, (width, height) in [
    ("grain", grain, (WIDTH, HEIGHT)),
    ("shift", shift, (WIDTH, HEIGHT)),
    ("tint", tint, (WIDTH, HEIGHT)),
    ("stamp", grain, (7, 5)),
    ("blocks", blocks, (WIDTH, HEIGHT)),
    ("fireflies", fireflies, (WIDTH, HEIGHT)),
    ("night", night, (WIDTH, HEIGHT)),
]:
    y, x, c = numpy.indices((height, width, 3))
    display = pair in (grain, shift, tint)
    images = [numpy.clip(image, 0, 255) / 255 if display else image for image in pair(x, y, c)]
    images = [numpy.ascontiguousarray(image, numpy.float32) for image in images]
    print(name, measure(*images, "LDR" if display else "HDR"))

"""How long does each program take to a given error?

Error by the number of samples is measured at a few counts, from 1 on until it is small enough; between them it is
interpolated in logarithms, beyond them it falls as 1 / n. Time is that number of samples times what one takes at the
largest count. No program is measured against another: the error of a Monte Carlo mean is told by two independent
pictures, that of `tree`, which is none, by two of `path`, whose noise drops out.
"""

import dataclasses
import json
import math

import numpy

from compare import relative

TARGETS = (1e-2, 1e-3)
COUNTS = (1, 4, 16, 64)
# Error falls so with the samples where nothing says otherwise.
MONTE_CARLO_SLOPE = -1.0
# An error that is told by a product of mean 0 may come out below 0.
SMALLEST_ERROR = 1e-9
# Samples of the picture that says how bright each pixel is, for relMSE.
REFERENCE_SAMPLES = 256
# Mitsuba's best for few samples.
SAMPLER = "multijitter"


@dataclasses.dataclass
class Curve:
    """Error and milliseconds by samples."""

    samples: list = dataclasses.field(default_factory=list)
    errors: list = dataclasses.field(default_factory=list)
    milliseconds: list = dataclasses.field(default_factory=list)

    def add(self, samples, error, milliseconds):
        error = max(error, SMALLEST_ERROR)
        self.samples.append(samples)
        self.errors.append(error)
        self.milliseconds.append(milliseconds)

    def is_done(self):
        return bool(self.errors) and self.errors[-1] <= min(TARGETS)

    def sample_milliseconds(self):
        """Of one sample, at convergence."""
        return self.milliseconds[-1] / self.samples[-1]

    def samples_to(self, target):
        """At least one."""
        points = list(zip(self.samples, self.errors))
        for (n, error), (more, smaller) in zip(points, points[1:]):
            if error > target >= smaller:
                slope = math.log(smaller / error) / math.log(more / n)
                return n * (target / error) ** (1 / slope)
        n, error = points[0] if points[0][1] <= target else points[-1]
        return max(n * (target / error) ** (1 / MONTE_CARLO_SLOPE), 1.0)

    def seconds_to(self, target):
        return self.samples_to(target) * self.sample_milliseconds() / 1e3


def two_pictures(renderer, samples, seed):
    """Two independent pictures and the shorter time of both."""
    pictures, times = [], []
    for i in range(2):
        pictures.append(renderer.render(samples, seed + i))
        times.append(renderer.milliseconds())
    return pictures, min(times)


def monte_carlo_error(pictures, reference):
    first, second = pictures
    return float(relative((first - second) ** 2 / 2, reference).mean())


def error_of(picture, right, reference):
    """The relMSE of a picture, from two that are right but for noise of their own: its product has mean 0."""
    first, second = right
    return float(relative((picture - first) * (picture - second), reference).mean())


def curves(scene, make_ours, make_theirs):
    """A curve for Mitsuba and for each model, and how far the means of Mitsuba and `path` are apart, in per cent."""
    theirs = make_theirs(scene, analytic=True, sampler=SAMPLER)
    reference = theirs.render(REFERENCE_SAMPLES, 0)
    renderers = {"mitsuba": theirs, "path": make_ours(scene, "path")}
    measured = {name: Curve() for name in renderers}
    last = {}
    for k, samples in enumerate(COUNTS):
        for name, renderer in renderers.items():
            if not measured[name].is_done():
                last[name], milliseconds = two_pictures(renderer, samples, 2 * k + 1)
                measured[name].add(samples, monte_carlo_error(last[name], reference), milliseconds)
    if "tree" in scene.models:
        measured["tree"] = Curve()
        tree = make_ours(scene, "tree")
        for k, samples in enumerate(COUNTS):
            if not measured["tree"].is_done():
                picture = tree.render(samples, k)
                measured["tree"].add(samples, error_of(picture, last["path"], reference), tree.milliseconds())
    level = {name: numpy.mean(pictures) for name, pictures in last.items()}
    return measured, 100 * (level["path"] / level["mitsuba"] - 1)


def measure(scenes, make_ours, make_theirs, about, log):
    """Prints a line for each scene; `log` takes JSON lines."""
    names = ("tree", "path", "mitsuba")
    cells = [f"{name}, ms a sample" for name in names] + [f"{name} to {t:g}" for t in TARGETS for name in names]
    print("| scene | " + " | ".join(cells) + " | means differ by |")
    print("| --- " * (len(cells) + 2) + "|", flush=True)
    for scene in scenes:
        measured, difference = curves(scene, make_ours, make_theirs)
        of = lambda name, value: value(measured[name]) if name in measured else ""  # noqa: E731
        cells = [of(name, lambda c: "%.1f" % c.sample_milliseconds()) for name in names]
        cells += [of(name, lambda c: "%.2f s" % c.seconds_to(t)) for t in TARGETS for name in names]  # noqa: B023
        print("| " + " | ".join([scene.name, *cells]) + " | %+.2f %% |" % difference, flush=True)
        for name, curve in measured.items():
            seconds = {f"{t:g}": curve.seconds_to(t) for t in TARGETS}
            row = {"schema": 1, "kind": "time", "scene": scene.name, "renderer": name, "seconds_to": seconds}
            if log:
                print(json.dumps({**row, **dataclasses.asdict(curve), **about}), file=log, flush=True)

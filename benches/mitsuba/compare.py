"""Do both programs see the same? Each picture is a mean of independent runs, so that the noise of both is known."""

import dataclasses
import json

import numpy

# Independent pictures of each program.
THEIR_RUNS = 16
OUR_RUNS = {"path": 16, "tree": 4}
# Samples of each, before a scene's own factor.
THEIR_SAMPLES = 256
OUR_SAMPLES = {"path": 128, "tree": 64}
# Of `tree`, so that what it cuts off counts little; less than this takes minutes in walls that guide light.
OUR_OPTIONS = {"path": (), "tree": ("--tolerance", "1e-3")}
# What a ratio or a mean may be off by, in standard errors.
ALLOWED = 4.0
# Pictures no further apart than this, in relMSE and per cent of the mean, are equal: 32-bit arithmetic, and light that
# is guided inside for more than the largest depth.
EQUAL, EQUAL_PERCENT = 2e-6, 0.01
# The weight of dark pixels in relMSE.
DARK = 0.01


@dataclasses.dataclass
class Estimate:
    """The mean of independent pictures, its variance a pixel, and the mean over the image of each."""

    mean: numpy.ndarray
    variance: numpy.ndarray
    levels: numpy.ndarray


def estimate(renderer, samples, runs):
    pictures = numpy.stack([renderer.render(samples, i + 1) for i in range(runs)])
    return Estimate(pictures.mean(axis=0), pictures.var(axis=0, ddof=1) / runs, pictures.mean(axis=(1, 2, 3)))


def relative(squares, reference):
    return (squares / (reference**2 + DARK)).mean(axis=-1)


def verdict(ours, theirs):
    """How far apart two estimates are, beside how far apart their noise puts them."""
    reference = theirs.mean
    measured = relative((ours.mean - theirs.mean) ** 2, reference)
    expected = relative(ours.variance + theirs.variance, reference)
    off = abs(ours.mean - theirs.mean) > 3 * numpy.sqrt(ours.variance + theirs.variance) + 1e-6 * abs(reference)
    difference = ours.levels.mean() - theirs.levels.mean()
    error = numpy.sqrt(ours.levels.var(ddof=1) / len(ours.levels) + theirs.levels.var(ddof=1) / len(theirs.levels))
    row = {
        "relmse": measured.mean(),
        "expected": expected.mean(),
        "beyond_3_sigma": off.mean(),
        "mean": theirs.levels.mean(),
        "difference_percent": 100 * difference / theirs.levels.mean(),
    }
    row["agrees"] = bool(row["relmse"] < EQUAL and abs(row["difference_percent"]) < EQUAL_PERCENT)
    if row["expected"] == 0 or error == 0:
        return row
    ratio = row["relmse"] / row["expected"]
    ratio_error = (measured - ratio * expected).std() / numpy.sqrt(measured.size) / row["expected"]
    row |= {"ratio": ratio, "ratio_error": ratio_error, "difference_sigma": difference / error}
    row["agrees"] |= bool(ratio < 1 + ALLOWED * ratio_error and abs(row["difference_sigma"]) < ALLOWED)
    return row


HEADER = "| scene | model | relMSE | noise | ratio | mean differs by | beyond 3 sigma | |\n" + "| --- " * 8 + "|"


def line(name, model, row):
    ratio = "%.2f +- %.2f" % (row["ratio"], row["ratio_error"]) if "ratio" in row else ""
    sigma = ", %.1f sigma" % row["difference_sigma"] if "ratio" in row else ""
    cells = [name, model, "%.2e" % row["relmse"], "%.2e" % row["expected"], ratio]
    cells += ["%+.3f %%%s" % (row["difference_percent"], sigma), "%.2f %%" % (100 * row["beyond_3_sigma"])]
    simpler = "approximates " + ", ".join(row["approximate"]) if row["approximate"] else "DIFFERS"
    return "| " + " | ".join(cells + ["agrees" if row["agrees"] else simpler]) + " |"


def compare(scenes, make_ours, make_theirs, about, log, keep=None, effort=1.0):
    """Prints a line for each scene and model; `log` takes JSON lines, `keep` a folder for the pictures.

    Do all agree, but where Vitrum itself says that it approximates?
    """
    print(HEADER, flush=True)
    good = True
    for scene in scenes:
        factor = effort * scene.effort
        theirs = estimate(make_theirs(scene), int(THEIR_SAMPLES * factor), THEIR_RUNS)
        for model in scene.models:
            samples = max(int(OUR_SAMPLES[model] * factor), 1)
            renderer = make_ours(scene, model, OUR_OPTIONS[model])
            ours = estimate(renderer, samples, OUR_RUNS[model])
            row = verdict(ours, theirs) | {"approximate": renderer.stats["approximate"]}
            good = good and (row["agrees"] or bool(row["approximate"]))
            print(line(scene.name, model, row), flush=True)
            if keep:
                name = f"{scene.name} {model}".replace(" ", "-").replace(",", "")
                noise = {"ours_variance": ours.variance, "theirs_variance": theirs.variance}
                numpy.savez(keep / f"{name}.npz", ours=ours.mean, theirs=theirs.mean, **noise)
            if log:
                row = {"schema": 1, "kind": "compare", "scene": scene.name, "model": model, **row, **about}
                print(json.dumps(row), file=log, flush=True)
    return good

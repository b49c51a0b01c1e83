"""Vitrum beside Mitsuba 3: do both see the same, and how long does each take?

    python benches/mitsuba compare [SCENE...]     every scene through both; exit code 1 where they differ
    python benches/mitsuba time [SCENE...]        seconds to a relative mean squared error

docs/yardstick.md says how to install what this needs and how to read what it prints.
"""

import argparse
import contextlib
import dataclasses
import json
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy
import PIL.Image

import compare
import meshes
import ours
import scenes
import timing

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "assets/environments/city.exr"
TEXTURE_SIZE = 8


def texture(path):
    """Random colours, sRGB."""
    colours = numpy.random.default_rng(0).integers(20, 236, (TEXTURE_SIZE, TEXTURE_SIZE, 3), numpy.uint8)
    PIL.Image.fromarray(colours).save(path)


def commit():
    words = ["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return done.stdout.strip() or None


def size(text):
    width, height = text.split("x")
    return int(width), int(height)


def options():
    parser = argparse.ArgumentParser(prog="benches/mitsuba", description=__doc__.splitlines()[0])
    parser.add_argument("command", choices=("compare", "time"))
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="names or their beginnings; none: all")
    parser.add_argument("--vitrum", default=str(ROOT / "target/release/vitrum"), help="the program")
    parser.add_argument("--size", type=size, help="WxH; 128x96 for compare, 512x384 for time")
    parser.add_argument("--effort", type=float, default=1.0, help="compare: factor of the samples")
    parser.add_argument("--model", choices=("path", "tree"), help="compare: this one alone")
    parser.add_argument("--json", help="file that a JSON line for each result is added to")
    parser.add_argument("--keep", type=Path, help="compare: folder for the means and variances, as .npz")
    return parser.parse_args()


def main():
    asked = options()
    known = scenes.COMPARED if asked.command == "compare" else scenes.TIMED
    chosen = [s for s in known if not asked.scenes or any(s.name.startswith(name) for name in asked.scenes)]
    if not chosen:
        sys.exit(f"no scene {asked.scenes}; known: {', '.join(s.name for s in known)}")
    if not Path(asked.vitrum).is_file():
        sys.exit(f"{asked.vitrum} is not there: build it with cargo build --release, or name it with --vitrum")
    import theirs  # after the options: it takes a while

    pixels = asked.size or ((128, 96) if asked.command == "compare" else (512, 384))
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as files:
        folder = Path(name)
        made = meshes.make(folder)
        assets = {"environment": ENVIRONMENT, "texture": folder / "texture.png"}
        texture(assets["texture"])
        texels = ours.read_exr(ENVIRONMENT)
        log = files.enter_context(open(asked.json, "a")) if asked.json else None
        if asked.keep:
            asked.keep.mkdir(parents=True, exist_ok=True)

        def make_ours(scene, model, extra=()):
            return ours.Ours(asked.vitrum, scene, model, pixels, made, assets, folder, extra)

        def make_theirs(scene, **how):
            return theirs.Theirs(scene, pixels, made, assets, texels, **how)

        first = make_ours(scenes.BALL, "path")
        first.render(1, 0)
        about = {
            "size": pixels,
            "device": first.stats["device"],
            "vitrum": first.stats["vitrum"],
            "commit": commit(),
            "mitsuba": theirs.mitsuba.__version__,
            "variant": theirs.VARIANT,
            "processor": platform.machine(),
            "processors": len(os.sched_getaffinity(0)),
        }
        print(json.dumps(about))
        if asked.command == "compare":
            if asked.model:
                chosen = [dataclasses.replace(s, models=(asked.model,)) for s in chosen if asked.model in s.models]
            sys.exit(not compare.compare(chosen, make_ours, make_theirs, about, log, asked.keep, asked.effort))
        timing.measure(chosen, make_ours, make_theirs, about, log)


main()

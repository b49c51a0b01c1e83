"""Renders of Vitrum: a scene as its TOML file, the program as a process, the picture and the stats it wrote."""

import json
import subprocess

import numpy
import OpenEXR

DEPTH = 512


def material_lines(name, material, texture):
    yield f"[material.{name}]"
    if material.kind in ("glass", "pane"):
        yield 'kind = "dielectric"'
        yield f"ior = {material.ior}"
        yield f"roughness = {material.alpha ** 0.5}"
        yield f"dispersion = {material.dispersion}"
        yield f"priority = {material.priority}"
        yield f"thin_walled = {str(material.kind == 'pane').lower()}"
        if material.attenuation:
            color, distance = material.attenuation
            yield f"attenuation_color = {list(color)}"
            yield f"attenuation_distance = {distance}"
        return
    yield 'kind = "opaque"'
    if material.textured:
        yield f'base_color_texture = "{texture}"'
    if material.kind == "metal":
        yield "base_color = [1, 1, 1]"
        yield "metallic = 1.0"
        yield f"roughness = {material.alpha ** 0.5}"
    else:
        if not material.textured:
            yield f"base_color = {list(material.color)}"
        yield "specular = 0.0"
    if material.emission:
        yield f"emission = {list(material.emission)}"


def scene_file(scene, meshes, assets, path):
    """Writes the scene; `assets` has the paths of `environment` and `texture`."""
    eye, target, field, *up = scene.camera
    lines = ["[environment]", f"intensity = {scene.intensity}", f"rotation = {scene.rotation}"]
    lines.append(f"color = {list(scene.color)}" if scene.color else f'image = "{assets["environment"]}"')
    lines += ["[camera]", f"position = {list(eye)}", f"target = {list(target)}", f"vertical_fov = {field}"]
    lines += [f"up = {list(up[0])}"] if up else []
    for position, intensity in scene.lights:
        lines += ["[[light]]", 'kind = "point"', f"position = {list(position)}", f"intensity = {list(intensity)}"]
    for i, body in enumerate(scene.bodies):
        lines += material_lines(f"m{i}", body.material, assets["texture"])
        lines += ["[[object]]", f'mesh = "{meshes[body.mesh]}"', f'material = "m{i}"']
        lines += [f"smooth = {str(body.smooth).lower()}"]
        lines += [f"translate = {list(body.translate)}", f"rotate = {list(body.rotate)}", f"scale = {list(body.scale)}"]
    path.write_text("\n".join(lines) + "\n")


class Ours:
    """A scene that Vitrum renders with one of its models."""

    def __init__(self, vitrum, scene, model, size, meshes, assets, folder, options=()):
        self.vitrum, self.size, self.folder = vitrum, size, folder
        self.options = ["--model", model, "--effects", "auto,-energy-compensation", *options]
        self.file = folder / "scene.toml"
        scene_file(scene, meshes, assets, self.file)
        self.stats = None

    def render(self, samples, seed):
        """The picture, rows x columns x 3; `stats` are those of the last one."""
        picture, stats = self.folder / "ours.exr", self.folder / "stats.json"
        command = [self.vitrum, "render", self.file, "-o", picture, "--stats", stats, "-q"]
        command += ["--size", "%dx%d" % self.size, "--samples", samples, "--seed", seed, "--max-depth", DEPTH]
        subprocess.run([str(word) for word in command + self.options], check=True)
        self.stats = json.loads(stats.read_text())
        return read_exr(picture)

    def milliseconds(self):
        """Of the device, for the last picture."""
        return self.stats["gpu_ms"]


def read_exr(path):
    """Rows x columns x 3, in 64 bits."""
    channels = OpenEXR.File(str(path)).channels()
    together = [channels[name].pixels[..., :3] for name in ("RGB", "RGBA") if name in channels]
    picture = together[0] if together else numpy.stack([channels[name].pixels for name in "RGB"], axis=-1)
    return picture.astype(float)

"""Renders of Mitsuba 3: a scene as its dictionary.

What makes it simulate the same as Vitrum: indices as numbers (its air has 1.000277), GGX instead of Beckmann, no
roulette, Vitrum's depth, a box filter, face normals where Vitrum takes them, and an environment whose rows lie where
Vitrum's do (`environment_map`).
"""

import time

import mitsuba
import numpy

from ours import DEPTH
from scenes import SPHERES

for variant in ("llvm_ad_rgb", "scalar_rgb"):
    if variant in mitsuba.variants():
        try:
            mitsuba.set_variant(variant)
            mitsuba.load_dict({"type": "sphere"})
            break
        except Exception as error:  # no LLVM
            print(f"{variant}: {error}")
VARIANT = mitsuba.variant()

# Nanometres; beyond them there is less than 0.1 % of each primary.
VISIBLE = (390.0, 710.0)
# Wavelengths in one picture of glass that disperses.
WAVELENGTHS = 16
# KHR_materials_dispersion: n(lambda) = n_d + (n_d - 1) / V (523655 / lambda^2 - 1.5168), V = 20 / dispersion.
KHR_SQUARE, KHR_OFFSET = 523655.0, 1.5168
# CIE 1931 XYZ to linear Rec. 709.
TO_REC709 = numpy.array([
    [3.2409699419, -1.5373831776, -0.4986107603],
    [-0.9692436363, 1.8759675015, 0.0415550574],
    [0.0556300797, -0.2039769589, 1.0569715142],
])  # fmt: skip


def environment_map(texels):
    """A map that Mitsuba reads as Vitrum reads `texels`.

    Mitsuba's row j of H lies at v = j / (H - 1), Vitrum's at (j + 0.5) / H. Of 2H + 1 rows the odd ones lie where those
    of Vitrum do; the even ones are what is halfway between them.
    """
    rows, columns, _ = texels.shape
    texels = numpy.maximum(texels, 0)
    rows_between = (texels[:-1] + texels[1:]) / 2
    shifted = numpy.empty((2 * rows + 1, columns, 3), numpy.float32)
    shifted[1::2] = texels
    shifted[2:-1:2] = rows_between
    shifted[0], shifted[-1] = texels[0], texels[-1]
    return mitsuba.Bitmap(shifted)


def colour_matching_fit(wavelength):
    """CIE 1931 by Wyman, Sloan & Shirley 2013, as Vitrum."""

    def lobe(mean, below, above):
        return numpy.exp(-0.5 * ((wavelength - mean) * numpy.where(wavelength < mean, below, above)) ** 2)

    x = 0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323) - 0.065 * lobe(501.1, 0.049, 0.0382)
    y = 0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322)
    z = 1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725)
    return numpy.stack([x, y, z], axis=-1)


def colour_matching_table(wavelength):
    """CIE 1931 as published."""
    one = lambda w: numpy.array(mitsuba.cie1931_xyz(float(w))).ravel()  # noqa: E731
    return numpy.stack([one(w) for w in wavelength])


def lines(random, matching):
    """Wavelengths evenly over VISIBLE, moved at random, and their colours; all together white."""
    low, high = VISIBLE
    every = matching(numpy.linspace(low, high, 641)[:-1] + 0.25) @ TO_REC709.T
    wavelengths = low + (numpy.arange(WAVELENGTHS) + random.random()) / WAVELENGTHS * (high - low)
    return wavelengths, matching(wavelengths) @ TO_REC709.T / every.mean(axis=0) / WAVELENGTHS


def bsdf(material, texture):
    indices = {"int_ior": material.ior, "ext_ior": material.outside}
    if material.kind == "pane":
        return {"type": "thindielectric", **indices}
    if material.kind == "glass" and material.alpha == 0:
        return {"type": "dielectric", **indices}
    if material.kind == "glass":
        return {"type": "roughdielectric", "distribution": "ggx", "alpha": material.alpha, **indices}
    if material.kind == "metal" and material.alpha == 0:
        return {"type": "conductor", "material": "none"}
    if material.kind == "metal":
        return {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": material.alpha}
    reflectance = {"type": "rgb", "value": list(material.color)}
    if material.textured:
        reflectance = {"type": "bitmap", "filename": str(texture), "filter_type": "bilinear", "wrap_mode": "repeat"}
    return {"type": "twosided", "nested": {"type": "diffuse", "reflectance": reflectance}}


def shapes(body, meshes, texture, analytic):
    """The dictionaries of a body: one, or of a hollow ball without triangles two."""
    place = mitsuba.ScalarTransform4f().translate(list(body.translate))
    for axis, angle in ((2, body.rotate[2]), (1, body.rotate[1]), (0, body.rotate[0])):
        place = place.rotate([float(i == axis) for i in range(3)], angle)
    place = place.scale(list(body.scale))
    if analytic and body.mesh in SPHERES:
        for inside, outside, radius in SPHERES[body.mesh](body.material.ior):
            glass = {**bsdf(body.material, texture), "int_ior": inside, "ext_ior": outside}
            yield {"type": "sphere", "radius": radius, "to_world": place, "bsdf": glass}
        return
    shape = {"type": "obj", "filename": str(meshes[body.mesh]), "to_world": place, "face_normals": not body.smooth}
    shape["bsdf"] = bsdf(body.material, texture)
    if body.material.attenuation:
        color, distance = body.material.attenuation
        extinction = -numpy.log(color) / distance
        largest = float(extinction.max())  # its colours go up to 1
        share = {"type": "rgb", "value": (extinction / largest).tolist()}
        shape["interior"] = {"type": "homogeneous", "albedo": 0.0, "sigma_t": share, "scale": largest}
    if body.material.emission:
        shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": list(body.material.emission)}}
    yield shape


class Theirs:
    """A scene that Mitsuba renders. `analytic`: spheres as such, not as triangles."""

    def __init__(self, scene, size, meshes, assets, texels, analytic=False, sampler="independent"):
        eye, target, field, *up = scene.camera
        transform = mitsuba.ScalarTransform4f
        absorbs = any(body.material.attenuation for body in scene.bodies)
        film = {"type": "hdrfilm", "width": size[0], "height": size[1], "rfilter": {"type": "box"}}
        world = {
            "type": "scene",
            "integrator": {"type": "volpathmis" if absorbs else "path", "max_depth": DEPTH, "rr_depth": 100 * DEPTH},
            "sensor": {
                "type": "perspective",
                "fov": field,
                "fov_axis": "y",
                "to_world": transform().look_at(list(eye), list(target), list(up[0] if up else (0, 1, 0))),
                "film": film,
                "sampler": {"type": sampler},
            },
        }
        if scene.color is None:
            turned = transform().rotate([0, 1, 0], scene.rotation)
            surroundings = {"bitmap": environment_map(texels), "scale": scene.intensity, "to_world": turned}
            world["environment"] = {"type": "envmap", **surroundings}
        elif any(scene.color):
            world["environment"] = {"type": "constant", "radiance": {"type": "rgb", "value": list(scene.color)}}
        for i, (position, intensity) in enumerate(scene.lights):
            strength = {"type": "rgb", "value": list(intensity)}
            world[f"light{i}"] = {"type": "point", "position": list(position), "intensity": strength}
        bodies = scene.interfaces or scene.bodies
        made = [shape for body in bodies for shape in shapes(body, meshes, assets["texture"], analytic)]
        world |= {f"shape{i}": shape for i, shape in enumerate(made)}
        self.dispersing = {f"shape{i}": b.material for i, b in enumerate(bodies) if b.material.dispersion}
        self.matching = colour_matching_table if scene.published_colours else colour_matching_fit
        self.scene = mitsuba.load_dict(world)
        self.parameters = mitsuba.traverse(self.scene)
        self.seconds = None

    def render(self, samples, seed):
        """The picture, rows x columns x 3. Where glass disperses each wavelength gets its share of the samples."""
        start = time.perf_counter()
        if not self.dispersing:
            picture = numpy.array(mitsuba.render(self.scene, spp=samples, seed=seed)).astype(float)
        else:
            picture = 0.0
            wavelengths, colours = lines(numpy.random.default_rng(seed), self.matching)
            for k, (wavelength, colour) in enumerate(zip(wavelengths, colours)):
                self.set_wavelength(wavelength)
                share = mitsuba.render(self.scene, spp=max(samples // WAVELENGTHS, 1), seed=seed * WAVELENGTHS + k)
                picture = picture + numpy.array(share) * colour
        self.seconds = time.perf_counter() - start
        return picture

    def set_wavelength(self, wavelength):
        for shape, material in self.dispersing.items():
            bend = KHR_SQUARE / wavelength**2 - KHR_OFFSET
            index = material.ior + (material.ior - 1) * material.dispersion / 20 * bend
            self.parameters[f"{shape}.bsdf.eta"] = float(index / material.outside)
        self.parameters.update()

    def milliseconds(self):
        """For the last picture, in the program's own process and with its kernel compiled: of the second one on."""
        return self.seconds * 1e3

"""The scenes that both programs render, said once and in neither's words."""

import dataclasses

from meshes import SHELL_RADIUS

GREY = (0.4, 0.4, 0.4)


@dataclasses.dataclass(frozen=True)
class Material:
    """Glass, or what lets nothing through. `kind`: glass, pane, diffuse, metal (white, so that Fresnel's law is 1)."""

    kind: str
    ior: float = 1.5
    outside: float = 1.0  # index beyond the surface; Mitsuba is told, Vitrum knows
    alpha: float = 0.0
    dispersion: float = 0.0
    attenuation: tuple = None  # colour and distance
    priority: int = 0
    color: tuple = GREY
    textured: bool = False
    emission: tuple = None


@dataclasses.dataclass(frozen=True)
class Body:
    """A mesh by its name in meshes.make(), scaled, turned about x, y, z in degrees, then moved."""

    mesh: str
    material: Material
    translate: tuple = (0, 0, 0)
    rotate: tuple = (0, 0, 0)
    scale: tuple = (1, 1, 1)
    smooth: bool = True


@dataclasses.dataclass(frozen=True)
class Scene:
    name: str
    camera: tuple  # eye, target, vertical field of view in degrees, and up where it is not y
    bodies: tuple
    color: tuple = None  # of a constant environment in the place of the image
    intensity: float = 1.0
    rotation: float = 0.0
    lights: tuple = ()  # (position, intensity in W/sr)
    models: tuple = ("path", "tree")
    interfaces: tuple = None  # bodies for Mitsuba, where it needs others
    published_colours: bool = False  # CIE's table in Mitsuba, not the fit of it that Vitrum takes
    effort: float = 1.0  # samples beside those of other scenes


GLASS = Material("glass")
TABLE = Body("table", Material("diffuse"))
BALL_CAMERA = ((0, 0.6, 4), (0, 0, 0), 35)
TEAPOT_CAMERA = ((-0.7, 2, 5.2), (0.22, 0.42, 0.2), 36)
PRISM_CAMERA = ((0.8, 0.9, 3), (0, 0, 0), 32)
WATER_CAMERA = ((0, 1.15, 3), (0, 0.48, 0), 30)
DIAMOND_CAMERA = ((0, 2, 3.4), (0, -0.22, 0), 35)

CROWN = Material("glass", ior=1.5168)
# 20 over the Abbe number: 64, that of crown glass, and a flint that nobody makes, so that colours are wide apart.
DISPERSING = dataclasses.replace(CROWN, dispersion=20 / 64)
STRONGLY_DISPERSING = dataclasses.replace(CROWN, dispersion=2.0)


def rough(alpha):
    return Body("ball", Material("glass", alpha=alpha))


def prism(material):
    return (Body("prism", material, rotate=(0, 20, 0), smooth=False),)


BALL = Scene("ball", BALL_CAMERA, (Body("ball", GLASS),))
HOLLOW = Scene("hollow ball", BALL_CAMERA, (Body("hollow_ball", GLASS),))
TEAPOT = Scene(
    "teapot",
    TEAPOT_CAMERA,
    (
        Body("teapot_body", GLASS),
        Body("teapot_lid", GLASS),
        Body("cup_tumbler", GLASS, translate=(1.35, 0, 1.05)),
        Body("cup_tea", GLASS, translate=(-0.85, 0, 1.25), rotate=(0, 200, 0)),
        TABLE,
    ),
    effort=0.5,
)
ROUGH = Scene("rough ball, alpha 0.1", BALL_CAMERA, (rough(0.1),), models=("path",))
ROUGHER = Scene("rough ball, alpha 0.4", BALL_CAMERA, (rough(0.4),), models=("path",))
DIAMOND = Scene("diamond", DIAMOND_CAMERA, (Body("diamond", Material("glass", ior=2.42), smooth=False),))
WATER = Scene(
    "water in a glass",
    WATER_CAMERA,
    (
        Body("cup_tumbler", Material("glass", priority=1)),
        Body("water_volume_overlap", Material("glass", ior=1.33)),
        TABLE,
    ),
    interfaces=(
        Body("tumbler_dry", GLASS),
        Body("tumbler_wet", Material("glass", outside=1.33)),
        Body("water_surface", Material("glass", ior=1.33), smooth=False),
        TABLE,
    ),
)
PRISM = Scene("prism", PRISM_CAMERA, prism(CROWN))

# What time is measured on.
TIMED = (BALL, HOLLOW, TEAPOT, ROUGH, ROUGHER, DIAMOND, WATER, PRISM)

SMALL_TABLE = Body("small_table", Material("diffuse"))
COMPARED = TIMED + (
    Scene(
        "absorbing ball",
        BALL_CAMERA,
        (Body("ball", Material("glass", attenuation=((0.9, 0.5, 0.2), 1.0))),),
    ),
    Scene("prism, Abbe number 64", PRISM_CAMERA, prism(DISPERSING)),
    Scene("prism, Abbe number 10", PRISM_CAMERA, prism(STRONGLY_DISPERSING)),
    Scene("prism, CIE's table", PRISM_CAMERA, prism(STRONGLY_DISPERSING), published_colours=True),
    Scene("ball, surroundings turned", BALL_CAMERA, (Body("ball", GLASS),), rotation=90),
    Scene("ball, intensity 2", BALL_CAMERA, (Body("ball", GLASS),), intensity=2),
    Scene("ball, white furnace", BALL_CAMERA, (Body("ball", GLASS),), color=(1, 1, 1)),
    Scene("diamond, white furnace", DIAMOND_CAMERA, DIAMOND.bodies, color=(1, 1, 1)),
    Scene("ball behind a pane", BALL_CAMERA, (Body("ball", GLASS), Body("pane", Material("pane")))),
    Scene("flat-faced ball", BALL_CAMERA, (Body("ball", GLASS, smooth=False),)),
    Scene("ball, index 0.8", BALL_CAMERA, (Body("ball", Material("glass", ior=0.8)),)),
    Scene(
        "stretched and turned cup",
        (*BALL_CAMERA[:2], 40, (0.3, 1, 0.2)),
        (Body("cup_tea", GLASS, translate=(-0.2, -0.5, 0.4), rotate=(30, 40, 50), scale=(1.4, 2, 1)),),
    ),
    Scene(
        "rough hollow ball, alpha 0.2",
        BALL_CAMERA,
        (Body("hollow_ball", Material("glass", alpha=0.2)),),
        models=("path",),
    ),
    Scene(
        "rough diamond, alpha 0.1",
        DIAMOND_CAMERA,
        (Body("diamond", Material("glass", ior=2.42, alpha=0.1), smooth=False),),
        models=("path",),
    ),
    Scene("white metal, alpha 0.16", BALL_CAMERA, (Body("ball", Material("metal", alpha=0.16)),)),
    Scene("white mirror", BALL_CAMERA, (Body("ball", Material("metal")),)),
    Scene(
        "textured table",
        BALL_CAMERA,
        (Body("ball", GLASS), Body("small_table", Material("diffuse", textured=True))),
    ),
    Scene(
        "point light",
        BALL_CAMERA,
        (Body("ball", Material("diffuse", color=(0.7, 0.3, 0.2))), SMALL_TABLE),
        color=(0, 0, 0),
        lights=(((1.5, 2, 1), (10, 9, 8)),),
    ),
    Scene(
        "lamp",
        BALL_CAMERA,
        (Body("ball", GLASS), Body("lamp", Material("diffuse", emission=(4, 3, 2))), SMALL_TABLE),
        color=(0.1, 0.1, 0.1),
    ),
)

# Bodies that Mitsuba has without triangles: index in, index out and radius of each sphere, from the glass's index.
SPHERES = {"ball": lambda n: ((n, 1.0, 1.0),), "hollow_ball": lambda n: ((n, 1.0, 1.0), (1.0, n, SHELL_RADIUS))}

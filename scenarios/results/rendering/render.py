"""Pictures of surfaces by path tracing: on any CPU, without a screen, a GPU or OpenGL."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.graph import smooth_shade

from scenarios.errors import OutputError
from scenarios.results.rendering.camera import Array, Camera
from scenarios.results.rendering.studio import FLAT, NARROW, WIDE, backdrop, studio

Colour = tuple[float, float, float]

TISSUE: Final[Colour] = (0.52, 0.17, 0.15)
"""Reflectance of red, green and blue light."""

_VARIANT: Final = "scalar_rgb"
_GLASS_INDEX: Final = 1.5
_CREASE: Final = np.radians(45.0)
"""Angle between two triangles of a glass beyond which their edge is drawn as sharp."""
_SAMPLES: Final = 36
_SAMPLES_THROUGH_GLASS: Final = 64
"""Paths through each pixel. They leave a grain of about 1 % of the light."""
_FAR: Final = 12.0
"""Distance of the camera over the height of the picture: near a parallel projection."""


@dataclass(frozen=True)
class Surface:
    """A surface to draw.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Positions, m.
    triangles : ndarray of int, shape (m, 3)
        Counter-clockwise seen from outside.
    colour : tuple, or ndarray of shape (n, 3)
        Reflectance, of the whole or of each point, linear red, green and blue.
    glass : bool
        Clear glass that fills the surface.
    """

    points: Array
    triangles: NDArray[np.integer]
    colour: Colour | Array = TISSUE
    glass: bool = False


def render(surfaces: Sequence[Surface], camera: Camera) -> Array:
    """Draw surfaces on white.

    Parameters
    ----------
    surfaces : sequence of Surface
        Closed ones.
    camera : Camera
        Where from.

    Returns
    -------
    ndarray, shape (height, width, 4)
        Red, green, blue on white, and the share of each pixel that a surface covers; 0 to 1.

    Raises
    ------
    OutputError
        If the renderer is not installed.
    """
    mi = renderer()
    clear = any(surface.glass for surface in surfaces)
    mapped = any(not isinstance(surface.colour, tuple) for surface in surfaces)
    light = FLAT if mapped else WIDE if clear else NARROW
    scene = mi.load_dict(
        {
            "type": "scene",
            # two bounces inside a body; glass takes four surfaces each way, and their reflections
            "integrator": {"type": "path", "max_depth": 14 if clear else 3, "hide_emitters": True},
            "sensor": _sensor(mi, camera, _SAMPLES_THROUGH_GLASS if clear else _SAMPLES),
            "sky": studio(mi, camera, light),
            **({"backdrop": backdrop(mi, camera)} if clear else {}),
            **{f"surface{i}": _mesh(mi, f"surface{i}", s) for i, s in enumerate(surfaces)},
        }
    )
    image = np.asarray(mi.render(scene), dtype=float)
    covered = np.clip(image[..., 3:], 0.0, 1.0)
    on_white = np.clip(image[..., :3] + 1 - covered, 0.0, 1.0)
    return np.concatenate([_encoded(on_white), covered], axis=-1)


def renderer() -> Any:
    """Return Mitsuba 3, in the variant that needs no compiler at run time.

    Raises
    ------
    OutputError
        If it is not installed.
    """
    try:
        import mitsuba as mi
    except (ImportError, NameError) as error:  # its loader ends in a NameError without libatomic
        raise OutputError(
            f"pictures of surfaces need Mitsuba 3, which cannot be imported ({error}): "
            'pip install "softbody-cosim[render]". On a Linux without the GNU compiler\'s run-time '
            "libraries, install libatomic1 as well"
        ) from error
    if mi.variant() != _VARIANT:
        mi.set_variant(_VARIANT)
    return mi


def linear(colours: Array) -> Array:
    """Reflectances of colours that are encoded as sRGB, 0 to 1."""
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)


def _encoded(light: Array) -> Array:
    """Encode linear light as sRGB."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def _sensor(mi: Any, camera: Camera, samples: int) -> dict[str, Any]:
    origin = np.array(camera.target) + _FAR * camera.height * camera.axes[2]
    width, height = camera.pixels
    return {
        "type": "perspective",
        "fov": float(2 * np.degrees(np.arctan(0.5 / _FAR))),
        "fov_axis": "y",
        "to_world": mi.ScalarTransform4f().look_at(
            origin=origin.tolist(), target=list(camera.target), up=[0, 0, 1]
        ),
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": "rgba",
            "rfilter": {"type": "gaussian"},
        },
        "sampler": {"type": "multijitter", "sample_count": samples},
    }


def _mesh(mi: Any, name: str, surface: Surface) -> Any:
    mixed = not isinstance(surface.colour, tuple)
    if surface.glass:
        look: dict[str, Any] = {"type": "dielectric", "int_ior": _GLASS_INDEX}
    else:
        look = {
            "type": "principled",
            "base_color": {"type": "mesh_attribute", "name": "vertex_color"}
            if mixed
            else {"type": "rgb", "value": list(surface.colour)},
            "roughness": 0.5,
            "specular": 0.0 if mixed else 0.4,  # a highlight would hide the colour
        }
        look = {"type": "twosided", "bsdf": look}  # a point may poke through the sheet behind it
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(look)
    shape = trimesh.Trimesh(surface.points, surface.triangles, process=False)
    if surface.glass:  # a rim is sharp: light would bend at normals that are averaged over it
        shape = smooth_shade(shape, angle=_CREASE)
    mesh = mi.Mesh(
        name, len(shape.vertices), len(shape.faces), has_vertex_normals=True, props=properties
    )
    if mixed:
        mesh.add_attribute("vertex_color", 3, np.ravel(surface.colour).astype(np.float32))
    arrays = mi.traverse(mesh)
    arrays["vertex_positions"] = np.ravel(shape.vertices).astype(np.float32)
    arrays["vertex_normals"] = np.ravel(shape.vertex_normals).astype(np.float32)
    arrays["faces"] = np.ravel(shape.faces).astype(np.uint32)
    arrays.update()
    return mesh

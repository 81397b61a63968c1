"""Draw a scene of the recursive ray tracing assignment with Tachyon's library.

    python draw.py scene.dat scene.exr

The scene file is Tachyon's own. Its program reads it in single precision and writes 16 bits a channel; the library
behind the program computes in double precision and hands over floats, which is all that is added here. Coordinates stay
the assignment's in the file; `--unit` scales them, since Tachyon's tolerances are absolute (1e-9).
"""

from __future__ import annotations

import argparse
import ctypes
import re
from collections.abc import Iterator
from ctypes import POINTER, c_char, c_char_p, c_double, c_float, c_int, c_void_p
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

LIBRARY = "libtachyon.so.0"  # on Debian: of libtachyon-mt-0, which tachyon-bin-nox brings
RELEASE, MARK = "0.99", b"LIBTACHYON_0.9.9"  # whose tachyon.h this follows, and how its functions are marked
FULL = 5  # RT_SHADER_FULL

Fields = dict[str, list[float]]


class Vector(ctypes.Structure):
    """`apivector` of tachyon.h."""

    _fields_ = [(axis, c_double) for axis in "xyz"]


class Colour(ctypes.Structure):
    """`apicolor`."""

    _fields_ = [(channel, c_float) for channel in "rgb"]


class Texture(ctypes.Structure):
    """`apitexture`."""

    _fields_ = [
        ("texturefunc", c_int),
        ("col", Colour),
        ("shadowcast", c_int),
        ("ambient", c_double),
        ("diffuse", c_double),
        ("specular", c_double),
        ("opacity", c_double),
        ("mapping", Vector * 6),
        ("imap", c_char * 96),
    ]


Message = ctypes.CFUNCTYPE(None, c_int, c_char_p)
SHAPES = {  # the function of each and its arguments by their names in a scene file
    "SPHERE": ("rt_sphere", ("CENTER", "RAD")),
    "PLANE": ("rt_plane", ("CENTER", "NORMAL")),
    "RING": ("rt_ring", ("CENTER", "NORMAL", "INNER", "OUTER")),
    "STRI": ("rt_stri", ("V0", "V1", "V2", "N0", "N1", "N2")),
}
PROTOTYPES: dict[str, tuple[Any, ...]] = {  # what each function takes, after what it returns
    "rt_initialize": (c_int, c_void_p, c_void_p),
    "rt_set_ui_message": (None, Message),
    "rt_newscene": (c_void_p,),
    "rt_resolution": (None, c_void_p, c_int, c_int),
    "rt_outputfile": (None, c_void_p, c_char_p),
    "rt_rawimage_rgb96f": (None, c_void_p, c_void_p),
    "rt_set_numthreads": (None, c_void_p, c_int),
    "rt_shadermode": (None, c_void_p, c_int),
    "rt_shadow_filtering": (None, c_void_p, c_int),
    "rt_background": (None, c_void_p, Colour),
    "rt_camera_setup": (None, c_void_p, c_double, c_double, c_int, c_int, Vector, Vector, Vector),
    "rt_camera_frustum": (None, c_void_p, c_double, c_double, c_double, c_double),
    "rt_texture": (c_void_p, c_void_p, POINTER(Texture)),
    "rt_light": (c_void_p, c_void_p, c_void_p, Vector, c_double),
    "rt_light_attenuation": (None, c_void_p, c_double, c_double, c_double),
    "rt_sphere": (None, c_void_p, c_void_p, Vector, c_double),
    "rt_plane": (None, c_void_p, c_void_p, Vector, Vector),
    "rt_ring": (None, c_void_p, c_void_p, Vector, Vector, c_double, c_double),
    "rt_stri": (None, c_void_p, c_void_p, *[Vector] * 6),
    "rt_renderscene": (None, c_void_p),
    "rt_finalize": (None,),
}


def load_library() -> ctypes.CDLL:
    """Tachyon's library. Another release may lay out its structures otherwise, so that it is not even tried."""
    try:
        tachyon = ctypes.CDLL(LIBRARY)
    except OSError as error:
        raise SystemExit(f"{LIBRARY} is missing; on Debian: apt-get install tachyon-bin-nox ({error})") from None
    marked = ctypes.CDLL(None).dlvsym
    marked.restype, marked.argtypes = c_void_p, (c_void_p, c_char_p, c_char_p)
    for name, (result, *arguments) in PROTOTYPES.items():
        if not marked(tachyon._handle, name.encode(), MARK):
            raise SystemExit(f"{LIBRARY} is not Debian's Tachyon {RELEASE}: it has no {name}@{MARK.decode()}")
        function = getattr(tachyon, name)
        function.restype, function.argtypes = result, arguments
    return tachyon


def statements(text: str) -> Iterator[tuple[str, Fields]]:
    """The statements of a scene file that begin at the start of a line: the first word, and the numbers by name."""
    for statement in re.split(r"\n(?!\s)", re.sub(r"(?m)^\s*#.*\n", "", text).strip()):
        found = re.findall(r"([A-Z]\w*)((?:\s+[-+.\d][-+.\w]*)*)", statement)
        yield found[0][0], {name: list(map(float, numbers.split())) for name, numbers in found}


class Scene:
    """A scene in Tachyon, where `unit` is what a length of 1 becomes."""

    def __init__(self, tachyon: ctypes.CDLL, unit: float) -> None:
        self.tachyon, self.unit = tachyon, unit
        self.handle = tachyon.rt_newscene()

    def read(self, text: str) -> None:
        """Take over a scene file."""
        for kind, fields in statements(text):
            if kind in SHAPES:
                function, names = SHAPES[kind]
                arguments = [self.length(fields[name]) for name in names]
                getattr(self.tachyon, function)(self.handle, self.texture(fields), *arguments)
            elif kind == "LIGHT":
                self.light(fields)
            elif kind == "CAMERA":
                self.camera(fields)
            elif kind == "RESOLUTION":
                self.width, self.height = map(int, fields[kind])
        self.tachyon.rt_shadow_filtering(self.handle, 0)

    def length(self, values: list[float]) -> Any:
        """A length, a point or a direction, which can be of any length."""
        scaled = [value * self.unit for value in values]
        return Vector(*scaled) if len(scaled) == 3 else scaled[0]

    def texture(self, fields: Fields) -> Any:
        """The surface of an object."""
        factors = {name: fields.get(name.upper(), [0])[0] for name in ("ambient", "diffuse", "specular", "opacity")}
        texture = Texture(col=Colour(*fields["COLOR"]), shadowcast=1, **factors)
        return self.tachyon.rt_texture(self.handle, ctypes.byref(texture))

    def light(self, fields: Fields) -> None:
        """A point light."""
        centre, radius = self.length(fields["CENTER"]), self.length(fields["RAD"])
        light = self.tachyon.rt_light(self.handle, self.texture(fields), centre, radius)
        self.tachyon.rt_light_attenuation(light, *(fields[name][0] for name in ("CONSTANT", "LINEAR", "QUADRATIC")))

    def camera(self, fields: Fields) -> None:
        """The camera."""
        zoom, aspect, samples, depth = (fields[name][0] for name in ("ZOOM", "ASPECTRATIO", "ANTIALIASING", "RAYDEPTH"))
        vectors = (self.length(fields[name]) for name in ("CENTER", "VIEWDIR", "UPDIR"))
        self.tachyon.rt_camera_setup(self.handle, zoom, aspect, int(samples), int(depth), *vectors)
        self.tachyon.rt_camera_frustum(self.handle, *fields["FRUSTUM"])

    def render(self, threads: int) -> NDArray[np.float32]:
        """The picture: height x width x 3, row 0 on top."""
        image = np.zeros((self.height, self.width, 3), np.float32)
        self.tachyon.rt_resolution(self.handle, self.width, self.height)
        self.tachyon.rt_outputfile(self.handle, b"")
        self.tachyon.rt_rawimage_rgb96f(self.handle, image.ctypes.data)
        self.tachyon.rt_set_numthreads(self.handle, threads)
        self.tachyon.rt_shadermode(self.handle, FULL)
        self.tachyon.rt_background(self.handle, Colour(0, 0, 0))
        self.tachyon.rt_renderscene(self.handle)
        return image[::-1].copy()


def write(path: Path, image: NDArray[np.float32]) -> None:
    """Write the picture as it is, in float32."""
    height, width, channels = image.shape
    output = oiio.ImageOutput.create(str(path))
    if not output or not output.open(str(path), oiio.ImageSpec(width, height, channels, oiio.FLOAT)):
        raise SystemExit(f"{path}: cannot be written")
    if not (output.write_image(image) and output.close()):
        raise SystemExit(f"{path}: {output.geterror()}")


def main() -> None:
    """Render the scene file into the picture file."""
    tachyon = load_library()
    parser = argparse.ArgumentParser(description="Draw a scene of the assignment with Tachyon's library.")
    parser.add_argument("scene", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--unit", type=float, default=1.0, help="what a length of 1 becomes")
    parser.add_argument("--threads", type=int, default=0, help="0 for one on each processor")
    parser.add_argument("--version", action="version", version=f"Tachyon {RELEASE}")
    options = parser.parse_args()
    text = options.scene.read_text(encoding="ascii")
    if tachyon.rt_initialize(None, None) < 0:
        raise SystemExit("Tachyon does not start")
    say = Message(lambda level, text: print(text.decode(), flush=True))
    tachyon.rt_set_ui_message(say)
    scene = Scene(tachyon, options.unit)
    scene.read(text)
    write(options.picture, scene.render(options.threads))
    tachyon.rt_finalize()


if __name__ == "__main__":
    main()

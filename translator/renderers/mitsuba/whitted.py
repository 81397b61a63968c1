"""Draw a scene of the recursive ray tracing assignment with Mitsuba 3.

    python whitted.py scene.xml scene.exr

The scene file uses Mitsuba's own shapes, BSDFs, emitters, sensor and film; what is added here is the integrator
`whitted`: a point light without falloff, hard shadows, perfect mirrors, and one normal for both sides.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import statistics
import time
from importlib import metadata
from pathlib import Path

# Dr.Jit needs an LLVM and aborts with some that systems ship; the wheel karellen-llvm-core brings one that works.
with contextlib.suppress(metadata.PackageNotFoundError):
    for file in metadata.files("karellen-llvm-core") or []:
        if file.name.startswith("libLLVM.so."):
            os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(Path(str(file.locate())).resolve()))

import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

FEWEST_THREADS = 2  # with one, Mitsuba 3.9.1 waits for itself when it writes the picture
MIRROR = 1  # the second lobe of the blended BSDF in the scene file; the first is diffuse


class Whitted(mi.SamplingIntegrator):
    """Ambient (as emission), one shadow ray to the point light, one mirrored ray; `max_depth` bounces."""

    def __init__(self, properties: mi.Properties) -> None:
        super().__init__(properties)
        self.max_depth = properties.get("max_depth", 3)
        self.stretch = properties.get("stretch", 1.0)  # height of a pixel over its width
        self.precision = properties.get("precision", 3e-6)  # of a hit point, relative to its coordinates

    def clearance(self, hit: mi.SurfaceInteraction3f, direction: mi.Vector3f) -> mi.Float:
        """How far along `direction` a float32 ray must start to be clear of the surface it leaves."""
        slope = dr.maximum(abs(dr.dot(hit.n, direction)), 1e-4)
        return self.precision * (1 + dr.max(abs(hit.p))) / slope

    @dr.syntax
    def sample(
        self,
        scene: mi.Scene,
        sampler: mi.Sampler,
        ray: mi.RayDifferential3f,
        medium: mi.Medium = None,
        active: bool = True,
    ) -> tuple[mi.Color3f, mi.Bool, list[mi.Float]]:
        """The colour that each camera ray brings back."""
        light = next(e for e in scene.emitters() if mi.has_flag(e.flags(), mi.EmitterFlags.DeltaPosition))
        every_lobe, mirror = mi.BSDFContext(), mi.BSDFContext()
        mirror.component = MIRROR
        ray = mi.Ray3f(ray)
        ray.o.y *= self.stretch
        ray.d.y *= self.stretch
        ray.d = dr.normalize(ray.d)
        active = mi.Bool(active)
        colour = mi.Spectrum(0)
        weight = mi.Spectrum(1)
        depth = mi.UInt32(0)
        while active:
            hit = scene.ray_intersect(ray, active)
            active &= hit.is_valid()
            side = dr.copysign(mi.Float(1), hit.wi.z)
            hit.wi.z = abs(hit.wi.z)  # both sides of a surface emit and reflect
            bsdf = hit.bsdf()
            colour[active] += weight * hit.emitter(scene, active).eval(hit, active)

            to_light, intensity = light.sample_direction(hit, mi.Point2f(0.5), active)
            local = bsdf.eval(every_lobe, hit, hit.to_local(to_light.d), active) * intensity * dr.square(to_light.dist)
            facing = active & dr.any(local != 0)
            start = dr.maximum(self.clearance(hit, to_light.d), 1e-4 * to_light.dist)
            shadow = hit.spawn_ray_to(to_light.p)
            shadow.d = to_light.d
            shadow.o = dr.fma(to_light.d, start, hit.p)
            shadow.maxt = to_light.dist - start
            lit = facing & ~scene.ray_test(shadow, facing)
            colour[lit] += weight * local

            mirrored, reflectance = bsdf.sample(mirror, hit, mi.Float(0.5), mi.Point2f(0.5), active)
            direction = hit.to_world(mi.Vector3f(mirrored.wo.x, mirrored.wo.y, mirrored.wo.z * side))
            weight *= reflectance
            depth += 1
            active &= (depth <= self.max_depth) & dr.any(weight != 0)
            ray = hit.spawn_ray(direction)
            ray.o = dr.fma(direction, self.clearance(hit, direction), hit.p)
        return colour, mi.Bool(True), []


def main() -> None:
    """Render the scene file into the picture file; `--time` renders a few times more and prints how long that took."""
    parser = argparse.ArgumentParser(description="Draw a scene with the integrator `whitted`.")
    parser.add_argument("scene", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--time", action="store_true", help="print how long tracing takes, without compilation")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    dr.set_thread_count(max(FEWEST_THREADS, options.threads))
    mi.register_integrator("whitted", Whitted)
    scene = mi.load_file(str(options.scene))
    image = mi.render(scene)
    mi.Bitmap(image).write(str(options.picture))
    runs = []
    for _ in range(5 if options.time else 0):
        start = time.perf_counter()
        dr.eval(mi.render(scene))
        dr.sync_thread()
        runs.append(time.perf_counter() - start)
    if runs:
        print(f"traced in {statistics.median(runs):.4f} s, the median of {len(runs)} without start-up and files")


if __name__ == "__main__":
    main()

"""CPU seconds to a given error, radbake beside Cycles, in one run on one machine.

  bench_cycles.py SCENE.glb --bin build/release/bin --size N -o DIR [--reference REF.exr [--reference-scale S]
                  [--reference-error E]] [--targets 10,5,2,1] [--spp 16,64,256] [--repeat 3]

Both bake the scene's own TEXCOORD_1, of one sheet of N x N texels, on two threads, and both are compared with one
reference (irradiance in lx after --reference-scale; default: a dense bake of ours, which is kept in DIR).

Of radbake, `submit --max-error`: CPU seconds of the worker, from report.json, and of all processes. Of Cycles: of the
bake alone and of the whole of Blender. Each is run --repeat times, by turns, and the least counts: what else the machine
does only adds. The error of Cycles falls like 1/sqrt(spp) and its time is linear in spp; both laws are fitted to what was
measured, so that its time to a target is known, also beyond the largest spp (marked ~).
Needs Debian's blender, python3-numpy and python3-openimageio: deploy/install-packages peer test.
"""
import argparse
import json
import math
import os
import pathlib
import resource
import subprocess
import sys

import numpy as np
import OpenImageIO as oiio

HERE = pathlib.Path(__file__).parent
# Of our own reference, where none is given.
DENSE = ["--rays", "2048", "--max-patches", "65536"]


def measured(command):
    """Runs a command; its stdout, and CPU seconds of it and all that it started."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = subprocess.run(list(map(str, command)), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if result.returncode != 0:
        raise SystemExit(f"{command[0]} failed with {result.returncode}:\n{result.stdout[-2000:]}{result.stderr[-2000:]}")
    return result.stdout, sum(after[:2]) - sum(before[:2])


class Bench:
    def __init__(self, arguments):
        self.scene, self.bin, self.size = arguments.scene, arguments.bin, arguments.size
        self.out, self.threads = arguments.out, 2
        self.out.mkdir(parents=True, exist_ok=True)
        self.reference, self.scale, self.own_error = arguments.reference, arguments.reference_scale, arguments.reference_error

    def submit(self, folder, *options):
        """-> report, CPU seconds of all processes"""
        _, cpu = measured([self.bin / "radbake", "submit", self.scene, "-o", folder, "--force", "--atlas-size", self.size,
                           "--lightmap-uv", "keep", "--threads", self.threads, *options])
        return json.loads((folder / "report.json").read_text()), cpu

    def make_reference(self):
        """The mean of two seeds; half their difference is its error."""
        maps = []
        for seed in 1, 2:
            folder = self.out / f"reference_{seed}"
            self.submit(folder, *DENSE, "--seed", seed)
            maps.append(read(folder / "lightmap_0.exr"))
        self.reference, self.scale = self.out / "reference_1" / "mean.exr", 1
        write(self.reference, (maps[0] + maps[1]) / 2)
        self.own_error = self.difference(self.out / "reference_1" / "lightmap_0.exr")

    def difference(self, path, scale=1):
        """Relative RMSE of a map of irradiance in lx x scale, as measured: of texels that bakes of ours did measure, and
        not only fill from their neighbours."""
        errors = [p.parent / "error_0.exr" for p in (self.reference, path) if (p.parent / "error_0.exr").exists()]
        options = []
        if errors:
            mask = np.min([read(p)[..., 3:] for p in errors], axis=0)
            write(self.out / "mask.exr", np.repeat(mask, 3, axis=2))
            options = ["--mask", self.out / "mask.exr"]
        text, _ = measured([self.bin / "radbake", "compare", self.reference, path, "--scale", 1 / self.scale / scale,
                            "--json", *options])
        return json.loads(text)["rrmse"]

    def true_error(self, path, scale=1):
        """Without what the reference itself is off by."""
        return math.sqrt(max(self.difference(path, scale) ** 2 - self.own_error ** 2, 0))

    def by_radbake(self, target):
        folder = self.out / f"radbake_{100 * target:g}"
        report, cpu = self.submit(folder, "--max-error", f"{100 * target:g}%")
        return {"target": target, "stated": report["error"]["relative_rmse"], "passes": len(report["passes"]),
                "error": self.true_error(folder / "lightmap_0.exr"), "cpu": report["run"]["cpu_seconds"], "whole": cpu}

    def by_cycles(self, spp):
        pixels = self.out / f"cycles_{spp}.npy"
        text, cpu = measured(["blender", "-b", "--factory-startup", "--python", HERE / "bake_by_cycles.py", "--", self.scene,
                              pixels, "--size", self.size, "--spp", spp, "--threads", self.threads])
        answer = next(json.loads(line) for line in text.splitlines() if line.startswith('{"cpu_seconds"'))
        write(pixels.with_suffix(".exr"), np.load(pixels))
        pixels.unlink()
        return {"spp": spp, "error": self.true_error(pixels.with_suffix(".exr"), 1 / math.pi), "cpu": answer["cpu_seconds"],
                "whole": cpu}


def read(path):
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT))


def write(path, pixels):
    image = oiio.ImageBuf(oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], oiio.FLOAT))
    image.set_pixels(oiio.ROI(), np.ascontiguousarray(pixels, np.float32))
    if not image.write(os.fspath(path)):
        raise SystemExit(image.geterror())


def cheapest(runs):
    """Of equal bakes: everything is equal but the times."""
    return {**runs[0], "cpu": min(r["cpu"] for r in runs), "whole": min(r["whole"] for r in runs)}


def laws(points):
    """Of Cycles: error = k / sqrt(spp), CPU = fixed + each * spp."""
    k = math.exp(sum(math.log(p["error"] * math.sqrt(p["spp"])) for p in points) / len(points))
    spp, cpu = np.array([p["spp"] for p in points]), np.array([p["cpu"] for p in points])
    if len(points) < 2:
        return k, 0.0, cpu[0] / spp[0]
    # Relative residuals count: else the longest bake decides alone.
    each, fixed = np.linalg.lstsq(np.stack([spp / cpu, 1 / cpu], 1), np.ones(len(points)), rcond=None)[0]
    return k, max(fixed, 0.0), each


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--size", type=int, required=True)
    parser.add_argument("-o", "--out", type=pathlib.Path, required=True)
    parser.add_argument("--reference", type=pathlib.Path)
    parser.add_argument("--reference-scale", type=float, default=1.0)
    parser.add_argument("--reference-error", type=float, default=0.0)
    parser.add_argument("--targets", default="10,5,2,1")
    parser.add_argument("--spp", default="16,64,256")
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    bench = Bench(arguments)
    if bench.reference is None:
        bench.make_reference()
    targets = [float(t) / 100 for t in arguments.targets.split(",")]
    spps = [int(s) for s in arguments.spp.split(",")]
    ours, theirs = {t: [] for t in targets}, {s: [] for s in spps}
    for _ in range(arguments.repeat):
        for target in targets:
            ours[target].append(bench.by_radbake(target))
        for spp in spps:
            theirs[spp].append(bench.by_cycles(spp))
    ours, theirs = ([cheapest(runs) for runs in side.values()] for side in (ours, theirs))

    print(f"{bench.scene.name}, {bench.size} x {bench.size}, load {os.getloadavg()[0]:.1f}, reference off by "
          f"{100 * bench.own_error:.2f} %\n")
    print("| Cycles spp | error | CPU s of the bake | CPU s of Blender |\n|---|---|---|---|")
    for p in theirs:
        print(f"| {p['spp']} | {100 * p['error']:.2f} % | {p['cpu']:.2f} | {p['whole']:.2f} |")
    k, fixed, each = laws(theirs)
    print(f"\nCycles: error {k:.3f} / sqrt(spp), CPU {fixed:.2f} s + {each:.4f} s x spp\n")
    print("| asked | passes | stated | true error | worker CPU s | all CPU s | Cycles CPU s to what was asked | ratio | "
          "to the true error | ratio |\n|---|---|---|---|---|---|---|---|---|---|")
    for r in ours:
        cells = []
        for error, key in (r["target"], "to_target"), (r["error"], "to_true_error"):
            spp = (k / error) ** 2 if error > 0 else math.inf
            r[key] = {"cycles_cpu": fixed + each * spp, "ratio": (fixed + each * spp) / r["cpu"]}
            cells += [f"{'~' if spp > max(spps) else ''}{r[key]['cycles_cpu']:.1f}", f"{r[key]['ratio']:.0f}"]
        print(f"| {100 * r['target']:g} % | {r['passes']} | {100 * r['stated']:.2f} % | {100 * r['error']:.2f} % | "
              f"{r['cpu']:.2f} | {r['whole']:.2f} | " + " | ".join(cells) + " |")
    (bench.out / "bench.json").write_text(json.dumps({"radbake": ours, "cycles": theirs}, indent=2) + "\n")


if __name__ == "__main__":
    sys.exit(main())

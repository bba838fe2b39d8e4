"""Bakes a scene to several targets with many seeds: whether targets are reached, and stated errors and intervals hold.

  bench_targets.py SCENE --bin build/release/bin [--seeds 20] [--targets 10,5,2,1] [--reference FILE --scale S
                   --reference-error E] [-- OPTION ...]

Without --reference, the mean of two bakes to half of the smallest target, by seeds of their own, is the truth; half of
their difference is its own error, and all valid texels count. Another baker's reference averages all of a texel's footprint
where ours averages what is visible: there texels at borders are left out, and the interval, which speaks of all of them,
need not hold. OPTIONs go on to `radbake submit` (a sky, an atlas size).
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
import compare  # noqa: E402


def bake(binaries, scene, folder, options):
    subprocess.run([binaries / "radbake", "submit", scene, "-o", folder, "--force", *options], check=True,
                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    report = json.loads((folder / "report.json").read_text())
    maps = sorted(folder.glob("lightmap_[0-9]*.exr"))
    light = np.concatenate([compare.load(str(p)) for p in maps if p.stem.count("_") == 1])
    error = np.concatenate([compare.load(str(p)) for p in sorted(folder.glob("error_[0-9]*.exr"))])
    return light, error, report


def is_measured(error):
    """Filled texels have no coverage in the layer of errors."""
    return error[..., 3] > 0


def main():
    if "--" in sys.argv:
        at = sys.argv.index("--")
        own, options = sys.argv[1:at], sys.argv[at + 1:]
    else:
        own, options = sys.argv[1:], []
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--targets", default="10,5,2,1")
    parser.add_argument("--reference", type=pathlib.Path)
    parser.add_argument("--scale", type=float, default=1.0, help="what the reference is multiplied by to be lx")
    parser.add_argument("--reference-error", type=float, default=0.0, help="its own relative RMSE")
    arguments = parser.parse_args(own)
    targets = [float(text) / 100 for text in arguments.targets.split(",")]

    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        if arguments.reference:
            truth = compare.load(str(arguments.reference))
            truth[..., :3] *= arguments.scale
            mask = compare.mask(truth)
            own_error = arguments.reference_error
        else:
            fine = f"{min(targets) / 2}"
            one, of_one, _ = bake(arguments.bin, arguments.scene, folder,
                                  [*options, "--max-error", fine, "--seed", "100001"])
            two, of_two, _ = bake(arguments.bin, arguments.scene, folder,
                                  [*options, "--max-error", fine, "--seed", "100002"])
            truth = (one + two) / 2
            mask = is_measured(of_one) & is_measured(of_two)
            own_error = compare.metrics(one, two, mask)["rrmse"] / 2
        print(f"{arguments.scene.name}: {int(mask.sum())} texels, the reference's own error {100 * own_error:.2f} %")
        print("asked   within  true mean  worst   stated/true  in interval  inside 1.96  CPU s   first pass is better")
        for target in targets:
            true, stated, inside, seconds, covered, single = [], [], [], [], 0, 0
            for seed in range(1, arguments.seeds + 1):
                light, error, report = bake(arguments.bin, arguments.scene, folder,
                                            [*options, "--max-error", str(target), "--seed", str(seed)])
                valid = mask & is_measured(error)
                measured = compare.metrics(light, truth, valid)["rrmse"]
                true.append(math.sqrt(max(measured ** 2 - own_error ** 2, 0)))
                stated.append(report["error"]["relative_rmse"])
                low, high = report["error"]["interval95"]
                covered += low <= true[-1] <= high
                single += len(report["passes"]) == 1
                level = own_error * truth[valid][:, :3].mean()
                off = np.abs(light[valid][:, :3] - truth[valid][:, :3])
                inside.append((off <= 1.96 * np.hypot(error[valid][:, :3], level)).mean())
                seconds.append(report["run"]["cpu_seconds"])
            rms = math.sqrt(np.mean(np.square(true)))
            print(f"{100 * target:4.1f} %  {sum(t <= target for t in true):2d}/{len(true)}   {100 * np.mean(true):5.2f} %   "
                  f"{100 * max(true):5.2f} %   {math.sqrt(np.mean(np.square(stated))) / rms:6.2f}       "
                  f"{covered:2d}/{len(true)}        {np.mean(inside):.3f}       {np.mean(seconds):5.2f}   "
                  f"{single}/{len(true)}", flush=True)


if __name__ == "__main__":
    main()

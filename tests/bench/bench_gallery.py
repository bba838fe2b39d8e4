"""Measures the classic rooms of make_gallery.py and writes their page: plan, picture, what effects cost, error over time.

  bench_gallery.py --bin build/release/bin -o DIR [--rooms goral,simple,...] [--target 5] [--rays 32] [--seeds 8]
                   [--cycles] [--page FILE.md]

Of each room: `radbake plan`; a bake to --target, whose true error is measured against the mean of two bakes to half of it
(seeds of their own; half of their difference is the reference's own error); the room as `radbake-study view` shows
the first of those two; and each effect forced the other way, in bakes of --rays at half the density (the museum: more rays): CPU seconds (medians of pairs) and
what it changed. What a plan leaves out must not change a bit. What it simulates must matter: the largest difference of a
texel's means in standard errors, and the share of texels beyond five, beside what as many other seeds differ by.
--cycles: CPU seconds of Cycles to the same error, for the rooms that it can bake (bench_cycles.py).

DIR/ROOM.json holds what was measured: rooms that are there are not measured again. --page writes the page of all rooms in
DIR, with a plot and pictures beside it. Needs python3-numpy, python3-openimageio; for --cycles Debian's blender.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys

import numpy as np

HERE = pathlib.Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "golden"), str(HERE)]
import compare  # noqa: E402
import bench_cycles  # noqa: E402
import bench_targets  # noqa: E402

MAKE = HERE.parent / "scenes" / "make_gallery.py"
SKY = "sky.hdr"

# Options of a bake, the camera of the view, and whether Cycles can bake the like.
ROOMS = {
    "goral": ("Goral's room", ["--texels-per-meter", "32", "--atlas-size", "512"], ["1.5,1.5,5.1,1.5,1.5,0,70"], True),
    "simple": ("The simple room", ["--texels-per-meter", "32", "--atlas-size", "512"], ["3.85,1.75,4.4,1.9,0.95,1.3,78"], True),
    "computer": ("The computer room", ["--texels-per-meter", "24", "--atlas-size", "1024"], ["0.4,2,7.3,5,0.8,2.2,70"], True),
    "vermeer": ("The Vermeer room", ["--texels-per-meter", "32", "--sky", "4000,5000,7000",
                                     "--sun=1,-0.62,-0.42:60000,55000,46000"],
                ["4.75,1.6,5.85,1.4,1.15,1.3,75", "--background", "4000,5000,7000"], False),
    "museum": ("The museum", ["--texels-per-meter", "16", "--hdri", f"{SKY}:1000"],
               ["3.2,2,11,8,1.8,1,75", "--background", "2600,3600,6000"], False),
    "engine": ("The engine room", ["--texels-per-meter", "16"], ["11.6,2.5,7.6,4.2,2.2,2.6,75"], False),
}
# Outputs, and what no bake simulates.
NOT_LIGHT = {"vertices", "layers", "ambient_occlusion"}
TIMED_PAIRS = 2
# Texels a metre and rays of the bakes by effect, where half the density and --rays tell too little.
BY_EFFECT = {"museum": (4, 256)}


def box_sum(values):
    """Over 3 x 3 texels. [h, w, ...]"""
    padded = np.pad(values, [(1, 1), (1, 1)] + [(0, 0)] * (values.ndim - 2))
    h, w = values.shape[:2]
    return sum(padded[j:j + h, i:i + w] for j in range(3) for i in range(3))


def differences(one, two):
    """Of two sets of maps by seeds, [seeds, h, w, 4]: how far their means are apart in standard errors, the largest and
    the share of texels beyond five; variances over seeds, pooled over a texel and its covered neighbours."""
    covered = (one[..., 3] > 0).all(0) & (two[..., 3] > 0).all(0)
    variance = (one.var(0, ddof=1) + two.var(0, ddof=1))[..., :3] * covered[..., None]
    pooled = box_sum(variance) / np.maximum(box_sum(covered.astype(float)), 1)[..., None]
    means = one.mean(0)[..., :3], two.mean(0)[..., :3]
    rounding = np.finfo(np.float32).eps * np.maximum(*means)
    apart = np.abs(means[0] - means[1]) / np.maximum(np.sqrt(pooled / len(one) + rounding ** 2), 1e-30)
    apart = apart.max(-1)[covered]
    return {"largest": float(apart.max()), "share": float((apart > 5).mean())}


def passes_of(report):
    return [{"error": p["relative_rmse"], "cpu": t["cpu_seconds"], "patches": p["num_patches"]}
            for p, t in zip(report["passes"], report["run"]["passes"])]


class Room:
    def __init__(self, name, arguments):
        self.name, self.bin = name, arguments.bin.resolve()
        self.title, self.options, _, self.is_for_cycles = ROOMS[name]
        self.density, self.rays = BY_EFFECT.get(name, (int(self.options[1]) // 2, arguments.rays))
        self.coarse = ["--texels-per-meter", str(self.density), "--rays", str(self.rays)]
        self.folder = arguments.out / name
        self.folder.mkdir(parents=True, exist_ok=True)
        self.scene = self.folder / "room.glb"
        made = self.run(sys.executable, "-B", MAKE, name, self.scene)
        self.num_triangles = int(made.split(":")[-1].split()[0])
        if any(SKY in option for option in self.options):
            self.run(sys.executable, "-B", MAKE, "sky", self.folder / SKY)
            self.options = [o.replace(SKY, str(self.folder / SKY)) for o in self.options]

    def run(self, *command):
        result = subprocess.run(list(map(str, command)), stdin=subprocess.DEVNULL, capture_output=True, text=True)
        if result.returncode != 0:
            raise SystemExit(f"{' '.join(map(str, command))}: exit {result.returncode}\n{result.stderr[-2000:]}")
        return result.stdout

    def bake(self, folder, *options):
        return bench_targets.bake(self.bin, self.scene, self.folder / folder, self.merged(options))

    def merged(self, options):
        """A density among them takes the place of the room's own."""
        return [*(self.options[2:] if "--texels-per-meter" in options else self.options), *options]

    def plan(self):
        return json.loads(self.run(self.bin / "radbake", "plan", self.scene, *self.options, "--json"))

    def to_target(self, target):
        fine = [self.bake(f"reference_{seed}", "--max-error", f"{target / 2}%", "--seed", seed)
                for seed in ("100001", "100002")]
        truth = (fine[0][0] + fine[1][0]) / 2
        mask = bench_targets.is_measured(fine[0][1]) & bench_targets.is_measured(fine[1][1])
        own = compare.metrics(fine[0][0], fine[1][0], mask)["rrmse"] / 2
        self.reference_error = own
        light, error, report = self.bake("baked", "--max-error", f"{target}%")
        measured = compare.metrics(light, truth, mask & bench_targets.is_measured(error))["rrmse"]
        run = report["run"]
        return {"stated": report["error"]["relative_rmse"], "interval": report["error"]["interval95"],
                "true": max(measured ** 2 - own ** 2, 0) ** 0.5, "reference": own, "cpu": run["cpu_seconds"],
                "wall": run["wall_seconds"], "memory": run["peak_memory_bytes"], "texels": report["error"]["texels"],
                "sheets": report["lightmap"]["num_lightmaps"],
                "passes": passes_of(report), "fine_passes": passes_of(fine[0][2])}

    def by_seeds(self, seeds, *options):
        """-> [seeds, h, w, 4] light, CPU seconds. Errors: CalledProcessError where the plan refuses."""
        maps, seconds = [], []
        for seed in seeds:
            light, _, report = self.bake("effect", *self.coarse, "--seed", str(seed), *options)
            maps.append(light)
            seconds.append(report["run"]["cpu_seconds"])
        return np.array(maps), seconds

    def by_effect(self, plan, num_seeds):
        seeds, others = range(1, num_seeds + 1), range(num_seeds + 1, 2 * num_seeds + 1)
        planned, _ = self.by_seeds(seeds)
        out = {"noise": differences(planned, self.by_seeds(others)[0]), "seeds": num_seeds, "effects": []}
        for effect in plan["effects"]:
            name, state = effect["effect"], effect["state"]
            if state not in ("on", "off") or name in NOT_LIGHT:
                continue
            force = ["--effect", f"{name}={'off' if state == 'on' else 'on'}"]
            maps, cpu, forced_cpu = [], [], []
            try:
                for seed in seeds:
                    light, forced_seconds = self.by_seeds([seed], *force)
                    maps.append(light[0])
                    if seed > TIMED_PAIRS:
                        continue
                    # By turns: the machine is not always as quick.
                    cpu += self.by_seeds([seed])[1]
                    forced_cpu += forced_seconds
            except subprocess.CalledProcessError:
                out["effects"].append({"effect": name, "state": state, "refused": True})
                continue
            forced = np.array(maps)
            out["effects"].append({"effect": name, "state": state, "bits": int((planned != forced).sum()),
                                   **(differences(planned, forced) if state == "on" else {}),
                                   "planned": statistics.median(cpu), "forced": statistics.median(forced_cpu)})
        return out

    def by_cycles(self, target):
        """Of the laid out room, on its one sheet: what Cycles takes to the same error."""
        maps = [compare.load(str(self.folder / f"reference_{seed}" / "lightmap_0.exr")) for seed in (100001, 100002)]
        reference = self.folder / "reference_100001" / "mean.exr"  # beside the errors that say which texels count
        bench_cycles.write(reference, (maps[0] + maps[1]) / 2)
        self.run(sys.executable, HERE / "bench_cycles.py", self.folder / "baked" / "scene.glb", "--bin", self.bin, "--size",
                 maps[0].shape[1], "-o", self.folder / "cycles", "--targets", target, "--spp", "16,64", "--repeat", 1,
                 "--reference", reference, "--reference-error", self.reference_error)
        return json.loads((self.folder / "cycles" / "bench.json").read_text())


def measure(name, arguments):
    room = Room(name, arguments)
    plan = room.plan()
    target = room.to_target(arguments.target)
    measured = {"title": room.title, "triangles": room.num_triangles, "options": ROOMS[name][1],
                "asked": arguments.target / 100,
                "plan": [{k: e[k] for k in ("effect", "state", "reason")} for e in plan["effects"]],
                "patches": plan["num_patches"], "target": target, "rays": room.rays, "density": room.density,
                "by_effect": room.by_effect(plan, arguments.seeds)}
    if arguments.cycles and room.is_for_cycles:
        measured["cycles"] = room.by_cycles(arguments.target)
    return measured


def percent(share):
    return f"{100 * share:.2g} %" if share < 0.1 else f"{100 * share:.0f} %"


def effects_table(measured):
    by_name = {e["effect"]: e for e in measured["by_effect"]["effects"]}
    lines = ["| effect | plan | why | the other way: CPU s | what it changes |", "|---|---|---|---|---|"]
    for effect in measured["plan"]:
        if effect["state"] == "absent":
            continue
        seen = by_name.get(effect["effect"])
        cost = change = ""
        if seen and seen.get("refused"):
            change = "refused: nothing else shines"
        elif seen:
            cost = f"{seen['planned']:.2f} -> {seen['forced']:.2f}"
            change = f"{percent(seen['share'])} of the texels, at most by {seen['largest']:.0f}" if effect["state"] == "on" \
                else "no bit" if seen["bits"] == 0 else f"{seen['bits']} values"
        lines.append(f"| `{effect['effect']}` | {effect['state']} | {effect['reason']} | {cost} | {change} |")
    return lines


def plot(rooms, file):
    """Stated error over CPU seconds, pass by pass."""
    script = ["set terminal pngcairo size 900,480", f"set output '{file}'", "set logscale xy", "set grid",
              "set xlabel 'CPU seconds'", "set ylabel 'error, % of the mean'", "set key outside right",
              "plot " + ", ".join(f"'-' with linespoints title \"{m['title']}\"" for _, m in rooms)]
    for _, m in rooms:
        script += [f"{p['cpu']} {100 * p['error']}" for p in m["target"]["fine_passes"]] + ["e"]
    subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, check=True)


def page(folder, file, binaries):
    rooms = [(name, json.loads((folder / f"{name}.json").read_text())) for name in ROOMS if (folder / f"{name}.json").exists()]
    asked = percent(rooms[0][1]["asked"])
    lines = ["# The gallery", "",
             "The classic rooms of radiosity, made by `tests/scenes/make_gallery.py`, baked and shown by radbake alone, and",
             "measured by `tests/bench/bench_gallery.py` on two cores.", "",
             f"| room | triangles | texels | asked | stated | true | CPU s | wall s | memory | Cycles at {asked} |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    for name, m in rooms:
        t, cycles = m["target"], "cannot bake the like"
        if "cycles" in m:
            ours = m["cycles"]["radbake"][0]
            cycles = f"{ours['to_target']['cycles_cpu']:.0f} CPU s, {ours['to_target']['ratio']:.0f} x of {ours['cpu']:.2f}"
        lines.append(f"| [{m['title']}](#{m['title'].lower().replace(' ', '-').replace(chr(39), '')}) | {m['triangles']:,} | "
                     f"{t['texels']:,} | {asked} | {percent(t['stated'])} | {percent(t['true'])} (+- {percent(t['reference'])}) | "
                     f"{t['cpu']:.1f} | {t['wall']:.1f} | {t['memory'] / 2 ** 20:.0f} MiB | {cycles} |")
    lines += ["", "*stated*: what the bake says of itself. *true*: against the mean of two bakes to half of that error, with what that",
              "mean is off by itself. The pictures show bakes to half of it, through their lightmaps and nothing else.", ""]
    lines += ["![Error over CPU seconds](error.png)", "", "What the bakes say of themselves, after each pass.", ""]
    for name, m in rooms:
        t = m["target"]
        options = " ".join(m["options"])
        lines += [f"## {m['title']}", "", f"![{m['title']}]({name}.png)", "",
                  f"    tests/scenes/make_gallery.py {name} room.glb",
                  f"    radbake submit room.glb -o baked --max-error {percent(m['asked'] / 2).replace(' ', '')} {options}",
                  f"    radbake-study view baked -o {name}.png --camera {' '.join(ROOMS[name][2])}", "",
                  *effects_table(m), "",
                  f"Bakes of {m['rays']} rays a texel, {m['density']} texels a metre, {m['by_effect']['seeds']} seeds, CPU seconds as planned -> "
                  "the other way. Changes: texels whose mean", "moves by more than 5 standard errors; between as many other seeds "
                  f"{percent(m['by_effect']['noise']['share'])} do, at most by {m['by_effect']['noise']['largest']:.1f}.", "",
                  "| asked | patches, error and CPU seconds after each pass |", "|---|---|"]
        for target, passes in (m["asked"], t["passes"]), (m["asked"] / 2, t["fine_passes"]):
            lines.append(f"| {percent(target)} | " +
                         "; ".join(f"{p['patches']:,}: {percent(p['error'])} at {p['cpu']:.2f} s" for p in passes) + " |")
        lines.append("")
    file.parent.mkdir(parents=True, exist_ok=True)
    plot(rooms, file.parent / "error.png")
    file.write_text("\n".join(lines))
    for name, _ in rooms:
        subprocess.run([binaries / "radbake-study", "view", folder / name / "reference_100001", "-o",
                        file.parent / f"{name}.png", "--size", "900x600", "--camera", *ROOMS[name][2]], check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("-o", "--out", type=pathlib.Path, required=True)
    parser.add_argument("--rooms", default=",".join(ROOMS))
    parser.add_argument("--target", type=float, default=5, help="percent")
    parser.add_argument("--rays", type=int, default=32)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--cycles", action="store_true")
    parser.add_argument("--page", type=pathlib.Path)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in arguments.rooms.split(","):
        kept = arguments.out / f"{name}.json"
        if kept.exists():
            continue
        kept.write_text(json.dumps(measure(name, arguments), indent=1) + "\n")
        print(f"{name}: measured", flush=True)
    if arguments.page:
        page(arguments.out, arguments.page, arguments.bin)


if __name__ == "__main__":
    main()

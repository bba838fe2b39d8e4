"""The classic rooms of make_gallery.py: the same bytes each time, and each calls for a set of effects of its own; what a plan
leaves out changes no bit of a small room, what it simulates changes the map; a baked room can be seen.

  gallery_test.py BIN_FOLDER
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv[1])
SCENES = pathlib.Path(__file__).parent
SKY = ["--sky", "4000,5000,7000", "--sun=1,-0.62,-0.42:60000,55000,46000"]

# What the plan turns on, and what it finds to be there without effect.
BOUNCE = {"interreflection", "color"}
PLANS = {
    "goral": ([], BOUNCE | {"emitters"}, {"occlusion"}),
    "simple": ([], BOUNCE | {"emitters", "occlusion", "textured_reflectance"}, set()),
    "computer": ([], BOUNCE | {"emitters", "occlusion", "textured_emission"}, set()),
    "vermeer": (SKY, BOUNCE | {"sun", "sky", "occlusion", "textured_reflectance", "diffuse_transmission", "two_sided"}, set()),
    "museum": (["--hdri"], BOUNCE | {"hdri", "occlusion", "textured_reflectance"}, set()),
    "engine": ([], BOUNCE | {"point", "spot", "ies", "occlusion", "alpha_mask", "two_sided"}, {"textured_reflectance"}),
}
LARGE = {"museum", "engine"}
QUICK = ["--texels-per-meter", "4", "--rays", "16"]


def make(name, path):
    subprocess.run([sys.executable, "-B", SCENES / "make_gallery.py", name, path], check=True, stdout=subprocess.DEVNULL)
    return path


def run(*command):
    return subprocess.run([str(part) for part in command], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300)


class Gallery(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="radbake-gallery-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def scene(self, name):
        return make(name, self.folder / f"{name}.glb") if name in LARGE else SCENES / f"{name}.glb"

    def options(self, name):
        options = PLANS[name][0]
        return ["--hdri", f"{make('sky', self.folder / 'sky.hdr')}:1000"] if options == ["--hdri"] else options

    def bake(self, name, *options):
        out = self.folder / "out"
        result = run(BIN / "radbake-study", "bake", self.scene(name), "-o", out, *self.options(name), *QUICK, *options)
        return (out / "lightmap_0.exr").read_bytes() if result.returncode == 0 else result.stderr

    def test_small_rooms_are_what_the_script_writes(self):
        for name in sorted(set(PLANS) - LARGE):
            self.assertEqual(make(name, self.folder / "again.glb").read_bytes(), self.scene(name).read_bytes(), name)

    def test_each_calls_for_effects_of_its_own(self):
        seen = set()
        for name, (_, on, off) in PLANS.items():
            result = run(BIN / "radbake", "plan", self.scene(name), *self.options(name), "--texels-per-meter", 4, "--json")
            self.assertEqual(result.returncode, 0, f"{name}: {result.stderr}")
            plan = json.loads(result.stdout)
            states = {state: {e["effect"] for e in plan["effects"] if e["state"] == state} for state in ("on", "off")}
            self.assertEqual(states["on"], on, name)
            self.assertEqual(states["off"], off, name)
            if name in LARGE:
                self.assertGreater(plan["survey"]["num_triangles"], 100_000)
            seen.add(frozenset(on))
        self.assertEqual(len(seen), len(PLANS))

    def test_what_a_plan_leaves_out_changes_no_bit_and_what_it_simulates_does(self):
        for name in sorted(set(PLANS) - LARGE):
            planned = self.bake(name)
            self.assertIsInstance(planned, bytes, planned)
            for effect in PLANS[name][2]:
                self.assertEqual(self.bake(name, "--effect", f"{effect}=on"), planned, f"{name}: {effect}")
            for effect in PLANS[name][1]:
                self.assertNotEqual(self.bake(name, "--effect", f"{effect}=off"), planned, f"{name}: {effect}")

    def test_a_baked_room_is_seen(self):
        baked, picture = self.folder / "baked", self.folder / "view.png"
        result = run(BIN / "radbake", "submit", self.scene("goral"), "-o", baked, *QUICK)
        self.assertEqual(result.returncode, 0, result.stderr)
        result = run(BIN / "radbake-study", "view", baked, "-o", picture, "--size", "60x40", "--camera", "1.5,1.5,2.9,1.5,1.4,0,80")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue(picture.read_bytes().startswith(b"\x89PNG"))
        result = run(BIN / "radbake-study", "view", self.folder / "nothing", "-o", picture)
        self.assertEqual(result.returncode, 3, result.stderr)
        self.assertIn("lightmaps.json is missing", result.stderr)
        result = run(BIN / "radbake-study", "view", baked, "-o", picture, "--camera", "1,2")
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("camera '1,2'", result.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])

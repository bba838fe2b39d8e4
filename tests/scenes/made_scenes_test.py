"""The scenes of make_interior.py and make_effects.py are what they say they are: deterministic; laid out, closed and seen
from its fronts the one, with every effect that it names the other.

  made_scenes_test.py BIN_FOLDER
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv[1])
SCRIPTS = pathlib.Path(__file__).parent
# Charts take two thirds of the sheet, whatever is added to the scene; below a half the layout has gone wrong.
LEAST_FILL = 0.5
# Of rays from all surfaces, also from those that stand on another: what lies in the wall behind a pier sees the outside, and
# sites there are taken out only where they surely lie inside of something.
MAX_ESCAPED, MAX_ABSORBED_BY_BACKS = 0.002, 0.02


class MadeScenes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="radbake-scenes-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def make(self, name, *options, script="make_interior.py"):
        subprocess.run([sys.executable, "-B", SCRIPTS / script, self.folder / name, *options], check=True,
                       stdout=subprocess.DEVNULL)
        return self.folder / name

    def radbake(self, *arguments):
        result = subprocess.run([BIN / "radbake", *map(str, arguments)], stdin=subprocess.DEVNULL, capture_output=True,
                                text=True, timeout=300)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def test_equal_arguments_give_equal_bytes(self):
        self.assertEqual(self.make("a.glb", "--small").read_bytes(), self.make("b.glb", "--small").read_bytes())
        effects = [self.make(name, script="make_effects.py").read_bytes() for name in ("c.glb", "d.glb")]
        self.assertEqual(*effects)

    def test_the_large_one_has_its_size_and_keeps_its_layout(self):
        plan = json.loads(self.radbake("plan", self.make("interior.glb"), "--atlas-size", 1024, "--lightmap-uv", "keep",
                                       "--json"))
        self.assertGreater(plan["survey"]["num_triangles"], 100000)
        self.assertGreater(plan["num_texels"], 500000)
        self.assertGreater(plan["num_texels"], LEAST_FILL * 1024 ** 2)

    def test_the_small_one_bakes_in_its_layout_and_nothing_gets_out(self):
        out = self.folder / "out"
        self.radbake("submit", self.make("small.glb", "--small"), "-o", out, "--atlas-size", 256, "--lightmap-uv", "keep",
                     "--rays", 64)
        report = json.loads((out / "report.json").read_text())
        self.assertEqual(report["lightmap"]["num_meshes_kept"], report["plan"]["survey"]["num_meshes"])
        self.assertGreater(report["lightmap"]["num_texels"], LEAST_FILL * 256 ** 2)
        self.assertLess(report["transport"]["escape_share"], MAX_ESCAPED)
        self.assertLess(report["transport"]["absorbed_share"], MAX_ABSORBED_BY_BACKS)

    def test_the_room_of_effects_has_those_that_tell_methods_apart(self):
        plan = json.loads(self.radbake("plan", self.make("effects.glb", script="make_effects.py"), "--sky", "300,350,450",
                                       "--sun=-1,-0.8,0.25:20000,19000,17000", "--json"))
        on = {effect["effect"] for effect in plan["effects"] if effect["state"] == "on"}
        self.assertLessEqual({"emitters", "point", "sun", "sky", "occlusion", "interreflection", "color", "alpha_mask",
                              "tint", "two_sided"}, on)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])

"""Bakes the test scenes with the real programs and gives every scene.glb to the Khronos validator.

  validator_test.py BIN_FOLDER SCENES_FOLDER PACKAGES_FOLDER [unittest arguments]

Exit code 77: skipped, because the validator cannot be installed.
"""
import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

import npm_packages

BIN, SCENES, PACKAGES = (pathlib.Path(argument) for argument in sys.argv[1:4])
HERE = pathlib.Path(__file__).parent
VALIDATE = HERE / "validate.js"

EXIT_SKIPPED = 77
# The light of each scene, and an atlas that makes the bake quick: what is checked is the file, not the picture.
SCENE_OPTIONS = {
    "cornell.glb": ["--atlas-size", "64"],
    "tile-game-room6.glb": ["--sky", "1,1,1", "--atlas-size", "128"],
    "goral.glb": ["--texels-per-meter", "4"],
    "simple.glb": ["--texels-per-meter", "4"],
    "computer.glb": ["--texels-per-meter", "4"],
    "vermeer.glb": ["--sky", "1,1,1", "--texels-per-meter", "4"],
}
QUICK = ["--rays", "16", "--max-patches", "300"]
# A feature of glTF each: what it becomes is worth a look, its light is not.
FEATURES = sorted((HERE / "conformance").glob("*.gl*"))
FEATURE_OPTIONS = ["--sky", "1,1,1", "--atlas-size", "64"]
LIMIT_SECONDS = 240


def validate(*files):
    return subprocess.run(["node", VALIDATE, *files], cwd=PACKAGES, stdin=subprocess.DEVNULL, capture_output=True,
                          text=True, timeout=LIMIT_SECONDS)


def with_json(glb, change):
    """A .glb's bytes with its JSON changed."""
    length, = struct.unpack_from("<I", glb, 12)
    gltf = json.loads(glb[20:20 + length])
    change(gltf)
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    rest = glb[20 + length:]
    header = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    return header + struct.pack("<I4s", len(text), b"JSON") + text + rest


class KhronosValidator(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="radbake-gltf-")
        self.addCleanup(temporary.cleanup)
        self.place = pathlib.Path(temporary.name)

    def bake(self, scene, options):
        out = self.place / scene.name
        result = subprocess.run([BIN / "radbake", "submit", scene, "-o", out, *options, *QUICK], capture_output=True,
                                stdin=subprocess.DEVNULL, text=True, timeout=LIMIT_SECONDS)
        self.assertEqual(result.returncode, 0, result.stderr)
        return out / "scene.glb"

    def test_every_scene_that_we_ship_is_baked_here(self):
        self.assertEqual(sorted(path.name for path in SCENES.glob("*.gl*")), sorted(SCENE_OPTIONS))

    def test_baked_scenes_have_no_errors(self):
        result = validate(*[self.bake(SCENES / name, options) for name, options in SCENE_OPTIONS.items()])
        print(result.stdout)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertEqual(result.stdout.count(": 0 errors"), len(SCENE_OPTIONS))

    def test_no_feature_gets_an_error_by_being_baked(self):
        self.assertGreaterEqual(len(FEATURES), 30)
        valid = [scene for scene in FEATURES if validate(scene).returncode == 0]
        self.assertEqual([scene.name for scene in FEATURES if scene not in valid], [], "in error themselves")
        result = validate(*[self.bake(scene, FEATURE_OPTIONS) for scene in valid])
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_an_accessor_beyond_its_buffer_is_an_error(self):
        def ask_for_too_much(gltf):
            gltf["accessors"][0]["count"] = 4000
        broken = self.place / "broken.glb"
        broken.write_bytes(with_json((SCENES / "cornell.glb").read_bytes(), ask_for_too_much))
        result = validate(broken)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("ACCESSOR_TOO_LONG at /accessors/0", result.stdout)


if __name__ == "__main__":
    try:
        npm_packages.install(PACKAGES)
    except npm_packages.Unavailable as reason:
        print(f"SKIPPED: {reason}")
        sys.exit(EXIT_SKIPPED)
    unittest.main(argv=sys.argv[:1] + sys.argv[4:])

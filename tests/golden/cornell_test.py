"""Bakes the Cornell box with the real programs and default settings, and compares it with a converged reference.

  cornell_test.py BIN_FOLDER SCENES_FOLDER

The reference (cornell_ref.exr, irradiance / pi) joins 41,256 samples a texel of a plain path tracer with 6,144 of
Cycles: its own noise is 0.30 % and its mean agrees with Radiance's rtrace to 0.1 %.
"""
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

import compare

BIN = pathlib.Path(sys.argv[1])
SCENES = pathlib.Path(sys.argv[2])
REFERENCE = pathlib.Path(__file__).parent / "cornell_ref.exr"

# What the service promises of its default settings on this scene.
MAX_RELATIVE_RMSE = 0.04
MAX_BIAS = 0.005
# What it reaches: 1.13 % and -0.05 %. Twice the error, or four times the variance, is a defect and not noise.
REACHED_RELATIVE_RMSE = 0.0113


class Cornell(unittest.TestCase):
    def test_default_settings_match_the_reference(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "out"
            subprocess.run([BIN / "radbake", "submit", SCENES / "cornell.glb", "-o", out, "--atlas-size", "256"],
                           check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, timeout=900)
            reference = compare.load(str(REFERENCE))
            baked = compare.load(str(out / "lightmap_0.exr"))
            self.assertEqual(baked.shape, reference.shape)
            mask = compare.mask(reference)
            self.assertEqual((mask & (baked[..., 3] == 0)).sum(), 0, "texels inside charts without coverage")
            baked[..., :3] /= math.pi
            figures = compare.metrics(baked, reference, mask)
            print(figures)
            self.assertLessEqual(figures["rrmse"], MAX_RELATIVE_RMSE)
            self.assertLessEqual(abs(figures["bias"]), MAX_BIAS)
            self.assertLessEqual(figures["rrmse"], 2 * REACHED_RELATIVE_RMSE)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])

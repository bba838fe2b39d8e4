"""Holds `radbake compare` against compare.py on the same files, and against what it must refuse.

  compare_test.py BIN_FOLDER
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import OpenImageIO as oiio

import compare

BIN = pathlib.Path(sys.argv[1])
REFERENCE = pathlib.Path(__file__).parent / "cornell_ref.exr"
# Both sum in double, in another order: some 1e5 terms.
ROUNDING = 1e-9


def write(path, pixels):
    pixels = np.ascontiguousarray(pixels, np.float32)
    image = oiio.ImageBuf(oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], oiio.FLOAT))
    image.set_pixels(oiio.ROI(), pixels)
    assert image.write(str(path)), image.geterror()


class Compare(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="radbake-compare-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        # The Cornell box with 5 % of noise and 1 % too bright, in lx.
        self.reference = compare.load(str(REFERENCE))
        self.noise = 0.05 * self.reference[..., :3] * np.pi
        self.map = self.reference.copy()
        random = np.random.default_rng(7)
        self.map[..., :3] = 1.01 * np.pi * self.reference[..., :3] + self.noise * random.standard_normal(self.noise.shape)
        write(self.folder / "map.exr", self.map)
        self.map = compare.load(str(self.folder / "map.exr"))

    def run_compare(self, *arguments):
        return subprocess.run([BIN / "radbake", "compare", *map(str, arguments)], stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=120)

    def compared(self, *arguments):
        result = self.run_compare(REFERENCE, self.folder / "map.exr", "--scale", str(1 / np.pi), "--json", *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def assert_same(self, found, expected):
        for key, value in expected.items():
            self.assertAlmostEqual(found[key], value, delta=ROUNDING, msg=key)

    def assert_refused(self, code, text, *arguments):
        result = self.run_compare(*arguments)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertIn(text, result.stderr)

    def test_gives_the_numbers_of_compare_py(self):
        scaled = self.map.copy()
        scaled[..., :3] /= np.pi
        for options, with_edges in ([], False), (["--edges"], True):
            mask = compare.mask(self.reference, with_edges)
            found = self.compared(*options)
            self.assertEqual(found["texels"], mask.sum())
            self.assert_same(found, compare.metrics(scaled, self.reference, mask))
            luminance = np.array([0.2126, 0.7152, 0.0722])
            r = self.reference[..., :3] @ luminance
            relative = (scaled[..., :3] @ luminance - r) / r.clip(0.02 * r[mask].mean())
            self.assert_same(found["percentiles"],
                             {str(p): np.percentile(np.abs(relative[mask]), p) for p in (50, 90, 95, 99)})
            worst = found["worst"]
            self.assertAlmostEqual(worst["relative"], relative[worst["y"], worst["x"]], delta=ROUNDING)
            self.assertAlmostEqual(abs(worst["relative"]), np.abs(relative[mask]).max(), delta=ROUNDING)

    def test_prints_the_same_five_digits(self):
        figures = compare.metrics(np.dstack([self.map[..., :3] / np.pi, self.map[..., 3]]), self.reference,
                                  compare.mask(self.reference))
        text = self.run_compare(REFERENCE, self.folder / "map.exr", "--scale", str(1 / np.pi)).stdout
        for key, value in figures.items():
            self.assertIn(f"{key} {value:.5f}", text)

    def test_a_mask_leaves_out_where_it_is_0(self):
        mask = compare.mask(self.reference)
        half = np.zeros((*mask.shape, 3))
        half[:, :100] = 1
        expected = compare.metrics(np.dstack([self.map[..., :3] / np.pi, self.map[..., 3]]), self.reference,
                                   mask & (half[..., 0] > 0))
        for name in "mask.exr", "mask.png":
            write(self.folder / name, half)
            self.assert_same(self.compared("--mask", self.folder / name), expected)

    def test_errors_that_hold_come_out_as_such(self):
        # The map is as if drawn with these errors, but for its 1 %: 0.2 standard errors.
        write(self.folder / "error.exr", self.noise)
        found = self.compared("--error", self.folder / "error.exr")["standard_errors"]
        # Of 1e5 independent values: 4 standard deviations are 0.003 and 0.009.
        self.assertAlmostEqual(found["within_95"], 0.946, delta=0.003)
        self.assertAlmostEqual(found["standardised_rms"], np.sqrt(1 + 0.2 ** 2), delta=0.009)
        # Errors that are too small by half are found out.
        write(self.folder / "error.exr", self.noise / 2)
        found = self.compared("--error", self.folder / "error.exr")["standard_errors"]
        self.assertAlmostEqual(found["standardised_rms"], 2 * np.sqrt(1 + 0.2 ** 2), delta=0.018)
        # What is lacking may be the reference's: sqrt(0.5^2 + 0.75) = 1.
        write(self.folder / "of_reference.exr", np.sqrt(0.75) * self.noise / np.pi)
        found = self.compared("--error", self.folder / "error.exr", "--reference-error",
                              self.folder / "of_reference.exr")["standard_errors"]
        self.assertAlmostEqual(found["standardised_rms"], np.sqrt(1 + 0.2 ** 2), delta=0.009)

    def test_draws_the_differences(self):
        found = self.compared("-o", self.folder / "difference.png")
        picture = np.asarray(oiio.ImageBuf(str(self.folder / "difference.png")).get_pixels(oiio.UINT8))
        self.assertEqual(picture.shape[1:], (512, 3))
        self.assertEqual(found["picture"]["file"], str(self.folder / "difference.png"))
        worst = found["worst"]
        red, _, blue = map(int, picture[2 * worst["y"], 2 * worst["x"]])
        self.assertGreater((red - blue) * np.sign(worst["relative"]), 100)

    def test_says_what_cannot_be_compared(self):
        good = self.folder / "map.exr"
        small, broken, empty = (self.folder / name for name in ("small.exr", "broken.exr", "empty.exr"))
        write(small, self.map[:100, :90])
        broken.write_bytes(good.read_bytes()[:5000])
        write(empty, np.zeros((*self.map.shape[:2], 1)))
        self.assert_refused(3, "90 x 100 texels and the reference 256 x 256", REFERENCE, small)
        self.assert_refused(3, "broken.exr", REFERENCE, broken)
        self.assert_refused(3, "nowhere.exr", "/nowhere.exr", good)
        self.assert_refused(3, "neither .exr nor .hdr", REFERENCE, self.folder / "map.png")
        self.assert_refused(3, "no texel is left", REFERENCE, good, "--mask", empty)
        self.assert_refused(3, "small.exr", REFERENCE, good, "--mask", small)
        self.assert_refused(3, "small.exr", REFERENCE, good, "--error", small)
        self.assert_refused(5, "nowhere", REFERENCE, good, "-o", "/nowhere/difference.png")
        self.assert_refused(2, "--error", REFERENCE, good, "--reference-error", good)
        self.assert_refused(2, "'0'", REFERENCE, good, "--scale", "0")
        self.assert_refused(2, "MAP is required", REFERENCE)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])

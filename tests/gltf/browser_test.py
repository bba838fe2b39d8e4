"""Bakes scenes, has three.js draw scene.glb in headless Chromium, and compares with a drawing of our own.

  browser_test.py BIN_FOLDER SCENES_FOLDER PACKAGES_FOLDER PICTURES_FOLDER [unittest arguments]

The two share nothing but the bake: the browser reads scene.glb and the 8 bits of its PNG that a browser keeps, ours
(tests/golden/view.py) the float EXR. Both pictures stay in PICTURES_FOLDER to look at.

Exit code 77: skipped, because there is no browser or three.js cannot be installed.
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import OpenImageIO as oiio

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "golden"))
import browser  # noqa: E402
import npm_packages  # noqa: E402
import view  # noqa: E402

BIN, SCENES, PACKAGES, PICTURES = (pathlib.Path(argument).resolve() for argument in sys.argv[1:5])

EXIT_SKIPPED = 77
LIMIT_SECONDS = 240
SIZE = 256
# What is told apart: colour of a channel, 0 to 1 in sRGB, mean over pixels that both drawings cover wholly.
# A texel of the PNG is off by up to half a step of 1/255 of the map's brightest, and edges are smoothed otherwise:
# measured 0.0036 (Cornell box) and 0.0033 (room), correlations 0.999 and 0.997.
MAX_MEAN_DIFFERENCE = 0.006
MIN_CORRELATION = 0.99
# Pixels that one drawing covers and the other does not: outlines only.
MAX_UNCOVERED_SHARE = 0.005


class Scene:
    """One scene's bake and camera. `exposure`: a pixel is exposure * luminance, chosen once by eye."""

    def __init__(self, name, options, exposure, fov, **camera):
        self.name, self.options, self.exposure, self.fov, self.camera = name, options, exposure, fov, camera

    def bake(self, out):
        subprocess.run([BIN / "radbake", "submit", SCENES / self.name, "-o", out, *self.options], check=True,
                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, timeout=LIMIT_SECONDS)

    def draw_in_browser(self, out):
        camera = {key: ",".join(map(str, value)) for key, value in self.camera.items()}
        png = browser.draw(out / "scene.glb", PACKAGES, **camera, fov=self.fov, size=SIZE, exposure=self.exposure)
        file = PICTURES / (pathlib.Path(self.name).stem + "_browser.png")
        file.write_bytes(png)
        # Stored as drawn: opacity is coverage, and colour is not to be divided by it.
        pixels = np.asarray(oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT), np.float64)
        return pixels[..., :3], pixels[..., 3]

    def draw_ourselves(self, out, lightmaps):
        camera = {key: np.array(value, float) for key, value in self.camera.items()}
        picture, coverage = view.render(view.Glb(out / "scene.glb"), lightmaps, **camera, fov=self.fov, size=SIZE,
                                        exposure=self.exposure)
        view.write_picture(PICTURES / (pathlib.Path(self.name).stem + "_ours.png"), picture)
        return picture, coverage


CORNELL = Scene("cornell.glb", ["--atlas-size", "256", "--rays", "64"], exposure=0.45, fov=32, eye=(0, 1, 4.6),
                target=(0, 1, 0), up=(0, 1, 0))
# Inside, beside the opening that the light comes in by.
ROOM = Scene("tile-game-room6.glb", ["--sky", "1,1,1", "--atlas-size", "256", "--rays", "64"], exposure=0.9, fov=75,
             eye=(-1.9, -3.3, 2.6), target=(1.2, 2, 0.4), up=(0, 0, 1))


class FlippedLightmaps(view.Lightmaps):
    def of(self, glb, extension):
        return super().of(glb, extension)[::-1]


def differences(a, b, both):
    return float(np.abs(a - b)[both].mean()), float(np.corrcoef(a[both].ravel(), b[both].ravel())[0, 1])


class Browser(unittest.TestCase):
    def check(self, scene):
        with tempfile.TemporaryDirectory(prefix="radbake-browser-") as folder:
            out = pathlib.Path(folder) / "out"
            scene.bake(out)
            theirs, their_coverage = scene.draw_in_browser(out)
            ours, our_coverage = scene.draw_ourselves(out, view.Lightmaps(out))
            flipped, _ = scene.draw_ourselves(out, FlippedLightmaps(out))
            scene.draw_ourselves(out, view.Lightmaps(out))
        both = (their_coverage == 1) & (our_coverage == 1)
        difference, correlation = differences(theirs, ours, both)
        print(f"{scene.name}: mean difference {difference:.4f}, correlation {correlation:.4f}, mean {theirs[both].mean():.3f}")
        one = ((their_coverage == 1) & (our_coverage == 0)) | ((their_coverage == 0) & (our_coverage == 1))
        self.assertLessEqual(one.mean(), MAX_UNCOVERED_SHARE)
        self.assertGreater(both.mean(), 0.2, "the camera looks past the scene")
        self.assertLessEqual(difference, MAX_MEAN_DIFFERENCE)
        self.assertGreaterEqual(correlation, MIN_CORRELATION)
        # The same light in the wrong places would be seen.
        self.assertGreater(differences(theirs, flipped, both)[0], 3 * MAX_MEAN_DIFFERENCE)

    def test_cornell_box_is_lit_where_it_was_baked(self):
        self.check(CORNELL)

    def test_game_room_under_a_sky_is_lit_where_it_was_baked(self):
        self.check(ROOM)


if __name__ == "__main__":
    try:
        if not browser.find_chromium():
            raise npm_packages.Unavailable("there is no chromium: deploy/install-packages test")
        npm_packages.install(PACKAGES)
    except npm_packages.Unavailable as reason:
        print(f"SKIPPED: {reason}")
        sys.exit(EXIT_SKIPPED)
    PICTURES.mkdir(parents=True, exist_ok=True)
    unittest.main(argv=sys.argv[:1] + sys.argv[5:])

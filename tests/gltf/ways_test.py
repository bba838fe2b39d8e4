"""Bakes one scene that is written in many ways (tests/gltf/ways) by the real radbake.

  ways_test.py BIN_FOLDER

Ways that lose nothing must give the same bytes; ways that move vertices, the same light within what that moves.
"""
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "golden"))
import compare  # noqa: E402

BIN = pathlib.Path(sys.argv[1])
WAYS = pathlib.Path(__file__).resolve().parent / "ways"

RAYS = 256
SETTINGS = ["--atlas-size", "64", "--rays", str(RAYS), "--max-patches", "500"]
# How far a vertex moves at most, in texels: in space, where the coarsest texel is 1/8 m, and in the atlas of 64.
# 16 bits over 4 m and over the atlas: half a step along each axis.
QUANTISED_MOVE = 8 * math.sqrt(3) * 2 / 65535 + 64 * math.sqrt(2) * 0.5 / 65535
# 14 bits: the same with steps four times as long.
DRACO_MOVE = 8 * math.sqrt(3) * 2 / 16383 + 64 * math.sqrt(2) * 0.5 / 16383
# Nothing is nearer to a texel than its neighbours, so on the mean its light changes by less than itself a texel moved.
CHANGE_PER_TEXEL = 1
# One texel may lose or win rays that graze an edge, each a share 1/RAYS of its light: four of them, twice as bright.
GRAZING = 8 / RAYS
LIMIT_SECONDS = 240


class Ways(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="radbake-ways-")
        cls.addClassCleanup(folder.cleanup)
        cls.place = pathlib.Path(folder.name)

    def bake(self, way):
        out = self.place / way
        if not out.exists():
            result = subprocess.run([BIN / "radbake", "submit", WAYS / f"{way}.gltf", "-o", out, *SETTINGS],
                                    stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LIMIT_SECONDS)
            self.assertEqual(result.returncode, 0, result.stderr)
        return out / "lightmap_0.exr"

    def test_lossless_ways_give_the_same_bytes(self):
        expected = self.bake("indexed").read_bytes()
        for way in ("strip", "non_indexed", "sparse", "external", "nested"):
            with self.subTest(way=way):
                self.assertEqual(self.bake(way).read_bytes(), expected)

    def test_ways_that_move_vertices_change_the_light_by_no_more_than_that(self):
        expected = compare.load(str(self.bake("indexed")))
        for way, move in (("quantised", QUANTISED_MOVE), ("draco", DRACO_MOVE)):
            with self.subTest(way=way):
                baked = compare.load(str(self.bake(way)))
                lit = expected[..., 3] > 0
                self.assertTrue(((baked[..., 3] > 0) == lit).all())
                change = abs(baked - expected)[lit][:, :3].max(-1) / expected[lit][:, :3].max(-1)
                print(f"{way}: mean {change.mean():.2g} of {move * CHANGE_PER_TEXEL:.2g}, "
                      f"largest {change.max():.2g} of {GRAZING:.2g}")
                self.assertGreater(change.max(), 0)
                self.assertLessEqual(change.mean(), move * CHANGE_PER_TEXEL)
                self.assertLessEqual(change.max(), move * CHANGE_PER_TEXEL + GRAZING)

    def test_the_scene_is_lit_everywhere(self):
        """Or equal bytes would say little."""
        baked = compare.load(str(self.bake("indexed")))
        lit = baked[..., 3] > 0
        self.assertGreater(lit.sum(), 64 * 64 // 3)
        self.assertGreater(baked[lit][:, :3].min(), 0)
        self.assertGreater(baked[lit][:, 1].max(), 4 * baked[lit][:, 1].min())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:], verbosity=2)

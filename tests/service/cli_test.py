"""Runs the real radbake, with private servers and with a shared radbaked, as a user and as a script would.

  cli_test.py BIN_FOLDER SCENES_FOLDER [unittest arguments]
"""
import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import unittest

import cli_scenes

BIN = pathlib.Path(sys.argv[1])
SCENES = pathlib.Path(sys.argv[2])
CORNELL = SCENES / "cornell.glb"

QUICK = ["--atlas-size", "64", "--rays", "16", "--max-patches", "300"]
# Minutes of work on any machine: for what is cancelled long before its end.
LONG = ["--atlas-size", "2048", "--rays", "65536"]
# For what must not hang; no test depends on how long anything takes.
LIMIT_SECONDS = 240


class CliTest(unittest.TestCase):
    def setUp(self):
        self.place = pathlib.Path(tempfile.mkdtemp(prefix="radbake-cli-"))
        self.addCleanup(shutil.rmtree, self.place, ignore_errors=True)
        self.tmp = self.place / "tmp"
        self.tmp.mkdir()
        self.env = {**os.environ, "TMPDIR": str(self.tmp)}
        self.env.pop("RADBAKE_SERVER", None)

    def run_cli(self, *arguments, **environment):
        return subprocess.run([BIN / "radbake", *map(str, arguments)], env={**self.env, **environment},
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LIMIT_SECONDS)

    def start_cli(self, *arguments):
        process = subprocess.Popen([BIN / "radbake", *map(str, arguments)], env=self.env, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def assert_exit(self, result, code):
        self.assertEqual(result.returncode, code, f"stdout: {result.stdout}\nstderr: {result.stderr}")

    def assert_nothing_left(self, *names):
        """No private server's folder, and in the test's own folder these names only."""
        self.assertEqual(sorted(os.listdir(self.tmp)), [])
        self.assertEqual(sorted(os.listdir(self.place)), sorted(["tmp", *names]))


class PrivateServer(CliTest):
    def test_submit_writes_lightmap_preview_and_report(self):
        result = self.run_cli("submit", CORNELL, "-o", self.place / "out", *QUICK)
        self.assert_exit(result, 0)
        lines = result.stdout.splitlines()
        self.assertRegex(lines[0], r"^bakes/\w+$")
        names = ["lightmap_0.exr", "lightmap_0.png", "scene.glb", "lightmaps.json", "report.json"]
        self.assertEqual(lines[1:], [str(self.place / "out" / name) for name in names])
        self.assertEqual(sorted(os.listdir(self.place / "out")), sorted(names))
        report = json.loads((self.place / "out" / "report.json").read_text())
        self.assertEqual(report["scene"]["name"], "cornell.glb")
        self.assertEqual(report["lightmap"]["atlas_size"], 64)
        self.assertEqual(report["plan"]["survey"]["num_triangles"], 46)
        self.assertEqual(report["solver"]["status"], "converged")
        self.assertEqual(report["run"]["job"], lines[0])
        self.assertEqual([s["stage"] for s in report["run"]["client"]["stages"]],
                         ["connect", "read", "encode", "upload", "bake", "download", "write"])
        self.assert_nothing_left("out")

    def test_json_submit_is_one_event_a_line_with_the_job_first(self):
        result = self.run_cli("submit", CORNELL, "-o", self.place / "out", "--json", *QUICK)
        self.assert_exit(result, 0)
        events = [json.loads(line) for line in result.stdout.splitlines()]
        kinds = [event["event"] for event in events]
        self.assertEqual(kinds[0], "submitted")
        self.assertEqual(kinds[-2:], ["finished", "written"])
        self.assertEqual(events[-2]["bake"]["state"], "SUCCEEDED")
        states = [event["change"]["state"] for event in events if event["event"] == "state"]
        self.assertEqual(states[-1], "SUCCEEDED")
        sequences = [event["change"]["sequence"] for event in events if event["event"] == "state"]
        self.assertEqual(sequences, list(range(1, len(sequences) + 1)))
        fractions = [event["progress"]["fraction"] for event in events if event["event"] == "progress"]
        self.assertEqual(fractions, sorted(fractions))

    def test_equal_bakes_give_equal_bytes_for_any_number_of_threads(self):
        reports, images = [], []
        for name, threads in (("a", 1), ("b", 2), ("c", 2)):
            self.assert_exit(self.run_cli("submit", CORNELL, "-o", self.place / name, "--threads", threads, *QUICK), 0)
            images.append([(self.place / name / file).read_bytes()
                           for file in ("lightmap_0.exr", "lightmap_0.png", "scene.glb", "lightmaps.json")])
            report = json.loads((self.place / name / "report.json").read_text())
            self.assertEqual(list(report)[-1], "run")
            del report["run"]
            reports.append(json.dumps(report))
        self.assertEqual(images[0], images[1])
        self.assertEqual(images[1], images[2])
        self.assertEqual(reports[0], reports[1])
        self.assertEqual(reports[1], reports[2])

    def test_a_sky_lights_a_dark_scene(self):
        scene = self.place / "dark.gltf"
        scene.write_text(json.dumps(cli_scenes.square(emissive=(0, 0, 0))))
        result = self.run_cli("submit", scene, "-o", self.place / "out", "--sky", "100,100,100", *QUICK)
        self.assert_exit(result, 0)
        # The floor of an open field under a sky of 100 nit gets pi * 100 lx, whatever the rays: no variance.
        report = json.loads((self.place / "out" / "report.json").read_text())
        self.assertAlmostEqual(report["energy"]["mean_irradiance"], 314.159, delta=0.4)

    def test_ctrl_c_cancels_and_cleans_up(self):
        process = self.start_cli("submit", CORNELL, "-o", self.place / "out", *LONG)
        self.assertRegex(process.stdout.readline(), r"^bakes/")
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=LIMIT_SECONDS)
        self.assertEqual(process.returncode, 6)
        self.assert_nothing_left()

    def test_folder_that_is_not_empty_is_a_usage_error_unless_forced(self):
        (self.place / "out").mkdir()
        (self.place / "out" / "mine.txt").write_text("mine")
        refused = self.run_cli("submit", CORNELL, "-o", self.place / "out", *QUICK)
        self.assert_exit(refused, 2)
        self.assertIn("--force", refused.stderr)
        self.assertEqual(os.listdir(self.place / "out"), ["mine.txt"])
        self.assert_exit(self.run_cli("submit", CORNELL, "-o", self.place / "out", "--force", *QUICK), 0)
        self.assertEqual(sorted(os.listdir(self.place / "out")),
                         ["lightmap_0.exr", "lightmap_0.png", "lightmaps.json", "mine.txt", "report.json", "scene.glb"])

    def test_a_missing_server_program_is_named(self):
        alone = self.place / "alone"
        alone.mkdir()
        shutil.copy2(BIN / "radbake", alone)
        result = subprocess.run([alone / "radbake", "capabilities"], env=self.env, capture_output=True, text=True,
                                timeout=LIMIT_SECONDS)
        self.assert_exit(result, 4)
        self.assertIn("no radbaked beside", result.stderr)

    def test_without_the_image_library_only_images_fail_and_it_is_named(self):
        alone = self.place / "alone"
        alone.mkdir()
        for program in ("radbake", "radbaked", "radbake-worker"):
            shutil.copy2(BIN / program, alone)
        run = lambda *arguments: subprocess.run([alone / "radbake", *map(str, arguments)], env=self.env,
                                                capture_output=True, text=True, timeout=LIMIT_SECONDS)
        self.assert_exit(run("capabilities"), 0)
        result = run("submit", CORNELL, "-o", self.place / "out", *QUICK)
        self.assert_exit(result, 5)
        self.assertIn(f"no libradbake_image.so in {alone}", result.stderr)
        # Not the scene's fault either when a texture asks for it.
        textured = run("submit", SCENES / "tile-game-room6.glb", "-o", self.place / "out", "--sky", "1,1,1", *QUICK)
        self.assert_exit(textured, 5)
        self.assertIn("libradbake_image.so", textured.stderr)
        self.assert_nothing_left("alone")
        # Beside the programs is as good as in ../lib.
        shutil.copy2(BIN.parent / "lib" / "libradbake_image.so", alone)
        self.assert_exit(run("submit", CORNELL, "-o", self.place / "out", *QUICK), 0)

    def test_json_answers_are_one_object(self):
        capabilities = self.run_cli("capabilities", "--json")
        self.assert_exit(capabilities, 0)
        self.assertEqual(json.loads(capabilities.stdout)["protocol_major"], 1)
        self.assertEqual(len(capabilities.stdout.splitlines()), 1)
        unreachable = self.run_cli("list", "--json", "--server", "unix:/nonexistent/socket")
        self.assert_exit(unreachable, 4)
        self.assertEqual(json.loads(unreachable.stdout)["error"]["exit_code"], 4)

    def test_an_unreachable_server_is_named(self):
        result = self.run_cli("submit", CORNELL, "-o", self.place / "out", "--server", "unix:/nonexistent/socket")
        self.assert_exit(result, 4)
        self.assertIn("unix:/nonexistent/socket", result.stderr)
        self.assert_nothing_left()

    def test_commands_on_jobs_need_a_server(self):
        for arguments in (["list"], ["watch", "x"], ["cancel", "x"], ["download", "x", "-o", self.place / "out"]):
            self.assert_exit(self.run_cli(*arguments), 2)


class Outputs(CliTest):
    """scene.glb and its sidecar, looked into as an engine would."""

    def bake(self, scene, *arguments):
        result = self.run_cli("submit", scene, "-o", self.place / "out", *QUICK, *arguments)
        self.assert_exit(result, 0)
        self.folder = self.place / "out"
        self.sidecar = json.loads((self.folder / "lightmaps.json").read_text())
        self.gltf, self.chunk = cli_scenes.glb_parts((self.folder / "scene.glb").read_bytes())
        return result

    def primitive(self, entry):
        """The primitive of scene.glb that an entry of the sidecar speaks of."""
        mesh = self.gltf["nodes"][entry["node"]]["mesh"]
        return self.gltf["meshes"][mesh]["primitives"][entry["primitive"]]

    def floats(self, accessor):
        return cli_scenes.floats(self.gltf, self.chunk, accessor)

    def test_every_primitive_has_its_lightmap(self):
        self.bake(CORNELL)
        lightmap, = self.sidecar["lightmaps"]
        self.assertEqual((lightmap["name"], lightmap["quantity"], lightmap["unit"]), ("lightmap_0", "irradiance", "lx"))
        self.assertEqual([entry["file"] for entry in lightmap["files"]], ["lightmap_0.exr"])
        self.assertEqual([(m["node_name"], m["primitive"]) for m in self.sidecar["meshes"]],
                         [("cornell", i) for i in range(4)])
        for entry in self.sidecar["meshes"]:
            primitive = self.primitive(entry)
            extension = self.gltf["materials"][primitive["material"]]["extensions"]["MOZ_lightmap"]
            self.assertEqual(extension["intensity"], lightmap["maximum"])
            self.assertEqual(entry["uv_source"], "kept")
            image = self.gltf["images"][self.gltf["textures"][extension["index"]]["source"]]
            view = self.gltf["bufferViews"][image["bufferView"]]
            png = self.chunk[view["byteOffset"]:view["byteOffset"] + view["byteLength"]]
            # Width, height, 16 bits, three channels.
            self.assertEqual(png[16:26], struct.pack(">IIBB", lightmap["width"], lightmap["height"], 16, 2))

    def test_instances_get_places_of_their_own(self):
        scene = cli_scenes.square()
        scene["nodes"].append({"name": "ceiling", "mesh": 0, "translation": [0, 1, 0], "rotation": [1, 0, 0, 0]})
        scene["scenes"][0]["nodes"] = [0, 1]
        path = self.place / "two.gltf"
        path.write_text(json.dumps(scene))
        self.bake(path, "--texels-per-meter", "8")
        self.assertEqual([(m["node_name"], m["lightmap"]) for m in self.sidecar["meshes"]],
                         [("floor", 0), ("ceiling", 0)])
        boxes = []
        for entry in self.sidecar["meshes"]:
            uvs = self.floats(self.primitive(entry)["attributes"]["TEXCOORD_1"])
            boxes.append((min(uvs[::2]), min(uvs[1::2]), max(uvs[::2]), max(uvs[1::2])))
            self.assertGreaterEqual(min(boxes[-1]), 0)
            self.assertLessEqual(max(boxes[-1]), 1)
            if entry["uv_source"] == "placed":
                own = cli_scenes.TEXCOORDS
                placed = [s * x + o for uv in own for x, s, o in zip(uv, entry["scale"], entry["offset"])]
                for got, want in zip(uvs, placed):
                    self.assertAlmostEqual(got, want, delta=1e-6)  # float32
        a, b = boxes
        self.assertTrue(a[2] < b[0] or b[2] < a[0] or a[3] < b[1] or b[3] < a[1], f"{a} and {b} overlap")

    def test_a_full_sheet_is_followed_by_another(self):
        scene = cli_scenes.square()
        scene["nodes"].append({"name": "ceiling", "mesh": 0, "translation": [0, 1, 0], "rotation": [1, 0, 0, 0]})
        scene["scenes"][0]["nodes"] = [0, 1]
        path = self.place / "two.gltf"
        path.write_text(json.dumps(scene))
        self.bake(path)  # a metre takes 32 of 64 texels, and padding: two side by side do not fit
        self.assertEqual([(m["lightmap"], m["file"]) for m in self.sidecar["meshes"]],
                         [(0, "lightmap_0.exr"), (1, "lightmap_1.exr")])
        for entry in self.sidecar["meshes"]:
            lightmap = self.sidecar["lightmaps"][entry["lightmap"]]
            material = self.gltf["materials"][self.primitive(entry)["material"]]
            self.assertEqual(material["name"], "glow")
            self.assertEqual(material["extensions"]["MOZ_lightmap"]["intensity"], lightmap["maximum"] or 1)

    def test_a_mesh_without_a_layout_is_unwrapped(self):
        self.bake(SCENES / "tile-game-room6.glb", "--sky", "1,1,1", "--texels-per-meter", "1")
        self.assertIn("unwrapped", [m["uv_source"] for m in self.sidecar["meshes"]])
        for entry in self.sidecar["meshes"]:
            attributes = self.primitive(entry)["attributes"]
            uvs = self.floats(attributes["TEXCOORD_1"])
            self.assertTrue(all(0 <= x <= 1 for x in uvs))
            counts = {self.gltf["accessors"][accessor]["count"] for accessor in attributes.values()}
            self.assertEqual(counts, {len(uvs) // 2})

    def test_light_by_vertex_needs_no_image(self):
        result = self.bake(CORNELL, "--output", "vertices", "--vertex-colors")
        names = ["scene.glb", "lightmaps.json", "report.json"]
        self.assertEqual(result.stdout.splitlines()[1:], [str(self.folder / name) for name in names])
        self.assertEqual(sorted(os.listdir(self.folder)), sorted(names))
        self.assertEqual(self.sidecar["lightmaps"], [])
        self.assertNotIn("images", self.gltf)
        brightest = 0
        for entry in self.sidecar["meshes"]:
            attributes = self.primitive(entry)["attributes"]
            light = self.floats(attributes["_IRRADIANCE"])
            self.assertEqual(len(light) // 3, self.gltf["accessors"][attributes["POSITION"]]["count"])
            colours = self.floats(attributes["COLOR_0"])
            for vertex in range(len(light) // 3):
                for channel in range(3):
                    expected = light[3 * vertex + channel] / self.sidecar["vertices"]["maximum"]
                    self.assertAlmostEqual(colours[4 * vertex + channel], expected, delta=1e-6)  # float32
            brightest = max(brightest, *light)
        self.assertEqual(brightest, self.sidecar["vertices"]["maximum"])
        self.assertGreater(brightest, 0)

    def test_both_kinds_of_light_and_all_encodings(self):
        self.bake(CORNELL, "--output", "both", "--encoding", "png-rgbm,hdr,exr")
        self.assertEqual(sorted(os.listdir(self.folder)),
                         ["lightmap_0.exr", "lightmap_0.hdr", "lightmap_0.png", "lightmap_0_rgbm.png", "lightmaps.json",
                          "report.json", "scene.glb"])
        self.assertEqual([f["encoding"] for f in self.sidecar["lightmaps"][0]["files"]], ["png-rgbm", "hdr", "exr"])
        self.assertTrue((self.folder / "lightmap_0.hdr").read_bytes().startswith(b"#?RADIANCE"))
        for entry in self.sidecar["meshes"]:
            self.assertLessEqual({"TEXCOORD_1", "_IRRADIANCE"}, set(self.primitive(entry)["attributes"]))


class SharedServer(CliTest):
    def setUp(self):
        super().setUp()
        with open(self.place / "log", "w") as log:
            self.server = subprocess.Popen(
                [BIN / "radbaked", "--listen", f"unix:{self.place}/socket", "--data", self.place / "data"],
                env=self.env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log, text=True)
        self.addCleanup(self.stop_server)
        self.assertIn("listening on", self.server.stdout.readline())
        self.env["RADBAKE_SERVER"] = f"unix:{self.place}/socket"

    def stop_server(self):
        self.server.terminate()
        self.server.wait(timeout=LIMIT_SECONDS)
        self.server.stdout.close()

    def bakes(self):
        result = self.run_cli("list", "--json")
        self.assert_exit(result, 0)
        return json.loads(result.stdout)["bakes"]

    def start_long_bake(self):
        process = self.start_cli("submit", CORNELL, "-o", self.place / "long", *LONG)
        return process, process.stdout.readline().strip()

    def test_a_bake_is_listed_watched_and_downloaded_by_others(self):
        submitted = self.run_cli("submit", CORNELL, "-o", self.place / "out", *QUICK)
        self.assert_exit(submitted, 0)
        name = submitted.stdout.splitlines()[0]
        self.assertEqual([(bake["name"], bake["state"], bake["label"]) for bake in self.bakes()],
                         [(name, "SUCCEEDED", "cornell.glb")])

        watched = self.run_cli("watch", name, "--json")
        self.assert_exit(watched, 0)
        events = [json.loads(line) for line in watched.stdout.splitlines()]
        self.assertEqual(events[0]["event"], "snapshot")
        self.assertEqual(events[-1]["event"], "finished")

        downloaded = self.run_cli("download", name.removeprefix("bakes/"), "-o", self.place / "again", "--json")
        self.assert_exit(downloaded, 0)
        self.assertEqual(json.loads(downloaded.stdout)["files"], ["lightmap_0.exr", "lightmap_0.png", "report.json"])
        self.assertIn("--scene", downloaded.stderr)
        with_scene = self.run_cli("download", name, "-o", self.place / "again", "--force", "--scene", CORNELL)
        self.assert_exit(with_scene, 0)
        for file in ("lightmap_0.exr", "lightmap_0.png", "scene.glb", "lightmaps.json"):
            self.assertEqual((self.place / "out" / file).read_bytes(), (self.place / "again" / file).read_bytes(), file)

        cancelled = self.run_cli("cancel", name, "--json")
        self.assert_exit(cancelled, 0)
        self.assertEqual(json.loads(cancelled.stdout)["state"], "SUCCEEDED")

    def test_a_download_refuses_a_scene_that_is_not_the_bakes(self):
        scene = self.place / "square.gltf"
        scene.write_text(json.dumps(cli_scenes.square()))
        submitted = self.run_cli("submit", scene, "-o", self.place / "out", *QUICK)
        self.assert_exit(submitted, 0)
        name = submitted.stdout.splitlines()[0]
        # Another material or light is no other scene: what is written comes from the meshes.
        scene.write_text(json.dumps(cli_scenes.square(emissive=(0, 0, 0))))
        self.assert_exit(self.run_cli("download", name, "-o", self.place / "dark", "--scene", scene), 0)
        moved = [(0, 0, 0), (1, 0, 0), (1, 0, -2), (0, 0, -1)]
        scene.write_text(json.dumps(cli_scenes.square(positions=moved)))
        refused = self.run_cli("download", name, "-o", self.place / "moved", "--scene", scene)
        self.assert_exit(refused, 3)
        self.assertIn(f"square.gltf is not the scene of {name}: mesh 'floor/square#0' has changed", refused.stderr)
        self.assertFalse((self.place / "moved").exists())
        missing = self.run_cli("download", name, "-o", self.place / "moved", "--scene", self.place / "nowhere.glb")
        self.assert_exit(missing, 3)
        self.assertIn("nowhere.glb", missing.stderr)

    def test_ctrl_c_in_submit_cancels_the_job(self):
        process, name = self.start_long_bake()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=LIMIT_SECONDS)
        self.assertEqual(process.returncode, 6)
        self.assertEqual([(bake["name"], bake["state"]) for bake in self.bakes()], [(name, "CANCELLED")])
        self.assertFalse((self.place / "long").exists())
        self.assert_exit(self.run_cli("watch", name), 6)
        self.assert_exit(self.run_cli("download", name, "-o", self.place / "out"), 6)
        self.assertFalse((self.place / "out").exists())

    def test_ctrl_c_in_watch_only_leaves(self):
        submit, name = self.start_long_bake()
        watch = self.start_cli("watch", name, "--json")
        self.assertEqual(json.loads(watch.stdout.readline())["event"], "snapshot")
        watch.send_signal(signal.SIGINT)
        watch.communicate(timeout=LIMIT_SECONDS)
        self.assertEqual(watch.returncode, 130)
        self.assertNotIn(self.bakes()[0]["state"], ["CANCELLED", "FAILED", "SUCCEEDED"])
        too_early = self.run_cli("download", name, "-o", self.place / "out")
        self.assert_exit(too_early, 2)
        self.assertIn("no result yet", too_early.stderr)
        # Cancelled from elsewhere, submit says so too.
        self.assert_exit(self.run_cli("cancel", name), 0)
        submit.communicate(timeout=LIMIT_SECONDS)
        self.assertEqual(submit.returncode, 6)

    def test_an_unknown_job_is_a_usage_error(self):
        for arguments in (["watch", "nobody"], ["cancel", "nobody"], ["download", "nobody", "-o", self.place / "out"]):
            result = self.run_cli(*arguments)
            self.assert_exit(result, 2)
            self.assertIn("nobody", result.stderr)

    def test_bad_options_send_nothing(self):
        self.assert_exit(self.run_cli("submit", CORNELL, "-o", self.place / "out", "--atlas-size", "100"), 2)
        too_many = self.run_cli("submit", CORNELL, "-o", self.place / "out", "--rays", "4000000000")
        self.assert_exit(too_many, 2)
        self.assertIn("--rays 4000000000", too_many.stderr)
        self.assertEqual(self.bakes(), [])

    def test_each_kind_of_bad_scene_is_refused_by_name_and_the_server_lives(self):
        for name, content, word in cli_scenes.bad_scenes(CORNELL):
            with self.subTest(scene=name):
                (self.place / name).write_bytes(content)
                result = self.run_cli("submit", self.place / name, "-o", self.place / "out", *QUICK)
                self.assert_exit(result, 3)
                self.assertIn(name, result.stderr)
                self.assertIn(word, result.stderr)
                self.assertFalse((self.place / "out").exists())
        self.assertIsNone(self.server.poll())
        good = self.place / "good.gltf"
        good.write_text(json.dumps(cli_scenes.square()))
        self.assert_exit(self.run_cli("submit", good, "-o", self.place / "out", *QUICK), 0)

    def test_a_scene_file_that_is_not_there_is_a_bad_scene(self):
        result = self.run_cli("submit", self.place / "nowhere.glb", "-o", self.place / "out")
        self.assert_exit(result, 3)
        self.assertIn("nowhere.glb", result.stderr)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)

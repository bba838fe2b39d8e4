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
SMALL = ["--atlas-size", "64", "--max-patches", "300"]
# Passes over it follow each other for as long: for what is asked to finish before its end.
STEADY = ["--time-budget", "10m", *SMALL]
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
        # Not in the test's own folder, which tests look into.
        self.cache = pathlib.Path(tempfile.mkdtemp(prefix="radbake-cache-"))
        self.addCleanup(shutil.rmtree, self.cache, ignore_errors=True)
        self.env = {**os.environ, "TMPDIR": str(self.tmp), "XDG_CACHE_HOME": str(self.cache)}
        for name in ("SERVER", "TLS_CA", "TLS_CERT", "TLS_KEY", "TOKEN"):
            self.env.pop(f"RADBAKE_{name}", None)

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

    def wait_for_note(self, process, words):
        """Reads stderr up to the line that holds the words."""
        lines = []
        for line in process.stderr:
            lines.append(line)
            if words in line:
                return
        self.fail(f"no '{words}' in {''.join(lines)}")

    def interrupt_twice(self, process):
        process.send_signal(signal.SIGINT)
        self.wait_for_note(process, "with the best so far")
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=LIMIT_SECONDS)

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
        names = ["lightmap_0.exr", "lightmap_0.png", "error_0.exr", "scene.glb", "lightmaps.json", "report.json"]
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
                           for file in ("lightmap_0.exr", "error_0.exr", "lightmap_0.png", "scene.glb", "lightmaps.json")])
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

    def test_ctrl_c_writes_the_best_so_far_and_says_so(self):
        process = self.start_cli("submit", CORNELL, "-o", self.place / "out", *STEADY)
        self.assertRegex(process.stdout.readline(), r"^bakes/")
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=LIMIT_SECONDS)
        self.assertEqual(process.returncode, 0, err)
        self.assertRegex(err, r"ending bakes/\w+ with the best so far \(Ctrl-C again: cancel\)")
        self.assertRegex(err, r"warning: error .* %\): the bake was asked to finish")
        self.assertIn("lightmap_0.exr", out)
        report = json.loads((self.place / "out" / "report.json").read_text())
        self.assertEqual((report["error"]["limited_by"], report["error"]["asked"]), ("stopped", None))
        self.assert_nothing_left("out")

    def test_a_second_ctrl_c_cancels_and_cleans_up(self):
        process = self.start_cli("submit", CORNELL, "-o", self.place / "out", *LONG)
        self.assertRegex(process.stdout.readline(), r"^bakes/")
        self.interrupt_twice(process)
        self.assertEqual(process.returncode, 6)
        self.assert_nothing_left()

    def test_sigterm_cancels_and_cleans_up(self):
        process = self.start_cli("submit", CORNELL, "-o", self.place / "out", *LONG)
        self.assertRegex(process.stdout.readline(), r"^bakes/")
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=LIMIT_SECONDS)
        self.assertEqual(process.returncode, 6)
        self.assert_nothing_left()

    def test_an_error_that_is_not_reached_is_a_warning_and_with_strict_an_exit_code(self):
        # A thousandth of a second is over before there is a map.
        hopeless = ["--max-error", "0.01%", "--time-budget", "1ms", *SMALL]
        result = self.run_cli("submit", CORNELL, "-o", self.place / "out", *hopeless)
        self.assert_exit(result, 0)
        self.assertRegex(result.stderr, r"warning: .*asked 0.01 %, not reached: the time was up")
        strict = self.run_cli("submit", CORNELL, "-o", self.place / "strict", "--strict", "--json", *hopeless)
        self.assert_exit(strict, 7)
        events = [json.loads(line) for line in strict.stdout.splitlines()]
        self.assertIn("error_not_reached", [event["id"] for event in events if event["event"] == "warning"])
        self.assertEqual(events[-1]["event"], "written")
        self.assertEqual(sorted(os.listdir(self.place / "strict")), sorted(os.listdir(self.place / "out")))
        reached = self.run_cli("submit", CORNELL, "-o", self.place / "good", "--strict", "--max-error", "50%", *SMALL)
        self.assert_exit(reached, 0)
        self.assertNotIn("warning", reached.stderr)

    def test_folder_that_is_not_empty_is_a_usage_error_unless_forced(self):
        (self.place / "out").mkdir()
        (self.place / "out" / "mine.txt").write_text("mine")
        refused = self.run_cli("submit", CORNELL, "-o", self.place / "out", *QUICK)
        self.assert_exit(refused, 2)
        self.assertIn("--force", refused.stderr)
        self.assertEqual(os.listdir(self.place / "out"), ["mine.txt"])
        self.assert_exit(self.run_cli("submit", CORNELL, "-o", self.place / "out", "--force", *QUICK), 0)
        self.assertEqual(sorted(os.listdir(self.place / "out")),
                         ["error_0.exr", "lightmap_0.exr", "lightmap_0.png", "lightmaps.json", "mine.txt", "report.json",
                          "scene.glb"])

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
        for arguments in (["list"], ["watch", "x"], ["finish", "x"], ["cancel", "x"], ["download", "x", "-o", self.place / "out"]):
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
                         ["error_0.exr", "lightmap_0.exr", "lightmap_0.hdr", "lightmap_0.png", "lightmap_0_rgbm.png",
                          "lightmaps.json", "report.json", "scene.glb"])
        self.assertEqual([f["encoding"] for f in self.sidecar["lightmaps"][0]["files"]], ["png-rgbm", "hdr", "exr"])
        self.assertTrue((self.folder / "lightmap_0.hdr").read_bytes().startswith(b"#?RADIANCE"))
        for entry in self.sidecar["meshes"]:
            self.assertLessEqual({"TEXCOORD_1", "_IRRADIANCE"}, set(self.primitive(entry)["attributes"]))


class Plans(CliTest):
    """What a bake would do, before it does it; effects and layers by name."""

    def write(self, name, content):
        path = self.place / name
        path.write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
        return path

    def plan(self, scene, *arguments):
        result = self.run_cli("plan", scene, "--json", *QUICK, *arguments)
        self.assert_exit(result, 0)
        self.assertEqual(len(result.stdout.splitlines()), 1)
        return json.loads(result.stdout)

    def states(self, scene, *arguments):
        return {effect["effect"]: effect["state"] for effect in self.plan(scene, *arguments)["effects"]}

    def bake(self, scene, *arguments):
        self.assert_exit(self.run_cli("submit", scene, "-o", self.place / "out", "--force", *QUICK, *arguments), 0)
        return json.loads((self.place / "out" / "report.json").read_text())

    def covered(self, name):
        """Values of the covered texels of a layer, red first."""
        rows = cli_scenes.read_exr((self.place / "out" / name).read_bytes())
        return [tuple(rows[c][y][x] for c in "RGB") for y, line in enumerate(rows["A"]) for x, a in enumerate(line) if a > 0]

    def test_a_plan_is_one_page_and_leaves_nothing(self):
        result = self.run_cli("plan", CORNELL, *QUICK)
        self.assert_exit(result, 0)
        self.assertIn("cornell.glb: 46 triangles in 4 meshes", result.stdout)
        for word in ("Effects", "emitters", "interreflection", "absent", "Methods", "form factors", "solver",
                     "Predicted", "gathering", "in all", "Costliest meshes", "cornell/cornell#3"):
            self.assertIn(word, result.stdout)
        self.assertLess(len(result.stdout.splitlines()), 60)
        self.assert_nothing_left()

    def test_a_plan_names_every_effect_that_can_be_overridden(self):
        unknown = self.run_cli("plan", CORNELL, "--effect", "caustics=on")
        self.assert_exit(unknown, 2)
        known = unknown.stderr.split("'caustics' is none of ")[1].splitlines()[0].split(", ")
        plan = self.plan(CORNELL)
        self.assertEqual(list(plan)[0], "effects")
        self.assertEqual([effect["effect"] for effect in plan["effects"]], known)
        self.assertEqual(len(set(known)), 24)
        for effect in plan["effects"]:
            self.assertIn(effect["state"], ("on", "off", "absent", "unsupported"))
            self.assertTrue(effect["reason"], effect)
            self.assertGreaterEqual(effect["seconds"], 0)
        self.assertGreater(plan["num_patches"], 0)
        self.assertGreater(plan["prediction"]["total"]["cpu_seconds"], 0)
        self.assertLessEqual(plan["prediction"]["total"]["cpu_seconds_low"], plan["prediction"]["total"]["cpu_seconds"])
        self.assertEqual([stage["stage"] for stage in plan["client_stages"]],
                         ["connect", "read", "encode", "upload", "plan"])

    def test_a_plan_turns_on_what_the_command_line_adds(self):
        scene = self.write("floor.gltf", cli_scenes.square())
        sky = self.write("dawn.exr", cli_scenes.exr(4, 2, [(1, 1, 1)] * 8))
        plain = self.states(scene)
        self.assertEqual(plain["emitters"], "on")
        for name, arguments in (("sky", ["--sky", "1,1,1"]), ("hdri", ["--hdri", sky]), ("sun", ["--sun", "0,-1,0:9,9,9"]),
                                ("directional", ["--sun", "0,-1,0:9,9,9:0"]), ("vertices", ["--output", "both"]),
                                ("layers", ["--layers", "direct"]), ("ambient_occlusion", ["--layers", "ao"])):
            with self.subTest(effect=name):
                self.assertEqual(plain[name], "absent")
                states = self.states(scene, *arguments)
                self.assertEqual(states[name], "on")
                self.assertEqual({k for k in states if k not in (name, "occlusion") and states[k] != plain[k]}, set())

    def test_a_plan_towards_an_error_says_that_it_is_of_the_first_pass(self):
        for arguments, words in ((["--quality", "draft"], "until the error is 10 %"),
                                 (["--time-budget", "5s"], "until the time is up")):
            result = self.run_cli("plan", CORNELL, *SMALL, *arguments)
            self.assert_exit(result, 0)
            self.assertIn(words, result.stderr)
        self.assertNotIn("first pass", self.run_cli("plan", CORNELL, *QUICK).stderr)

    def test_a_dry_run_is_a_plan(self):
        arguments = ["--effect", "interreflection=off", "--sky", "5,5,5"]
        plan = self.plan(CORNELL, *arguments)
        dry = self.run_cli("submit", CORNELL, "--dry-run", "--json", *QUICK, *arguments)
        self.assert_exit(dry, 0)
        answer = json.loads(dry.stdout)
        for measured in ("prediction", "client_stages"):
            del plan[measured], answer[measured]
        for effect in plan["effects"] + answer["effects"]:
            del effect["seconds"]
        self.assertEqual(answer, plan)
        self.assertIn("interreflection", self.run_cli("submit", CORNELL, "--dry-run", "-o", self.place / "out", *QUICK).stdout)
        self.assert_nothing_left()

    def test_an_override_that_contradicts_the_scene_is_refused_by_name(self):
        for command in (["plan"], ["submit", "--dry-run"], ["submit", "-o", self.place / "out"]):
            with self.subTest(command=command):
                result = self.run_cli(*command, CORNELL, "--effect", "sun=on", *QUICK)
                self.assert_exit(result, 3)
                self.assertIn("'sun'", result.stderr)
        result = self.run_cli("plan", CORNELL, "--effect", "emitters=off", *QUICK)
        self.assert_exit(result, 3)
        self.assertIn("light", result.stderr)
        self.assert_nothing_left()

    def test_a_forced_effect_is_marked(self):
        effects = {effect["effect"]: effect for effect in self.plan(CORNELL, "--effect", "interreflection=off")["effects"]}
        self.assertEqual(effects["interreflection"]["state"], "off")
        self.assertEqual([name for name in effects if effects[name]["is_forced"]], ["interreflection"])

    def test_each_kind_of_bad_sky_image_is_refused_by_name(self):
        nan, inf = float("nan"), float("inf")
        for name, content, word in (
                ("nowhere.hdr", None, "there is no such file"),
                ("text.hdr", b"no picture", "neither a Radiance .hdr nor an OpenEXR image"),
                ("square.exr", cli_scenes.exr(2, 2, [(1, 1, 1)] * 4), "2 x 2 pixels"),
                ("nan.exr", cli_scenes.exr(4, 2, [(1, 1, 1)] * 6 + [(1, nan, 1), (1, 1, 1)]), "nan at pixel (2, 1)"),
                ("inf.exr", cli_scenes.exr(4, 2, [(inf, 1, 1)] + [(1, 1, 1)] * 7), "inf at pixel (0, 0)"),
                ("negative.exr", cli_scenes.exr(4, 2, [(1, 1, 1)] * 7 + [(1, 1, -2)]), "-2 at pixel (3, 1)"),
                ("cut.exr", cli_scenes.exr(4, 2, [(1, 1, 1)] * 8)[:-40], "cut.exr")):
            with self.subTest(image=name):
                if content is not None:
                    self.write(name, content)
                result = self.run_cli("plan", CORNELL, "--hdri", self.place / name)
                self.assert_exit(result, 3)
                self.assertIn(name, result.stderr)
                self.assertIn(word, result.stderr)
        self.assert_exit(self.run_cli("plan", CORNELL, "--hdri", "a.hdr", "--sky", "1,1,1"), 2)
        black = self.write("black.exr", cli_scenes.exr(2, 1, [(0, 0, 0)] * 2))
        dark = self.run_cli("plan", self.write("dark.gltf", cli_scenes.square(emissive=(0, 0, 0))), "--hdri", black)
        self.assert_exit(dark, 3)
        self.assertIn("no light at all", dark.stderr)

    def test_an_even_sky_image_lights_an_open_floor_as_a_sky_does(self):
        scene = self.write("dark.gltf", cli_scenes.square(emissive=(0, 0, 0)))
        sky = self.write("even.exr", cli_scenes.exr(64, 32, [(2, 2, 2)] * 2048))
        # pi x 2 x 50 nit; the sampled rays' share is the noise.
        report = self.bake(scene, "--hdri", f"{sky}:50")
        self.assertAlmostEqual(report["energy"]["mean_irradiance"] / 314.159, 1, delta=0.005)

    def test_layers_are_files_that_sum_to_all_light(self):
        self.bake(CORNELL, "--layers", "ao,direct,indirect", "--ao-distance", "0.3")
        names = ["lightmap_0.exr", "lightmap_0_direct.exr", "lightmap_0_indirect.exr", "lightmap_0_ao.exr"]
        self.assertLessEqual(set(names), set(os.listdir(self.place / "out")))
        light, direct, indirect, openness = (self.covered(name) for name in names)
        self.assertEqual(len({len(light), len(direct), len(indirect), len(openness)}), 1)
        brightest = max(max(texel) for texel in light)
        self.assertGreater(brightest, 0)
        for all_light, a, b in zip(light, direct, indirect):
            for c in range(3):
                # Each is float32, rounded once or twice on its way.
                self.assertAlmostEqual(all_light[c], a[c] + b[c], delta=1e-6 * brightest)
        for texel in openness:
            self.assertEqual(texel[0], texel[1])
            self.assertTrue(0 <= texel[0] <= 1 + 1e-6)
        self.assertLess(min(texel[0] for texel in openness), 0.9)  # corners of the room
        sidecar = json.loads((self.place / "out" / "lightmaps.json").read_text())
        self.assertEqual([layer["name"] for layer in sidecar["lightmaps"][0]["layers"]],
                         ["lightmap_0_direct", "lightmap_0_indirect", "lightmap_0_ao", "error_0"])
        self.assertEqual([layer["unit"] for layer in sidecar["lightmaps"][0]["layers"]], ["lx", "lx", "1", "lx"])
        # The scene carries all light and nothing else.
        gltf, _ = cli_scenes.glb_parts((self.place / "out" / "scene.glb").read_bytes())
        self.assertEqual(len(gltf["images"]), 1)

    def test_layers_change_no_other_map(self):
        self.bake(CORNELL)
        alone = (self.place / "out" / "lightmap_0.exr").read_bytes()
        self.bake(CORNELL, "--layers", "direct,ao")
        self.assertEqual((self.place / "out" / "lightmap_0.exr").read_bytes(), alone)

    def test_a_report_has_what_was_predicted_beside_what_it_took(self):
        result = self.run_cli("submit", CORNELL, "-o", self.place / "out", *QUICK)
        self.assert_exit(result, 0)
        self.assertRegex(result.stderr, r"took .* of CPU time, predicted .* \(.* to .*\), and .* of memory, predicted ")
        report = json.loads((self.place / "out" / "report.json").read_text())
        self.assertEqual(len(report["plan"]["effects"]), 24)
        self.assertNotIn("prediction", report["plan"])  # equal bakes have equal plans
        table = report["run"]["predicted_and_actual"]
        self.assertEqual([row["stage"] for row in table["stages"]], ["preparing", "form_factors", "solving", "gathering"])
        for row in [*table["stages"], table["total"]]:
            self.assertGreater(row["predicted_cpu_seconds"], 0)
            self.assertLessEqual(row["low"], row["predicted_cpu_seconds"])
            self.assertLessEqual(row["predicted_cpu_seconds"], row["high"])
            self.assertGreaterEqual(row["actual_cpu_seconds"], 0)
        self.assertEqual(table["total"]["actual_cpu_seconds"], report["run"]["cpu_seconds"])
        self.assertEqual(table["memory"]["actual_bytes"], report["run"]["peak_memory_bytes"])
        self.assertGreater(table["memory"]["predicted_bytes"], 0)

    def test_costs_outlive_a_private_server(self):
        self.assert_exit(self.run_cli("submit", CORNELL, "-o", self.place / "out", *QUICK), 0)
        self.assertTrue((self.cache / "radbake" / "costs").is_file())
        self.assertEqual(self.plan(CORNELL)["prediction"]["source"], "stored")
        # A folder that cannot be made is no reason to fail.
        self.assert_exit(self.run_cli("plan", CORNELL, *QUICK, XDG_CACHE_HOME="/proc/nobody/cache"), 0)


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
        self.assertEqual(json.loads(downloaded.stdout)["files"],
                         ["lightmap_0.exr", "lightmap_0.png", "error_0.exr", "report.json"])
        self.assertIn("--scene", downloaded.stderr)
        with_scene = self.run_cli("download", name, "-o", self.place / "again", "--force", "--scene", CORNELL)
        self.assert_exit(with_scene, 0)
        for file in ("lightmap_0.exr", "error_0.exr", "lightmap_0.png", "scene.glb", "lightmaps.json"):
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

    def test_a_bake_is_finished_by_others(self):
        process = self.start_cli("submit", CORNELL, "-o", self.place / "out", *STEADY)
        name = process.stdout.readline().strip()
        finish = self.run_cli("finish", name.removeprefix("bakes/"))
        self.assert_exit(finish, 0)
        self.assertRegex(finish.stdout, rf"^{name}  asked to finish while ")
        self.assert_exit(self.run_cli("finish", name), 0)
        process.communicate(timeout=LIMIT_SECONDS)
        self.assertEqual(process.returncode, 0)
        self.assertEqual(self.bakes()[0]["state"], "SUCCEEDED")
        ended = self.run_cli("finish", name, "--json")
        self.assert_exit(ended, 0)
        self.assertEqual(json.loads(ended.stdout)["state"], "SUCCEEDED")

    def test_ctrl_c_twice_in_submit_cancels_the_job(self):
        process, name = self.start_long_bake()
        self.interrupt_twice(process)
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

    def test_a_trace_goes_from_the_caller_to_the_servers_log(self):
        trace = "4bf92f3577b34da6a3ce929d0e0e4736"
        for i, (header, is_ours) in enumerate(((f"00-{trace}-00f067aa0ba902b7-01", True), ("not one", False))):
            result = self.run_cli("submit", CORNELL, "-o", self.place / f"out{i}", "--json", "--no-cache", *QUICK,
                                  TRACEPARENT=header)
            self.assert_exit(result, 0)
            submitted = json.loads(result.stdout.splitlines()[0])
            self.assertRegex(submitted["trace_id"], "^[0-9a-f]{32}$")
            self.assertEqual(submitted["trace_id"] == trace, is_ours)
            name = submitted["bake"]["name"]
            lines = [line for line in (self.place / "log").read_text().splitlines() if name in line]
            self.assertGreater(len(lines), 3)
            for line in lines:
                self.assertTrue(line.endswith(f"[trace {submitted['trace_id']}]"), line)

    def test_a_bake_that_fails_names_its_trace(self):
        result = self.run_cli("submit", CORNELL, "-o", self.place / "out", "--json", "--effect", "sun=on", *QUICK)
        self.assert_exit(result, 3)
        error = json.loads(result.stdout.splitlines()[-1])["error"]
        self.assertRegex(error["trace_id"], "^[0-9a-f]{32}$")
        self.assertTrue(error["message"].endswith(f"[trace {error['trace_id']}]"), error)

    def test_whoever_asks_later_is_told_the_trace_of_the_bake(self):
        submitted = self.run_cli("submit", CORNELL, "-o", self.place / "out", "--json", "--effect", "sun=on", *QUICK)
        first = json.loads(submitted.stdout.splitlines()[0])
        name, trace = first["bake"]["name"], first["trace_id"]
        watched = self.run_cli("watch", name, "--json")
        downloaded = self.run_cli("download", name, "-o", self.place / "later", "--json")
        for result in (watched, downloaded):
            self.assert_exit(result, 3)
            error = json.loads(result.stdout.splitlines()[-1])["error"]
            self.assertEqual(error["trace_id"], trace)
            self.assertTrue(error["message"].endswith(f"[trace {trace}]"), error)

    def test_a_detached_submit_is_found_and_downloaded_later(self):
        submitted = self.run_cli("submit", CORNELL, "--detach", "--priority", "7", *QUICK)
        self.assert_exit(submitted, 0)
        name = submitted.stdout.strip()
        self.assertRegex(name, r"^bakes/\w+$")
        self.assertIn(f"{name} goes on without us", submitted.stderr)
        (bake,) = self.bakes()
        self.assertEqual((bake["name"], bake["priority"], bake["label"]), (name, 7, "cornell.glb"))
        self.assert_exit(self.run_cli("watch", name), 0)
        self.assert_exit(self.run_cli("download", name, "-o", self.place / "out"), 0)
        self.assertTrue((self.place / "out" / "report.json").exists())
        # The same again has its result at once.
        again = self.run_cli("submit", CORNELL, "--detach", *QUICK)
        self.assert_exit(again, 0)
        self.assertIn(f"{again.stdout.strip()} has its result", again.stderr)
        self.assertNotIn("goes on", again.stderr)

    def test_a_bake_of_higher_priority_starts_earlier(self):
        running = self.run_cli("submit", CORNELL, "--detach", *LONG).stdout.strip()
        last, first = (self.run_cli("submit", CORNELL, "--detach", "--priority", priority, *QUICK, "--seed", seed)
                       .stdout.strip() for priority, seed in (("-5", "1"), ("5", "2")))
        places = {bake["name"]: bake["queue_position"] for bake in self.bakes()}
        self.assertEqual((places[first], places[last]), (1, 2))
        self.assert_exit(self.run_cli("cancel", running), 0)

    def test_an_unknown_job_is_a_usage_error(self):
        for arguments in (["watch", "nobody"], ["finish", "nobody"], ["cancel", "nobody"], ["download", "nobody", "-o", self.place / "out"]):
            result = self.run_cli(*arguments)
            self.assert_exit(result, 2)
            self.assertIn("nobody", result.stderr)

    def test_bad_options_send_nothing(self):
        self.assert_exit(self.run_cli("submit", CORNELL, "-o", self.place / "out", "--atlas-size", "100"), 2)
        too_many = self.run_cli("submit", CORNELL, "-o", self.place / "out", "--rays", "4000000000")
        self.assert_exit(too_many, 2)
        self.assertIn("--rays 4000000000", too_many.stderr)
        self.assertEqual(self.bakes(), [])

    def test_a_plan_and_a_dry_run_queue_nothing(self):
        self.assert_exit(self.run_cli("plan", CORNELL, *QUICK), 0)
        self.assert_exit(self.run_cli("submit", CORNELL, "--dry-run", *QUICK), 0)
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

"""Every call, ended in every way: afterwards the server has no call, no plan, no connection and no file open that it had
not before.

  endings_test.py BIN_FOLDER ENCODE_SCENE SCENES_FOLDER STUBS_FOLDER [unittest arguments]
"""
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

BIN, ENCODE_SCENE, SCENES, STUBS = (pathlib.Path(argument).resolve() for argument in sys.argv[1:5])
sys.path.insert(0, str(STUBS))

import grpc  # noqa: E402

import python_client  # noqa: E402
from python_client import bake_pb2, bake_pb2_grpc, content_pb2, content_pb2_grpc, digest_of  # noqa: E402
from python_client import server_pb2, server_pb2_grpc, settings_pb2  # noqa: E402

LIMIT_SECONDS = 120
# Of a bake that does not end by itself while a test looks at it.
LONG = {"atlas_size": 1024, "rays": 65536}
SHORT = {"atlas_size": 64, "rays": 8, "max_patches": 64}
STREAMS = ("Upload", "Download", "WatchBake")
GARBAGE = b"\xff\xff\xff\xff no message"

# More than a connection takes that nobody reads from.
LARGE = bytes(16 << 20)

# Opens calls that last, makes plans without end, and waits to be killed. Digests are SHA-256:SIZE.
DYING_CLIENT = """
import sys, time
address, watched, manifest, large, *folders = sys.argv[1:]
sys.path[:0] = folders
import grpc
from radbake.v1 import bake_pb2, bake_pb2_grpc, content_pb2, content_pb2_grpc
def digest(text):
    sha256, size = text.split(":")
    return content_pb2.Digest(sha256=sha256, size_bytes=int(size))
channel = grpc.insecure_channel(address)
bakes, content = bake_pb2_grpc.BakesStub(channel), content_pb2_grpc.ContentStub(channel)
def endless():
    yield content_pb2.UploadChunk(digest=digest("0" * 64 + ":1000000"), data=b"x")
    time.sleep(1000)
watch = bakes.WatchBake(bake_pb2.WatchBakeRequest(name=watched, include_tiles=True))
next(watch)
download = content.Download(content_pb2.DownloadRequest(digest=digest(large)))
next(download)
upload = content.Upload(endless())
while True:
    bakes.PlanBake(bake_pb2.PlanBakeRequest(manifest=digest(manifest)))
"""


class Endings(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="radbake-end-")
        cls.place = pathlib.Path(cls.temporary.name)
        encoded = subprocess.run([ENCODE_SCENE, SCENES / "goral.glb", cls.place / "blobs", "64"], check=True,
                                 stdout=subprocess.PIPE, text=True, timeout=LIMIT_SECONDS)
        cls.manifest, cls.blobs = python_client.read_blobs(cls.place / "blobs", encoded.stdout.strip())

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def setUp(self):
        self.log = open(self.place / "log", "w")
        self.server = subprocess.Popen(
            [BIN / "radbaked", "--listen", "127.0.0.1:0", "--admin-listen", "127.0.0.1:0", "--data",
             self.place / self.id().split(".")[-1], "--drain-grace", "0"],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.addCleanup(self.end_server)
        self.address = self.server.stdout.readline().split()[-1]
        self.admin = self.server.stdout.readline().split()[-1]
        self.client = python_client.Client(self.address)
        self.client.upload_missing(self.blobs)
        self.short = self.submit("short", SHORT)
        for message in self.client.watch(self.short):
            if message.HasField("finished"):
                self.assertEqual(message.finished.state, bake_pb2.SUCCEEDED)
                self.lightmap = message.finished.result.layers[0].blob
        self.long = self.submit("long", LONG)
        while self.client.bakes.GetBake(bake_pb2.GetBakeRequest(name=self.long)).state < bake_pb2.FORM_FACTORS:
            time.sleep(0.01)

    def end_server(self):
        if self.server.poll() is None:
            self.server.kill()
        self.server.wait(timeout=LIMIT_SECONDS)
        self.server.stdout.close()
        self.log.close()

    def submit(self, request_id, settings):
        return self.client.bakes.SubmitBake(self.submission(request_id, settings), timeout=LIMIT_SECONDS).name

    def submission(self, request_id, settings=SHORT):
        return bake_pb2.SubmitBakeRequest(request_id=request_id, manifest=digest_of(self.manifest),
                                          settings=settings_pb2.BakeSettings(**settings))

    def calls(self, channel, unique):
        """Each call of the API, as a function that begins it: name -> start(timeout)."""
        bakes, content = bake_pb2_grpc.BakesStub(channel), content_pb2_grpc.ContentStub(channel)
        server = server_pb2_grpc.ServerStub(channel)
        data = unique.encode() * 1000
        begun = content_pb2.UploadChunk(digest=digest_of(data), data=data[:100])

        def open_upload():
            yield begun
            time.sleep(LIMIT_SECONDS)

        plan = bake_pb2.PlanBakeRequest(manifest=digest_of(self.manifest), settings=settings_pb2.BakeSettings(**SHORT))
        return {
            "GetCapabilities": lambda t: server.GetCapabilities.future(server_pb2.GetCapabilitiesRequest(), timeout=t),
            "FindMissing": lambda t: content.FindMissing.future(
                content_pb2.FindMissingRequest(digests=[self.lightmap]), timeout=t),
            "QueryUpload": lambda t: content.QueryUpload.future(
                content_pb2.QueryUploadRequest(digest=self.lightmap), timeout=t),
            "Upload": lambda t: content.Upload(open_upload(), timeout=t),
            "Download": lambda t: content.Download(content_pb2.DownloadRequest(digest=self.lightmap), timeout=t),
            "SubmitBake": lambda t: bakes.SubmitBake.future(self.submission(unique), timeout=t),
            "PlanBake": lambda t: bakes.PlanBake.future(plan, timeout=t),
            "GetBake": lambda t: bakes.GetBake.future(bake_pb2.GetBakeRequest(name=self.short), timeout=t),
            "ListBakes": lambda t: bakes.ListBakes.future(bake_pb2.ListBakesRequest(), timeout=t),
            "WatchBake": lambda t: bakes.WatchBake(
                bake_pb2.WatchBakeRequest(name=self.long, include_tiles=True), timeout=t),
            "CancelBake": lambda t: bakes.CancelBake.future(bake_pb2.CancelBakeRequest(name=self.short), timeout=t),
            "FinishBake": lambda t: bakes.FinishBake.future(bake_pb2.FinishBakeRequest(name=self.short), timeout=t),
        }

    def metrics(self):
        with urllib.request.urlopen(f"http://{self.admin}/metrics", timeout=LIMIT_SECONDS) as page:
            lines = page.read().decode().splitlines()
        return {line.rsplit(" ", 1)[0]: float(line.rsplit(" ", 1)[1]) for line in lines if not line.startswith("#")}

    def held(self):
        """What calls hold: open calls, plans, descriptors of the server."""
        metrics = self.metrics()
        calls = sum(value for name, value in metrics.items() if name.startswith("radbake_rpcs_open"))
        descriptors = len(list(pathlib.Path(f"/proc/{self.server.pid}/fd").iterdir()))
        return {"calls": calls, "plans": metrics["radbake_running_plans"], "descriptors": descriptors}

    def wait_until_open(self, process, *methods):
        """Waits until a process holds calls of all these methods, and a plan is being made."""
        limit = time.monotonic() + LIMIT_SECONDS
        while True:
            metrics = self.metrics()
            is_open = [any(name.startswith("radbake_rpcs_open") and f"{method}\"" in name and value == 1
                           for name, value in metrics.items()) for method in methods]
            if all(is_open) and metrics["radbake_running_plans"] == 1:
                return
            self.assertIsNone(process.poll())
            self.assertLess(time.monotonic(), limit, f"open: {is_open}")

    def expect_nothing_held(self, before):
        limit = time.monotonic() + LIMIT_SECONDS
        while True:
            now = self.held()
            # Partial uploads keep their file open for a minute: they can be gone on with.
            if now["calls"] == 0 and now["plans"] == 0 and now["descriptors"] <= before["descriptors"] + self.partial:
                return
            if time.monotonic() > limit:
                self.fail(f"held: {now}, before: {before}")
            time.sleep(0.02)

    def end_each(self, how):
        """Ends each call in one way, by a connection of its own."""
        before = self.held()
        self.partial = 0
        for name in self.calls(self.client.channel, ""):
            with self.subTest(call=name):
                channel = grpc.insecure_channel(self.address)
                self.partial += name == "Upload"
                how(name, self.calls(channel, f"{self.id()} {name}")[name])
                channel.close()
                self.expect_nothing_held(before)

    def test_what_is_open_shows(self):
        before = self.held()
        watch = self.client.bakes.WatchBake(bake_pb2.WatchBakeRequest(name=self.long), timeout=LIMIT_SECONDS)
        next(watch)
        self.assertEqual(self.held()["calls"], before["calls"] + 1)
        watch.cancel()

    def test_to_their_end(self):
        def end(name, start):
            # A bake that goes on and an upload that does not have no end but this one.
            call = start(2 if name in ("Upload", "WatchBake") else LIMIT_SECONDS)
            try:
                list(call) if name in STREAMS else call.result()
                self.assertNotIn(name, ("Upload", "WatchBake"))
            except grpc.RpcError as error:
                self.assertEqual(error.code(), grpc.StatusCode.DEADLINE_EXCEEDED, name)
        self.end_each(end)

    def test_cancelled(self):
        self.end_each(lambda name, start: start(LIMIT_SECONDS).cancel())

    def test_cancelled_a_little_later(self):
        def end(name, start):
            call = start(LIMIT_SECONDS)
            time.sleep(0.05)
            call.cancel()
        self.end_each(end)

    def test_at_their_deadline(self):
        def end(name, start):
            call = start(0.001)
            try:
                list(call) if name in STREAMS else call.result()
            except grpc.RpcError as error:
                self.assertEqual(error.code(), grpc.StatusCode.DEADLINE_EXCEEDED, name)
        self.end_each(end)

    def test_with_bytes_that_are_no_message(self):
        before = self.held()
        self.partial = 0
        for path in ["Server/GetCapabilities", "Content/FindMissing", "Content/QueryUpload", "Content/Upload",
                     "Content/Download", "Bakes/SubmitBake", "Bakes/PlanBake", "Bakes/GetBake", "Bakes/ListBakes",
                     "Bakes/WatchBake", "Bakes/CancelBake", "Bakes/FinishBake", "Bakes/NoSuchCall"]:
            with self.subTest(call=path):
                channel = grpc.insecure_channel(self.address)
                call = channel.stream_stream(f"/radbake.v1.{path}")
                with self.assertRaises(grpc.RpcError) as refused:
                    list(call(iter([GARBAGE]), timeout=LIMIT_SECONDS))
                self.assertNotEqual(refused.exception.code(), grpc.StatusCode.DEADLINE_EXCEEDED)
                channel.close()
                self.expect_nothing_held(before)

    def test_with_a_client_that_is_killed(self):
        self.client.upload(LARGE)
        before = self.held()
        self.partial = 1
        digests = [f"{digest.sha256}:{digest.size_bytes}" for digest in (digest_of(self.manifest), digest_of(LARGE))]
        for _ in range(5):
            dying = subprocess.Popen(
                [sys.executable, "-B", "-c", DYING_CLIENT, self.address, self.long, *digests, str(STUBS)])
            self.wait_until_open(dying, "WatchBake", "Download", "Upload", "PlanBake")
            dying.send_signal(signal.SIGKILL)
            dying.wait(timeout=LIMIT_SECONDS)
            self.expect_nothing_held(before)

    def test_with_a_server_that_is_stopped(self):
        channel = grpc.insecure_channel(self.address)
        calls = self.calls(channel, self.id())
        watch, upload = calls["WatchBake"](LIMIT_SECONDS), calls["Upload"](LIMIT_SECONDS)
        next(watch)
        plan = calls["PlanBake"](LIMIT_SECONDS)
        self.server.send_signal(signal.SIGTERM)
        self.assertEqual(self.server.wait(timeout=LIMIT_SECONDS), 0)
        for call in (watch, upload):
            with self.assertRaises(grpc.RpcError) as ended:
                list(call)
            self.assertIn(ended.exception.code(), (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED))
        self.assertTrue(plan.exception(timeout=LIMIT_SECONDS) is None or
                        plan.code() in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED))
        channel.close()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[5:])

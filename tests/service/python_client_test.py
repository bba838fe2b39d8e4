"""Bakes the Cornell box through the Python client and compares every byte with what `radbake submit` writes.

  python_client_test.py BIN_FOLDER ENCODE_SCENE SCENES_FOLDER STUBS_FOLDER [unittest arguments]
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

BIN, ENCODE_SCENE, SCENES, STUBS = (pathlib.Path(argument) for argument in sys.argv[1:5])
sys.path.insert(0, str(STUBS))

import grpc  # noqa: E402
import numpy  # noqa: E402
import OpenImageIO as oiio  # noqa: E402

import python_client  # noqa: E402
from python_client import bake_pb2, content_pb2, digest_of, settings_pb2  # noqa: E402

CORNELL = SCENES / "cornell.glb"
ATLAS_SIZE, RAYS, MAX_PATCHES = 64, 16, 300
# For what must not hang; no test depends on how long anything takes.
LIMIT_SECONDS = 240


def settings(**changes):
    return settings_pb2.BakeSettings(**{"atlas_size": ATLAS_SIZE, "rays": RAYS, "max_patches": MAX_PATCHES, **changes})


class PythonClient(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="radbake-py-")
        self.addCleanup(temporary.cleanup)
        self.place = pathlib.Path(temporary.name)
        self.address = f"unix:{self.place}/socket"
        with open(self.place / "log", "w") as log:
            self.server = subprocess.Popen([BIN / "radbaked", "--listen", self.address, "--data", self.place / "data"],
                                           stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log, text=True)
        self.addCleanup(self.stop_server)
        self.assertIn("listening on", self.server.stdout.readline())
        encoded = subprocess.run([ENCODE_SCENE, CORNELL, self.place / "blobs", str(ATLAS_SIZE)], check=True,
                                 stdout=subprocess.PIPE, text=True, timeout=LIMIT_SECONDS)
        self.manifest_sha256 = encoded.stdout.strip()
        self.manifest, self.blobs = python_client.read_blobs(self.place / "blobs", self.manifest_sha256)
        self.client = python_client.Client(self.address)
        self.addCleanup(self.client.close)

    def stop_server(self):
        self.server.terminate()
        self.server.wait(timeout=LIMIT_SECONDS)
        self.server.stdout.close()

    def test_the_script_gets_the_bytes_that_radbake_writes(self):
        subprocess.run([sys.executable, "-B", python_client.__file__, self.address, self.manifest_sha256,
                        self.place / "blobs", self.place / "ours", "--atlas-size", str(ATLAS_SIZE), "--rays", str(RAYS),
                        "--max-patches", str(MAX_PATCHES)],
                       env={"PYTHONPATH": str(STUBS)}, check=True, timeout=LIMIT_SECONDS)
        # A private server: a bake of its own, not the stored result.
        subprocess.run([BIN / "radbake", "submit", CORNELL, "-o", self.place / "theirs", "--atlas-size", str(ATLAS_SIZE),
                        "--rays", str(RAYS), "--max-patches", str(MAX_PATCHES)],
                       check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, timeout=LIMIT_SECONDS)
        image = oiio.ImageBuf(str(self.place / "theirs" / "lightmap_0.exr"))
        theirs = numpy.asarray(image.get_pixels(oiio.FLOAT), numpy.float32)
        ours = (self.place / "ours" / "lightmap_0.f32").read_bytes()
        self.assertEqual(theirs.shape, (ATLAS_SIZE, ATLAS_SIZE, 4))
        self.assertEqual(ours, theirs.tobytes())

    def test_an_interrupted_upload_goes_on_where_it_ended(self):
        data = bytes(range(256)) * 4096
        begun = content_pb2.UploadChunk(digest=digest_of(data), data=data[:self.client.limits.chunk_bytes])
        with self.assertRaises(grpc.RpcError):
            list(self.client.content.Upload(iter([begun]), timeout=LIMIT_SECONDS))
        self.assertEqual(self.client.committed_bytes(digest_of(data)), self.client.limits.chunk_bytes)
        self.assertEqual([d.sha256 for d in self.client.find_missing([digest_of(data)])], [digest_of(data).sha256])
        result = self.client.upload(data)
        self.assertFalse(result.already_present)
        self.assertEqual(self.client.find_missing([digest_of(data)]), [])
        self.assertEqual(self.client.download(digest_of(data)), data)

    def test_bytes_under_a_false_digest_are_refused(self):
        lie = content_pb2.UploadChunk(digest=digest_of(b"truth"), data=b"lying", finish=True)
        with self.assertRaises(grpc.RpcError) as refused:
            list(self.client.content.Upload(iter([lie]), timeout=LIMIT_SECONDS))
        self.assertEqual(refused.exception.code(), grpc.StatusCode.DATA_LOSS)
        self.assertEqual(len(self.client.find_missing([digest_of(b"truth")])), 1)

    def test_a_watch_resumes_after_the_sequence_that_it_names(self):
        self.assertEqual(self.client.upload_missing(self.blobs), len(self.blobs))
        name = self.client.submit(digest_of(self.manifest), settings(), "cornell").name
        first = next(m.event for m in self.client.watch(name) if m.HasField("event"))
        self.assertEqual(first.sequence, 1)
        rest = list(self.client.watch(name, first.sequence))
        sequences = [message.event.sequence for message in rest if message.HasField("event")]
        self.assertTrue(rest[0].HasField("snapshot"))
        finished = rest[-1].finished
        self.assertEqual(finished.state, bake_pb2.SUCCEEDED)
        self.assertEqual(sequences, list(range(2, finished.last_sequence + 1)))

    def test_a_bake_of_missing_blobs_names_them(self):
        self.client.upload(self.manifest)
        with self.assertRaises(grpc.RpcError) as refused:
            self.client.submit(digest_of(self.manifest), settings())
        self.assertEqual(refused.exception.code(), grpc.StatusCode.FAILED_PRECONDITION)
        details = dict(refused.exception.trailing_metadata())["grpc-status-details-bin"]
        for digest in python_client.blobs_of(self.manifest):
            self.assertIn(digest.sha256.encode(), details)

    def test_equal_work_has_an_equal_key_and_a_repeated_request_is_the_same_bake(self):
        self.client.upload_missing(self.blobs)
        first, repeated, equal = (self.client.submit(digest_of(self.manifest), settings(), request_id=request)
                                  for request in ("a", "a", "b"))
        other = self.client.submit(digest_of(self.manifest), settings(seed=7))
        self.assertEqual(repeated.name, first.name)
        self.assertEqual(equal.bake_key, first.bake_key)
        self.assertNotEqual(other.bake_key, first.bake_key)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[5:])

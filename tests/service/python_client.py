"""A client of the radbake service written from proto/ alone, by other hands than the C++ one: Python and grpcio.

  python_client.py SERVER MANIFEST BLOBS_FOLDER OUTPUT_FOLDER [--atlas-size N] [--rays N] [--max-patches N]

SERVER is HOST:PORT or unix:PATH. BLOBS_FOLDER holds the manifest and all that it names, each in a file named by its
SHA-256; MANIFEST is one of these names. Writes each layer of the result into OUTPUT_FOLDER, as float32.
Needs python3-grpcio, python3-protobuf and the modules that protoc makes of proto/ on PYTHONPATH.
"""
import argparse
import hashlib
import pathlib
import uuid

import grpc
from google.rpc import status_pb2  # noqa: F401 - what bake_pb2 imports must be found
from radbake.v1 import (bake_pb2, bake_pb2_grpc, content_pb2, content_pb2_grpc, scene_pb2, server_pb2,
                        server_pb2_grpc, settings_pb2)

PROTOCOL_MAJOR = 1
ENDED = (bake_pb2.SUCCEEDED, bake_pb2.FAILED, bake_pb2.CANCELLED)
CALL_SECONDS = 30
# A broken transfer or watch goes on where it ended, this often.
TRIES = 5


class ClientError(Exception):
    pass


def digest_of(data):
    return content_pb2.Digest(sha256=hashlib.sha256(data).hexdigest(), size_bytes=len(data))


def blobs_of(manifest):
    """The digests that a manifest names."""
    scene = scene_pb2.SceneManifest.FromString(manifest)
    return [mesh.blob for mesh in scene.meshes] + [texture.blob for texture in scene.textures]


class Client:
    def __init__(self, address):
        self.channel = grpc.insecure_channel(address)
        self.content = content_pb2_grpc.ContentStub(self.channel)
        self.bakes = bake_pb2_grpc.BakesStub(self.channel)
        self.capabilities = server_pb2_grpc.ServerStub(self.channel).GetCapabilities(
            server_pb2.GetCapabilitiesRequest(), timeout=CALL_SECONDS, wait_for_ready=True)
        if self.capabilities.protocol_major != PROTOCOL_MAJOR:
            raise ClientError(f"the server speaks protocol {self.capabilities.protocol_major}, not {PROTOCOL_MAJOR}")
        self.limits = self.capabilities.limits

    def close(self):
        self.channel.close()

    def find_missing(self, digests):
        missing = []
        step = self.limits.max_digests_per_call
        for start in range(0, len(digests), step):
            request = content_pb2.FindMissingRequest(digests=digests[start:start + step])
            missing += self.content.FindMissing(request, timeout=CALL_SECONDS).missing
        return missing

    def committed_bytes(self, digest):
        answer = self.content.QueryUpload(content_pb2.QueryUploadRequest(digest=digest), timeout=CALL_SECONDS)
        return answer.committed_bytes

    def chunks(self, data, offset):
        """The messages of an upload that begins at an offset."""
        digest = digest_of(data)
        while True:
            piece = data[offset:offset + self.limits.chunk_bytes]
            finish = offset + len(piece) == len(data)
            yield content_pb2.UploadChunk(digest=digest, offset=offset, data=piece, finish=finish)
            if finish:
                return
            offset, digest = offset + len(piece), None

    def upload(self, data):
        """Stores a blob; one that was begun before goes on where the server says that it ended."""
        digest = digest_of(data)
        for attempt in range(TRIES):
            try:
                *_, result = self.content.Upload(self.chunks(data, self.committed_bytes(digest)))
            except grpc.RpcError as error:
                if error.code() != grpc.StatusCode.UNAVAILABLE or attempt + 1 == TRIES:
                    raise
                continue
            if result.committed_bytes != len(data):
                raise ClientError(f"blob {digest.sha256}: the server stored {result.committed_bytes} of {len(data)} bytes")
            return result

    def upload_missing(self, blobs):
        """Uploads those of {sha256: bytes} that the server has not got; returns how many these were."""
        missing = self.find_missing([digest_of(data) for data in blobs.values()])
        for digest in missing:
            self.upload(blobs[digest.sha256])
        return len(missing)

    def submit(self, manifest, settings, label="", request_id=None):
        request = bake_pb2.SubmitBakeRequest(request_id=request_id or uuid.uuid4().hex, manifest=manifest,
                                             settings=settings, label=label)
        return self.bakes.SubmitBake(request, timeout=CALL_SECONDS)

    def watch(self, name, after_sequence=0):
        """Yields the server's messages up to the last. A broken stream goes on after the last event seen."""
        for attempt in range(TRIES):
            request = bake_pb2.WatchBakeRequest(name=name, after_sequence=after_sequence)
            try:
                for message in self.bakes.WatchBake(request):
                    if message.HasField("event"):
                        after_sequence = message.event.sequence
                    yield message
                    if message.HasField("finished"):
                        return
            except grpc.RpcError as error:
                if error.code() != grpc.StatusCode.UNAVAILABLE:
                    raise
        raise ClientError(f"the watch of {name} broke {TRIES} times")

    def download(self, digest):
        """A blob's bytes, verified. A broken download goes on at the byte where it ended."""
        data = bytearray()
        for attempt in range(TRIES):
            request = content_pb2.DownloadRequest(digest=digest, offset=len(data))
            try:
                for chunk in self.content.Download(request):
                    if chunk.offset != len(data):
                        raise ClientError(f"blob {digest.sha256}: byte {chunk.offset} follows byte {len(data)}")
                    data += chunk.data
                break
            except grpc.RpcError as error:
                if error.code() != grpc.StatusCode.UNAVAILABLE or attempt + 1 == TRIES:
                    raise
        if digest_of(data) != digest:
            raise ClientError(f"blob {digest.sha256}: what arrived has another digest")
        return bytes(data)

    def bake(self, manifest, blobs, settings, label=""):
        """Uploads, submits, watches to the end. -> Bake"""
        self.upload_missing(blobs)
        bake = self.submit(digest_of(manifest), settings, label)
        for message in self.watch(bake.name):
            if message.HasField("event"):
                print(f"{bake.name} {message.event.sequence} {bake_pb2.BakeState.Name(message.event.state)}")
            elif message.HasField("finished"):
                bake = message.finished
        if bake.state != bake_pb2.SUCCEEDED:
            raise ClientError(f"{bake.name} ended {bake_pb2.BakeState.Name(bake.state)}: {bake.error.message}")
        return bake


def read_blobs(folder, manifest_sha256):
    """-> the manifest's bytes, {sha256: bytes} of it and of all that it names"""
    folder = pathlib.Path(folder)
    manifest = (folder / manifest_sha256).read_bytes()
    names = {manifest_sha256} | {digest.sha256 for digest in blobs_of(manifest)}
    return manifest, {name: (folder / name).read_bytes() for name in sorted(names)}


def main():
    parser = argparse.ArgumentParser(description="Bakes an encoded scene and downloads its lightmaps.")
    parser.add_argument("server")
    parser.add_argument("manifest")
    parser.add_argument("blobs_folder")
    parser.add_argument("output_folder", type=pathlib.Path)
    for option in ("--atlas-size", "--rays", "--max-patches"):
        parser.add_argument(option, type=int, default=0)
    options = parser.parse_args()
    client = Client(options.server)
    manifest, blobs = read_blobs(options.blobs_folder, options.manifest)
    settings = settings_pb2.BakeSettings(atlas_size=options.atlas_size, rays=options.rays,
                                         max_patches=options.max_patches)
    bake = client.bake(manifest, blobs, settings)
    options.output_folder.mkdir(parents=True, exist_ok=True)
    for layer in bake.result.layers:
        (options.output_folder / f"{layer.name}.f32").write_bytes(client.download(layer.blob))
        print(f"{layer.name}: {layer.width} x {layer.height} x {layer.channels}, {layer.quantity} in {layer.unit}")
    client.close()


if __name__ == "__main__":
    main()

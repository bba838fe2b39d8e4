"""Clients that submit bakes and write down what they see, whatever becomes of the server; and what is wrong with it.

Of every bake that was accepted must hold:
  * it has ended, well, once: events 1, 2, 3, ... without a gap or a change, of which the last alone is an end
  * its lightmaps are byte for byte those of a bake that nobody disturbed
and of the store: every blob has the digest that it is named by, and nothing half-written is left.
"""
import hashlib
import random
import subprocess
import threading
import time

import grpc

import python_client
from python_client import ENDED, bake_pb2, digest_of, settings_pb2

ATLAS_SIZE = 64
# Work that is kept at a time: so little that every bake leaves checkpoints.
CHECKPOINT_MS = 20
# Bakes that a client keeps on the server.
OUTSTANDING = 3
# For what must not hang.
LIMIT_SECONDS = 240
# Small bakes and bakes of several passes; each is done often, half of the time by itself.
VARIANTS = ([{"rays": 64, "max_patches": 300, "seed": seed} for seed in range(3)] +
            [{"max_error": 0.03, "max_patches": 400, "seed": seed} for seed in range(3)])
# What a server that is not there, or ends, answers.
GONE = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED, grpc.StatusCode.UNKNOWN,
        grpc.StatusCode.CANCELLED)


def encode(encode_scene, scene, folder):
    """A scene's manifest and its blobs, {sha256: bytes}."""
    encoded = subprocess.run([encode_scene, scene, folder, str(ATLAS_SIZE)], check=True, stdout=subprocess.PIPE,
                             text=True, timeout=LIMIT_SECONDS)
    return python_client.read_blobs(folder, encoded.stdout.strip())


def request_for(manifest, variant, request_id, **more):
    return bake_pb2.SubmitBakeRequest(
        request_id=request_id, manifest=digest_of(manifest),
        settings=settings_pb2.BakeSettings(atlas_size=ATLAS_SIZE, **VARIANTS[variant]),
        run=settings_pb2.RunOptions(threads=1, checkpoint_ms=CHECKPOINT_MS), **more)


def undisturbed(address, manifest, blobs):
    """The lightmaps of each variant."""
    client = python_client.Client(address)
    client.upload_missing(blobs)
    expected = []
    for variant in range(len(VARIANTS)):
        name = client.bakes.SubmitBake(request_for(manifest, variant, str(variant)), timeout=LIMIT_SECONDS).name
        finished = [message.finished for message in client.watch(name) if message.HasField("finished")][0]
        assert finished.state == bake_pb2.SUCCEEDED, finished.error.message
        expected.append(lightmaps_of(finished))
    client.close()
    return expected


class History:
    """What one bake's client saw."""

    def __init__(self, name, variant):
        self.name, self.variant = name, variant
        self.events, self.finished = {}, None
        self.faults = []

    def see(self, event):
        known = self.events.setdefault(event.sequence, event)
        if known != event:
            self.faults.append(f"event {event.sequence} was {known.state}, then {event.state}")

    def last(self):
        return max(self.events, default=0)


class Clients:
    """Submits bakes and watches each to its end, whatever becomes of the server."""

    def __init__(self, address, manifest, blobs, patient_with=GONE):
        self.address, self.manifest, self.blobs, self.patient_with = address, manifest, blobs, patient_with
        self.histories = []
        self.lock, self.is_closing = threading.Lock(), threading.Event()
        self.failures = []
        self.threads = [threading.Thread(target=self.work_or_tell, args=(index,)) for index in range(OUTSTANDING)]
        for thread in self.threads:
            thread.start()

    def with_server(self, call):
        """call(client), again while the server is not there, or refuses with one of the codes that are to be expected."""
        limit = time.monotonic() + LIMIT_SECONDS
        while True:
            client = None
            try:
                client = python_client.Client(self.address)
                return call(client)
            except (grpc.RpcError, python_client.ClientError) as error:
                code = error.code() if isinstance(error, grpc.RpcError) else None
                if code == grpc.StatusCode.FAILED_PRECONDITION and "not on the server" in error.details():
                    self.with_server(lambda other: other.upload_missing(self.blobs))
                elif code is not None and code not in self.patient_with:
                    raise
                if time.monotonic() > limit:
                    raise
                time.sleep(0.02)
            finally:
                if client:
                    client.close()

    def work_or_tell(self, index):
        try:
            self.work(index)
        except Exception as error:  # whatever it is, it must not pass for the end of the work
            self.failures.append(f"client {index} gave up: {error!r}")

    def work(self, index):
        choices = random.Random(index)
        count = 0
        while not self.is_closing.is_set():
            count += 1
            variant = choices.randrange(len(VARIANTS))
            request = request_for(self.manifest, variant, f"{index}/{count}", no_cache=choices.random() < 0.7)
            bake = self.with_server(lambda client: client.bakes.SubmitBake(request, timeout=LIMIT_SECONDS))
            again = self.with_server(lambda client: client.bakes.SubmitBake(request, timeout=LIMIT_SECONDS))
            history = History(bake.name, variant)
            if again.name != bake.name:
                history.faults.append(f"the same request was accepted twice, as {again.name} too")
            with self.lock:
                self.histories.append(history)
            while history.finished is None:
                self.with_server(lambda client: self.watch(client, history))

    def watch(self, client, history):
        request = bake_pb2.WatchBakeRequest(name=history.name, after_sequence=history.last())
        for message in client.bakes.WatchBake(request):
            if message.HasField("event"):
                history.see(message.event)
            if message.HasField("finished"):
                history.finished = message.finished

    def close(self):
        """Waits until every bake that was submitted has ended."""
        self.is_closing.set()
        for thread in self.threads:
            thread.join(timeout=LIMIT_SECONDS)


def lightmaps_of(bake):
    return [(layer.name, layer.blob.sha256) for layer in bake.result.layers]


def faults_of(history, expected):
    """What is wrong with what a client saw."""
    yield from history.faults
    sequences = sorted(history.events)
    if sequences != list(range(1, len(sequences) + 1)):
        yield f"events {sequences}"
    ends = [sequence for sequence in sequences if history.events[sequence].state in ENDED]
    if ends != sequences[-1:]:
        yield f"ends at events {ends} of {sequences[-1:]}"
    if history.finished.state != bake_pb2.SUCCEEDED:
        yield f"ended in state {history.finished.state}: {history.finished.error.message}"
    elif lightmaps_of(history.finished) != expected[history.variant]:
        yield "its lightmaps are not those of an undisturbed bake"


def faults_of_store(content):
    for file in content.glob("objects/*/*"):
        if hashlib.sha256(file.read_bytes()).hexdigest() != file.name:
            yield f"blob {file.name} has other bytes"
    for file in content.glob("temporary/*"):
        yield f"{file.name} is left"


def judge(place, clients, faults, *lines):
    """Prints what was done, what came of it and what is wrong, with the log in `place`; the exit code."""
    attempts = sum(seen.finished.attempt for seen in clients.histories if seen.finished)
    print(f"{len(clients.histories)} bakes accepted, {attempts} attempts, {len(faults)} faults")
    for line in [*lines, *faults]:
        print(line)
    if faults:
        print((place / "log").read_text()[-20000:])
    return 1 if faults else 0


def faults_of_all(clients, expected, content):
    """Of every bake, and of the store."""
    yield from clients.failures
    for history in clients.histories:
        if history.finished is None:
            yield f"{history.name}: was accepted and never ended"
        else:
            yield from (f"{history.name}: {fault}" for fault in faults_of(history, expected))
    yield from faults_of_store(content)

"""Kills the server and its workers, again and again, at every point between what must survive and at random moments,
while clients submit and watch; then checks what they saw.

  kill_test.py BIN_FOLDER SERVER ENCODE_SCENE SCENES_FOLDER STUBS_FOLDER [--kills N] [--seed S] [--report FILE]

SERVER is radbaked with failpoints. Afterwards, of every bake that was accepted:
  * it has ended, well, once: events 1, 2, 3, ... without a gap or a change, of which the last alone is an end
  * its lightmaps are byte for byte those of a bake that nobody disturbed
and of the store: every blob has the digest that it is named by, and nothing half-written is left.
"""
import argparse
import collections
import hashlib
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time

BIN, SERVER, ENCODE_SCENE, SCENES, STUBS = (pathlib.Path(argument).resolve() for argument in sys.argv[1:6])
sys.path.insert(0, str(STUBS))

import grpc  # noqa: E402

import python_client  # noqa: E402
from python_client import ENDED, bake_pb2, digest_of, settings_pb2  # noqa: E402

SCENE = SCENES / "goral.glb"
ATLAS_SIZE = 64
# Work that is kept at a time: so little that every bake leaves checkpoints.
CHECKPOINT_MS = 20
# Bakes that a client keeps on the server.
OUTSTANDING = 3
# For what must not hang.
LIMIT_SECONDS = 240
# Of what a round waits for before it kills at random.
ROUND_SECONDS = 4
# Small bakes and bakes of several passes; each is done often, half of the time by itself.
VARIANTS = ([{"rays": 64, "max_patches": 300, "seed": seed} for seed in range(3)] +
            [{"max_error": 0.03, "max_patches": 400, "seed": seed} for seed in range(3)])


class Server:
    """One life of the server."""

    def __init__(self, place, failpoint=None):
        self.address = f"unix:{place}/socket"
        environment = dict(os.environ)
        if failpoint:
            environment["RADBAKE_FAILPOINT"] = failpoint
        self.log = open(place / "log", "a")
        self.process = subprocess.Popen(
            [SERVER, "--listen", self.address, "--data", place / "data", "--worker", BIN / "radbake-worker",
             "--max-attempts", "1000000", "--max-restarts", "1000000"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self.log, env=environment)

    def is_alive(self):
        return self.process.poll() is None

    def workers(self):
        found = []
        for entry in pathlib.Path("/proc").glob("[0-9]*/stat"):
            try:
                name, rest = entry.read_text().split(") ")[-2:]
            except (OSError, ValueError):
                continue
            if "radbake-worker" in name and int(rest.split()[1]) == self.process.pid:
                found.append(int(entry.parent.name))
        return found

    def kill(self):
        self.process.kill()
        self.wait()

    def wait(self):
        self.process.wait(timeout=LIMIT_SECONDS)
        self.log.close()

    def stop(self):
        self.process.terminate()
        self.wait()
        return self.process.returncode


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

    def __init__(self, address, manifest, blobs):
        self.address, self.manifest, self.blobs = address, manifest, blobs
        self.histories, self.num_accepted = [], 0
        self.lock, self.is_closing = threading.Lock(), threading.Event()
        self.threads = [threading.Thread(target=self.work, args=(index,)) for index in range(OUTSTANDING)]
        for thread in self.threads:
            thread.start()

    def with_server(self, call):
        """call(client), again while there is no server."""
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
                elif code not in (None, grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED,
                                  grpc.StatusCode.UNKNOWN, grpc.StatusCode.CANCELLED):
                    raise
                if time.monotonic() > limit:
                    raise
                time.sleep(0.02)
            finally:
                if client:
                    client.close()

    def work(self, index):
        choices = random.Random(index)
        count = 0
        while not self.is_closing.is_set():
            count += 1
            variant = choices.randrange(len(VARIANTS))
            request = bake_pb2.SubmitBakeRequest(
                request_id=f"{index}/{count}", manifest=digest_of(self.manifest),
                settings=settings_pb2.BakeSettings(atlas_size=ATLAS_SIZE, **VARIANTS[variant]),
                run=settings_pb2.RunOptions(threads=1, checkpoint_ms=CHECKPOINT_MS), no_cache=choices.random() < 0.7)
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
        self.is_closing.set()
        for thread in self.threads:
            thread.join(timeout=LIMIT_SECONDS)
        return not any(thread.is_alive() for thread in self.threads)


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


def undisturbed(place, manifest, blobs):
    """The lightmaps of each variant, and the failpoints that bakes pass."""
    server = Server(place, f"list:{place}/failpoints")
    try:
        client = python_client.Client(server.address)
        expected = []
        for variant in VARIANTS:
            settings = settings_pb2.BakeSettings(atlas_size=ATLAS_SIZE, **variant)
            client.upload_missing(blobs)
            request = bake_pb2.SubmitBakeRequest(
                request_id=str(len(expected)), manifest=digest_of(manifest), settings=settings,
                run=settings_pb2.RunOptions(threads=1, checkpoint_ms=CHECKPOINT_MS))
            name = client.bakes.SubmitBake(request, timeout=LIMIT_SECONDS).name
            finished = [message.finished for message in client.watch(name) if message.HasField("finished")][0]
            assert finished.state == bake_pb2.SUCCEEDED, finished.error.message
            expected.append(lightmaps_of(finished))
        client.close()
    finally:
        server.stop()
    return expected, (place / "failpoints").read_text().split()


def disturb(place, clients, failpoints, num_kills, choices):
    """Lives of the server that end by kill -9. Returns how many kills there were of each kind."""
    kills = collections.Counter()
    kinds = failpoints + ["server", "worker", "worker", "worker"]
    server, turn = None, 0
    while sum(kills.values()) < num_kills:
        kind = kinds[turn % len(kinds)]
        turn += 1
        if kind in failpoints:
            if server:
                server.kill()
                kills["server"] += 1
            server = Server(place, f"{kind}:{choices.randint(1, 4)}")
            limit = time.monotonic() + ROUND_SECONDS
            while server.is_alive() and time.monotonic() < limit:
                time.sleep(0.01)
            if server.is_alive():
                kind = "server"
                server.kill()
            else:
                server.wait()
            kills[kind] += 1
            server = None
            continue
        if not server:
            server = Server(place)
        time.sleep(choices.uniform(0, 0.6))
        if kind == "server":
            server.kill()
            server = None
            kills[kind] += 1
        else:
            limit = time.monotonic() + ROUND_SECONDS
            while not server.workers() and time.monotonic() < limit:
                time.sleep(0.005)
            for pid in server.workers():
                try:
                    os.kill(pid, signal.SIGKILL)
                    kills[kind] += 1
                except ProcessLookupError:
                    pass
    if server:
        server.kill()
    return kills


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args(sys.argv[6:])
    with tempfile.TemporaryDirectory(prefix="radbake-kill-") as folder:
        place = pathlib.Path(folder)
        (place / "calm").mkdir()
        encoded = subprocess.run([ENCODE_SCENE, SCENE, place / "blobs", str(ATLAS_SIZE)], check=True,
                                 stdout=subprocess.PIPE, text=True, timeout=LIMIT_SECONDS)
        manifest, blobs = python_client.read_blobs(place / "blobs", encoded.stdout.strip())
        expected, failpoints = undisturbed(place / "calm", manifest, blobs)
        clients = Clients(f"unix:{place}/socket", manifest, blobs)
        began = time.monotonic()
        try:
            kills = disturb(place, clients, failpoints, arguments.kills, random.Random(arguments.seed))
        finally:
            server = Server(place)
            all_ended = clients.close()
        exit_code = server.stop()

        faults = [f"{history.name}: {fault}" for history in clients.histories if history.finished
                  for fault in faults_of(history, expected)]
        faults += faults_of_store(place / "data" / "content")
        if not all_ended:
            faults.append("a bake was accepted and never ended")
        if exit_code != 0:
            faults.append(f"the last server ended with {exit_code}")
        attempts = sum(history.finished.attempt for history in clients.histories if history.finished)
        print(f"{sum(kills.values())} kills in {time.monotonic() - began:.0f} s: {dict(kills)}")
        print(f"{len(clients.histories)} bakes accepted, {attempts} attempts, {len(faults)} faults")
        for fault in faults:
            print(fault)
        if faults:
            print((place / "log").read_text()[-20000:])
        return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

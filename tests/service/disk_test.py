"""Takes the disk away from under the real server, again and again, while clients submit and watch; then checks what they
saw.

  disk_test.py BIN_FOLDER DISK_FAULTS ENCODE_SCENE SCENES_FOLDER STUBS_FOLDER [--faults N] [--seed S]

DISK_FAULTS is disk_faults.cpp as a library. While the disk refuses, the server must say that it does not serve, and why;
when the disk is well again, it must serve again by itself. Afterwards must hold what history.py says, and the database
must be whole.
"""
import argparse
import errno
import os
import pathlib
import random
import sqlite3
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

BIN, DISK_FAULTS, ENCODE_SCENE, SCENES, STUBS = (pathlib.Path(argument).resolve() for argument in sys.argv[1:6])
sys.path.insert(0, str(STUBS))

import grpc  # noqa: E402

import history  # noqa: E402
import python_client  # noqa: E402
from history import LIMIT_SECONDS  # noqa: E402

SCENE = SCENES / "goral.glb"
KINDS = [("write", errno.ENOSPC), ("write", errno.EIO), ("sync", errno.EIO), ("name", errno.EIO)]
# How a client may be told meanwhile.
REFUSALS = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.RESOURCE_EXHAUSTED, grpc.StatusCode.INTERNAL)
WORDS_OF_SQLITE = {errno.ENOSPC: "disk is full", errno.EIO: "disk I/O error"}
NOT_SERVING, SERVING = b"\x08\x02", b"\x08\x01"  # grpc.health.v1.HealthCheckResponse


class Server:
    def __init__(self, place):
        self.address, self.control, self.data = f"unix:{place}/socket", place / "faults", place / "data"
        self.log, self.refusals = open(place / "log", "a"), set()
        environment = dict(os.environ, LD_PRELOAD=str(DISK_FAULTS), RADBAKE_DISK_FAULTS=str(self.control))
        self.process = subprocess.Popen(
            [BIN / "radbaked", "--listen", self.address, "--admin-listen", "127.0.0.1:0", "--data", self.data],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self.log, env=environment, text=True)
        self.process.stdout.readline()
        self.admin = self.process.stdout.readline().split()[-1]
        self.channel = grpc.insecure_channel(self.address)
        self.check = self.channel.unary_unary("/grpc.health.v1.Health/Check")

    def refuse(self, call, number):
        fresh = self.control.with_suffix(".new")
        fresh.write_text(f"{self.data} {call} {number}\n")
        fresh.rename(self.control)

    def allow(self):
        self.control.unlink()

    def why_not_ready(self):
        try:
            urllib.request.urlopen(f"http://{self.admin}/readyz", timeout=LIMIT_SECONDS).read()
            return ""
        except urllib.error.HTTPError as error:
            return error.read().decode()

    def wait_for(self, health):
        """Whether grpc.health.v1 comes to say so, and what /readyz says then."""
        limit = time.monotonic() + LIMIT_SECONDS
        while time.monotonic() < limit:
            if self.check(b"", timeout=LIMIT_SECONDS) == health:
                return True
            time.sleep(0.02)
        return False

    def stop(self):
        self.channel.close()
        self.process.terminate()
        self.process.wait(timeout=LIMIT_SECONDS)
        self.process.stdout.close()
        self.log.close()
        return self.process.returncode


def refusals(server, client, manifest, call, number, unique):
    """Yields what a client is told wrongly where it uploads and submits while the disk refuses."""
    attempts = {"Upload": lambda: client.upload(unique.encode())}
    if call != "name":  # the database renames nothing
        attempts["SubmitBake"] = lambda: client.bakes.SubmitBake(history.request_for(manifest, 0, unique),
                                                                 timeout=LIMIT_SECONDS)
    for name, attempt in attempts.items():
        try:
            attempt()
            yield f"{name} is accepted"
        except grpc.RpcError as error:
            told = f"{error.code().name}: {error.details()}"
            says_why = os.strerror(number) in told or WORDS_OF_SQLITE[number] in told
            if error.code() not in REFUSALS or not says_why or str(server.data) in told:
                yield f"{name}: {told}"
            server.refusals.add(f"{name}, {call} {errno.errorcode[number]}: {told}")


def disturb(server, manifest, num_faults, choices):
    """Yields what was not as it should be."""
    client = python_client.Client(server.address)
    for index in range(num_faults):
        call, number = KINDS[index % len(KINDS)]
        name = f"fault {index}, {errno.errorcode[number]} of {call}"
        time.sleep(choices.uniform(0, 1))
        server.refuse(call, number)
        if not server.wait_for(NOT_SERVING):
            yield f"{name}: still serving"
        elif "standstill: " not in (why := server.why_not_ready()):
            yield f"{name}: /readyz says {why!r}"
        yield from (f"{name}: {told}" for told in refusals(server, client, manifest, call, number, f"new {index}"))
        time.sleep(choices.uniform(0, 1))
        server.allow()
        if not server.wait_for(SERVING):
            yield f"{name}: not serving again, {server.why_not_ready()!r}"
    client.close()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--faults", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args(sys.argv[6:])
    with tempfile.TemporaryDirectory(prefix="radbake-disk-") as folder:
        place = pathlib.Path(folder)
        manifest, blobs = history.encode(ENCODE_SCENE, SCENE, place / "blobs")
        (place / "calm").mkdir()
        calm = Server(place / "calm")
        try:
            expected = history.undisturbed(calm.address, manifest, blobs)
        finally:
            calm.stop()

        server = Server(place)
        clients = history.Clients(server.address, manifest, blobs, history.GONE + REFUSALS)
        began = time.monotonic()
        try:
            faults = list(disturb(server, manifest, arguments.faults, random.Random(arguments.seed)))
        finally:
            clients.close()
            exit_code = server.stop()
        faults += history.faults_of_all(clients, expected, place / "data" / "content")
        whole = sqlite3.connect(place / "data" / "jobs.sqlite").execute("PRAGMA integrity_check").fetchall()
        if whole != [("ok",)]:
            faults.append(f"the database: {whole}")
        if exit_code != 0:
            faults.append(f"the server ended with {exit_code}")
        return history.judge(place, clients, faults,
                             f"{arguments.faults} times without the disk in {time.monotonic() - began:.0f} s",
                             *sorted(server.refusals))


if __name__ == "__main__":
    sys.exit(main())

"""Kills the server and its workers, again and again, at every point between what must survive and at random moments,
while clients submit and watch; then checks what they saw.

  kill_test.py BIN_FOLDER SERVER ENCODE_SCENE SCENES_FOLDER STUBS_FOLDER [--kills N] [--seed S] [--report FILE]

SERVER is radbaked with failpoints. Afterwards must hold what history.py says.
"""
import argparse
import collections
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

BIN, SERVER, ENCODE_SCENE, SCENES, STUBS = (pathlib.Path(argument).resolve() for argument in sys.argv[1:6])
sys.path.insert(0, str(STUBS))

import history  # noqa: E402
from history import LIMIT_SECONDS  # noqa: E402

SCENE = SCENES / "goral.glb"
# So many kills for each failpoint make it sure that each was come to.
ALL_POINTS = 4
# Of what a round waits for before it kills at random.
ROUND_SECONDS = 4


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


def undisturbed(place, manifest, blobs):
    """The lightmaps of each variant, and the failpoints that bakes pass."""
    server = Server(place, f"list:{place}/failpoints")
    try:
        return history.undisturbed(server.address, manifest, blobs), (place / "failpoints").read_text().split()
    finally:
        server.stop()


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
        manifest, blobs = history.encode(ENCODE_SCENE, SCENE, place / "blobs")
        expected, failpoints = undisturbed(place / "calm", manifest, blobs)
        clients = history.Clients(f"unix:{place}/socket", manifest, blobs)
        began = time.monotonic()
        try:
            kills = disturb(place, clients, failpoints, arguments.kills, random.Random(arguments.seed))
        finally:
            server = Server(place)
            clients.close()
        exit_code = server.stop()

        faults = list(history.faults_of_all(clients, expected, place / "data" / "content"))
        if exit_code != 0:
            faults.append(f"the last server ended with {exit_code}")
        num_resumed = (place / "log").read_text().count("goes on from checkpoint")
        if num_resumed == 0:
            faults.append("no worker went on from a checkpoint")
        faults += [f"no server came to {point}" for point in failpoints if arguments.kills >= ALL_POINTS * len(failpoints)
                   and kills[point] == 0]
        return history.judge(place, clients, faults,
                             f"{sum(kills.values())} kills in {time.monotonic() - began:.0f} s: {dict(kills)}",
                             f"{num_resumed} checkpoints used")


if __name__ == "__main__":
    sys.exit(main())

"""What the service costs and bears: measured on one machine, in one run.

  bench_service.py PART --build build/release [--clients 200] [--bakes 2000] [--repeats 5]

PART is
  overhead  from the accepted submit to the last tile, over the seconds that the bake itself takes in `radbake-study bake`
            with the same settings: the Cornell box at 2 %, by turns
  cached    a submit of what has been baked: from the call to the answer, at the client
  crowd     idle watchers, watchers that never read, connections above the limit: the server's memory, and what a call of
            somebody else takes meanwhile
  load      many clients submit many small bakes to a server that is stopped, killed and started meanwhile: all end, each
            client gets its share, and how long a submit takes
Needs python3-grpcio. Prints one JSON object.
"""
import argparse
import collections
import json
import pathlib
import random
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

SCENES = pathlib.Path(__file__).parent.parent / "scenes"
SERVICE = pathlib.Path(__file__).parent.parent / "service"
START_SECONDS, CALL_SECONDS, LOAD_SECONDS = 60, 120, 1800


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


class Server:
    def __init__(self, build, place, options=(), port=0):
        self.log = open(place / "log", "a")
        self.process = subprocess.Popen(
            [build / "bin" / "radbaked", "--listen", f"127.0.0.1:{port}", "--data", place / "data", *options],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self.log, text=True)
        line = self.process.stdout.readline()
        if "listening on" not in line:
            raise RuntimeError("the server does not start: " + (place / "log").read_text()[-500:])
        self.address = line.split()[-1]

    def end(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait(timeout=START_SECONDS)
        self.process.stdout.close()
        self.log.close()

    def peak_mib(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) / 1024


class Scene:
    """As it goes over the wire."""

    def __init__(self, build, place, name, atlas_size=""):
        encoded = subprocess.run([build / "tests" / "encode_scene", SCENES / name, place / "blobs", *atlas_size.split()],
                                 check=True, stdout=subprocess.PIPE, text=True)
        self.manifest, self.blobs = python_client.read_blobs(place / "blobs", encoded.stdout.strip())

    def request(self, request_id, no_cache=False, **settings):
        return bake_pb2.SubmitBakeRequest(request_id=request_id, manifest=digest_of(self.manifest), no_cache=no_cache,
                                          settings=settings_pb2.BakeSettings(**settings))


def finished(client, name):
    for message in client.bakes.WatchBake(bake_pb2.WatchBakeRequest(name=name), timeout=CALL_SECONDS):
        if message.HasField("finished"):
            return message.finished
    raise RuntimeError(f"the watch of {name} ended early")


def overhead(build, place, arguments):
    scene = Scene(build, place, "cornell.glb")
    server = Server(build, place)
    client = python_client.Client(server.address)
    client.upload_missing(scene.blobs)
    rows = []
    for seed in range(arguments.repeats):
        began = time.monotonic()
        bake = client.bakes.SubmitBake(scene.request(f"overhead {seed}", max_error=0.02, seed=seed), timeout=CALL_SECONDS)
        accepted = last_tile = time.monotonic()
        watch = bake_pb2.WatchBakeRequest(name=bake.name, include_tiles=True)
        for message in client.bakes.WatchBake(watch, timeout=CALL_SECONDS):
            if message.HasField("tile"):
                last_tile = time.monotonic()
        ended = time.monotonic()
        study = subprocess.run([build / "bin" / "radbake-study", "bake", SCENES / "cornell.glb", "-o", place / "study",
                                "--max-error", "2%", "--seed", str(seed)], check=True, stdout=subprocess.PIPE, text=True)
        seconds = float(re.search(r"^bake +([0-9.]+) s", study.stdout, re.MULTILINE)[1])
        rows.append({"submit": accepted - began, "last_tile": last_tile - accepted, "finished": ended - accepted,
                     "bake": seconds, "over": last_tile - accepted - seconds})
    server.end()
    bake, over = statistics.mean(r["bake"] for r in rows), statistics.mean(r["over"] for r in rows)
    return {"bakes": rows, "bake_seconds": bake, "over_seconds": over, "over_share": over / bake,
            "allowed_seconds": 0.05 * bake + 0.05}


def cached(build, place, arguments):
    scene = Scene(build, place, "cornell.glb", "64")
    server = Server(build, place)
    client = python_client.Client(server.address)
    client.upload_missing(scene.blobs)
    settings = {"atlas_size": 64, "rays": 16}
    finished(client, client.bakes.SubmitBake(scene.request("first", **settings)).name)
    times = []
    for i in range(100 * arguments.repeats):
        request = scene.request(f"again {i}", **settings)
        began = time.monotonic()
        bake = client.bakes.SubmitBake(request, timeout=CALL_SECONDS)
        times.append(time.monotonic() - began)
        assert bake.state == bake_pb2.SUCCEEDED and bake.from_store
    server.end()
    return {"submits": len(times), "p50_ms": 1e3 * quantile(times, 0.5), "p99_ms": 1e3 * quantile(times, 0.99),
            "max_ms": 1e3 * max(times)}


def crowd(build, place, arguments):
    scene = Scene(build, place, "cornell.glb")
    num_idle, num_deaf, max_connections, num_above = 1000, 50, 64, 200
    server = Server(build, place, ["--max-watches", "2000", "--max-watches-per-tenant", "2000", "--max-connections",
                                   str(max_connections)])
    client = python_client.Client(server.address)
    client.upload_missing(scene.blobs)
    name = client.bakes.SubmitBake(scene.request("long", atlas_size=2048, max_error=0.005), timeout=CALL_SECONDS).name

    def answer_ms():
        times = []
        for _ in range(50):
            began = time.monotonic()
            client.bakes.GetBake(bake_pb2.GetBakeRequest(name=name), timeout=CALL_SECONDS)
            times.append(1e3 * (time.monotonic() - began))
        return quantile(times, 0.5)

    figures = {"alone_mib": server.peak_mib(), "alone_ms": answer_ms()}
    # A connection carries 200 calls.
    channels = [grpc.insecure_channel(server.address, [("grpc.use_local_subchannel_pool", 1)]) for _ in range(8)]
    stubs = [python_client.bake_pb2_grpc.BakesStub(channel) for channel in channels]
    idle = [stubs[i % 6].WatchBake(bake_pb2.WatchBakeRequest(name=name)) for i in range(num_idle)]
    for watch in idle:
        next(watch)
    figures |= {"idle_watchers": num_idle, "with_idle_mib": server.peak_mib(), "with_idle_ms": answer_ms()}
    # They take the first message, and then none: tiles of a bake of many megabytes wait for them.
    deaf = [stubs[6].WatchBake(bake_pb2.WatchBakeRequest(name=name, include_tiles=True)) for _ in range(num_deaf)]
    for watch in deaf:
        next(watch)
    time.sleep(20)
    figures |= {"deaf_watchers": num_deaf, "with_deaf_mib": server.peak_mib(), "with_deaf_ms": answer_ms()}
    host, port = server.address.split(":")
    sockets = [socket.create_connection((host, int(port))) for _ in range(max_connections + num_above)]
    time.sleep(2)
    closed = 0
    for connection in sockets:
        connection.setblocking(False)
        try:
            closed += connection.recv(1 << 16) == b""
        except ConnectionError:
            closed += 1
        except BlockingIOError:
            pass
    figures |= {"connections": len(sockets), "closed_at_once": closed, "with_connections_mib": server.peak_mib(),
                "with_connections_ms": answer_ms(), "state": bake_pb2.BakeState.Name(
                    client.bakes.GetBake(bake_pb2.GetBakeRequest(name=name), timeout=CALL_SECONDS).state)}
    for connection in sockets:
        connection.close()
    for watch in idle + deaf:
        watch.cancel()
    for channel in channels:
        channel.close()
    server.end()
    return figures


class LoadClient(threading.Thread):
    """Submits its bakes at once, and waits for each, whatever becomes of the server."""

    def __init__(self, index, num_bakes, address, scene):
        super().__init__(daemon=True)
        self.index, self.num_bakes, self.address, self.scene = index, num_bakes, address, scene
        self.submit_seconds, self.tries, self.ended, self.fault = [], 0, [], None

    def call(self, function):
        while True:
            self.tries += 1
            try:
                return function()
            except grpc.RpcError as error:
                if error.code() not in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED, grpc.StatusCode.UNKNOWN,
                                        grpc.StatusCode.RESOURCE_EXHAUSTED, grpc.StatusCode.DEADLINE_EXCEEDED):
                    raise
                time.sleep(random.uniform(0.1, 0.5))

    def run(self):
        try:
            client = self.call(lambda: python_client.Client(self.address))
            who = (("radbake-client", f"client {self.index}"),)
            names = []
            for k in range(self.num_bakes):
                # Each a bake of its own.
                request = self.scene.request(f"{self.index}/{k}", atlas_size=64, rays=8, max_patches=64,
                                             seed=1 + self.index * self.num_bakes + k)

                def submit():
                    began = time.monotonic()
                    bake = client.bakes.SubmitBake(request, timeout=CALL_SECONDS, metadata=who)
                    self.submit_seconds.append(time.monotonic() - began)
                    return bake

                names.append(self.call(submit).name)
            for name in names:
                bake = self.call(lambda: finished(client, name))
                self.ended.append((bake.state, bake.finished_unix_ms))
            client.close()
        except Exception as error:  # noqa: BLE001 - told at the end
            self.fault = repr(error)


def load(build, place, arguments):
    scene = Scene(build, place, "goral.glb", "64")
    options = ["--max-queued-bakes", str(arguments.bakes + 1000), "--max-running-bakes", "2", "--threads", "1",
               "--max-restarts", "1000000", "--max-attempts", "1000000"]
    server = Server(build, place, options)
    port = server.address.rsplit(":", 1)[1]
    python_client.Client(server.address).upload_missing(scene.blobs)
    began = time.monotonic()
    each = arguments.bakes // arguments.clients
    clients = [LoadClient(i, each, server.address, scene) for i in range(arguments.clients)]
    for client in clients:
        client.start()
    peaks, restarts = [], []
    while any(client.is_alive() for client in clients) and time.monotonic() - began < LOAD_SECONDS:
        time.sleep(1)
        done = sum(len(client.ended) for client in clients)
        # Twice stopped in good order, twice killed.
        if len(restarts) < 4 and done >= (len(restarts) + 1) * arguments.bakes / 6:
            peaks.append(server.peak_mib())
            how = [signal.SIGTERM, signal.SIGKILL][len(restarts) % 2]
            restarts.append(how.name)
            server.end(how)
            server = Server(build, place, options, port)
    seconds = time.monotonic() - began
    peaks.append(server.peak_mib())
    server.end()

    ends = sorted(end for client in clients for _, end in client.ended)
    states = collections.Counter(state for client in clients for state, _ in client.ended)
    # Each client's bakes that had ended when half of all had.
    half = ends[len(ends) // 2] if ends else 0
    shares = [sum(end <= half for _, end in client.ended) / (each / 2) for client in clients]
    submits = [s for client in clients for s in client.submit_seconds]
    return {"clients": arguments.clients, "bakes": arguments.bakes, "seconds": seconds, "restarts": restarts,
            "succeeded": states[bake_pb2.SUCCEEDED], "ended": len(ends), "faults": [c.fault for c in clients if c.fault],
            "least_share": min(shares), "largest_share": max(shares), "submit_p50_ms": 1e3 * quantile(submits, 0.5),
            "submit_p99_ms": 1e3 * quantile(submits, 0.99), "peak_mib": max(peaks)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=["overhead", "cached", "crowd", "load"])
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--clients", type=int, default=200)
    parser.add_argument("--bakes", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    sys.path[:0] = [str(build / "tests" / "service" / "python"), str(SERVICE)]
    global grpc, python_client, bake_pb2, settings_pb2, digest_of  # noqa: PLW0603 - found in the build folder only
    import grpc
    import python_client
    from python_client import bake_pb2, digest_of, settings_pb2
    with tempfile.TemporaryDirectory(prefix="radbake-bench-") as folder:
        answer = globals()[arguments.part](build, pathlib.Path(folder), arguments)
    print(json.dumps(answer, indent=2))


if __name__ == "__main__":
    main()

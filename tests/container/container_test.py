"""Builds the image of deploy/Dockerfile without a daemon, starts the server in it and bakes against it.

  container_test.py BIN_FOLDER SCENES_FOLDER WORK_FOLDER [unittest arguments]

buildah with chroot isolation runs the unmodified Dockerfile on a base image that mmdebstrap makes of Debian's packages.
Such a container has neither cgroups nor a network of its own: limits, published ports and compose are not tested.
WORK_FOLDER keeps the base, the layers and Debian's packages, so that a second run is quick. What ccache has compiled in
this checkout (build/release) is not compiled again.

Exit code 77: skipped, and the last line says why.
"""
import contextlib
import filecmp
import fcntl
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

BIN, SCENES, WORK = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
ROOT = pathlib.Path(__file__).resolve().parents[2]

EXIT_SKIPPED = 77
BASE, IMAGE = "debian:bookworm-slim", "radbake:test"
USER = 10001
QUICK = ["--atlas-size", "64", "--rays", "16", "--max-patches", "300"]
# For what must not hang; no test depends on how long anything takes.
LIMIT_SECONDS = 240
BUILD_LIMIT_SECONDS = 3600
# What apt says when there is no network: a reason to skip, as everything else of the tests works offline.
UNREACHABLE = re.compile(r"Temporary failure resolving|Could not (resolve|connect)|Unable to connect|Failed to fetch")


class Unavailable(Exception):
    """Images cannot be built here; the text says why."""


class Buildah:
    """buildah with a storage of its own, in WORK_FOLDER."""

    def __init__(self, driver):
        self.command = ["buildah", "--root", WORK / f"storage-{driver}", "--runroot", WORK / f"run-{driver}",
                        "--storage-driver", driver]
        self.env = {**os.environ, "BUILDAH_ISOLATION": "chroot"}

    def arguments(self, *arguments):
        return [str(word) for word in (*self.command, *arguments)]

    def __call__(self, *arguments, seconds=LIMIT_SECONDS):
        result = subprocess.run(self.arguments(*arguments), env=self.env, stdin=subprocess.DEVNULL,
                                capture_output=True, text=True, timeout=seconds)
        if result.returncode != 0:
            raise RuntimeError(f"buildah {arguments[0]} failed: {result.stdout[-4000:]}{result.stderr[-4000:]}")
        return result.stdout.strip()

    def popen(self, *arguments, **options):
        return subprocess.Popen(self.arguments(*arguments), env=self.env, stdin=subprocess.DEVNULL, **options)


def make_base_tarball():
    """Debian 12 as its slim image has it, but for documentation."""
    tarball = WORK / "base.tar"
    if not tarball.exists():
        partial = WORK / "partial.tar"
        result = subprocess.run(["mmdebstrap", "--variant=minbase", "bookworm", partial], stdin=subprocess.DEVNULL,
                                capture_output=True, text=True, timeout=BUILD_LIMIT_SECONDS)
        if result.returncode != 0:
            raise Unavailable("mmdebstrap cannot make a base: " + result.stderr.strip().splitlines()[-1])
        partial.rename(tarball)
    return tarball


def open_buildah():
    """buildah with the base image, on the first storage driver that this machine allows."""
    for program in ("buildah", "mmdebstrap", "ccache"):
        if not shutil.which(program):
            raise Unavailable(f"there is no {program}: deploy/install-packages container")
    if os.geteuid() != 0:
        raise Unavailable("chroot isolation needs root")
    tarball = make_base_tarball()
    for driver in ("overlay", "vfs"):
        buildah = Buildah(driver)
        try:
            if BASE.split(":")[0] not in buildah("images", "--json"):
                container = buildah("from", "scratch")
                buildah("add", container, tarball, "/")
                buildah("commit", container, BASE)
                buildah("rm", container)
            container = buildah("from", "--pull=never", BASE)
            buildah("run", container, "--", "true")
            buildah("rm", container)
            return buildah
        except RuntimeError as error:
            refusal = str(error).strip().splitlines()[-1]
    raise Unavailable(f"this machine refuses containers: {refusal}")


def ccache_of_this_machine():
    """-> the folder of what it has compiled, and a file of the settings that decide what is found there"""
    def setting(key):
        return subprocess.run(["ccache", "-k", key], check=True, capture_output=True, text=True).stdout.strip()
    cache, settings = pathlib.Path(setting("cache_dir")), WORK / "ccache.conf"
    cache.mkdir(parents=True, exist_ok=True)
    keys = ("base_dir", "hash_dir", "sloppiness", "compiler_check")
    settings.write_text("".join(f"{key} = {setting(key)}\n" for key in keys))
    return cache, settings


def build_image(buildah):
    """Runs deploy/Dockerfile as it is. -> its configuration"""
    packages = WORK / "packages"
    packages.mkdir(exist_ok=True)
    cache, settings = ccache_of_this_machine()
    log = WORK / "build.log"
    with open(log, "w") as out:
        build = buildah.popen(
            "bud", "--pull=never", "--format", "docker", "--layers", "--build-arg", f"SOURCE={ROOT}",
            *(["--build-arg", f"LANG={os.environ['LANG']}"] if "LANG" in os.environ else []),
            "--ignorefile", ROOT / "deploy/Dockerfile.dockerignore", "-v", f"{cache}:/ccache",
            "-v", f"{settings}:/etc/ccache.conf:ro", "-v", f"{packages}:/var/cache/apt/archives", "-f", ROOT / "deploy/Dockerfile", "-t", IMAGE, ROOT,
            stdout=out, stderr=subprocess.STDOUT)
        try:
            code = build.wait(timeout=BUILD_LIMIT_SECONDS)
        finally:
            end_all(build)
    if code != 0:
        text = log.read_text()
        if UNREACHABLE.search(text):
            raise Unavailable("Debian's packages cannot be reached")
        raise RuntimeError(f"deploy/Dockerfile does not build: {text[-6000:]}")
    return json.loads(buildah("inspect", "--type", "image", IMAGE))["Docker"]["config"]


def processes_below(pid):
    """{pid: arguments} of all that a process has started."""
    parents = {}
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
            parents[int(folder.name)] = (int(fields[1]), (folder / "cmdline").read_bytes().decode().split("\0")[:-1])
        except OSError:
            continue  # it has ended
    found, below = {}, {pid}
    while below:
        below = {child for child, (parent, _) in parents.items() if parent in below}
        found.update({child: parents[child][1] for child in below})
    return found


def end_all(process):
    """Ends a process that we started, and what it started; nothing where it has ended."""
    if process.poll() is None:
        for pid in processes_below(process.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        process.kill()
    process.wait()


class Container(unittest.TestCase):
    """The image is built once, before the first test."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="radbake-container-")
        self.addCleanup(temporary.cleanup)
        self.place = pathlib.Path(temporary.name)
        self.container = BUILDAH("from", "--pull=never", IMAGE)
        self.addCleanup(BUILDAH, "rm", self.container)

    def run_inside(self, *command):
        return BUILDAH("run", self.container, "--", *command)

    def start_server(self):
        """The image's own command, but for a port that is free. -> process, address"""
        command = [*CONFIG["Entrypoint"], *CONFIG["Cmd"]]
        command[command.index("0.0.0.0:7419")] = "127.0.0.1:0"
        with open(self.place / "log", "w") as log:
            server = BUILDAH.popen("run", self.container, "--", *command, stdout=subprocess.PIPE, stderr=log, text=True)
        self.addCleanup(self.end, server)
        address = re.fullmatch(r"radbaked \S+ listening on (\S+)\n", server.stdout.readline())
        self.assertTrue(address, (self.place / "log").read_text())
        return server, address[1]

    def end(self, server):
        end_all(server)
        server.stdout.close()

    def tini_of(self, server):
        tini, = [pid for pid, command in processes_below(server.pid).items()
                 if command and pathlib.Path(command[0]).name == "tini"]
        return tini

    def submit(self, out, *arguments):
        subprocess.run([BIN / "radbake", "submit", SCENES / "cornell.glb", "-o", out, *QUICK, *arguments], check=True,
                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, timeout=LIMIT_SECONDS)

    def test_image_says_how_it_is_run(self):
        self.assertEqual(CONFIG["User"], f"{USER}:{USER}")
        self.assertEqual(CONFIG["Entrypoint"], ["tini", "--", "radbaked"])
        self.assertEqual(CONFIG["Cmd"], ["--listen", "0.0.0.0:7419", "--insecure-listen", "--data", "/var/lib/radbake"])
        self.assertEqual(list(CONFIG["Volumes"]), ["/var/lib/radbake"])
        self.assertEqual(list(CONFIG["ExposedPorts"]), ["7419/tcp"])
        self.assertEqual(CONFIG["Healthcheck"]["Test"], ["CMD", "radbake", "capabilities", "--server", "127.0.0.1:7419"])

    def test_image_holds_programs_and_neither_compiler_nor_sources(self):
        self.assertEqual(self.run_inside("ls", "/opt/radbake/bin").split(), ["radbake", "radbake-worker", "radbaked"])
        self.assertEqual(self.run_inside("sh", "-c", "command -v g++ cc cmake || true"), "")
        self.assertEqual(self.run_inside("sh", "-c", "find / -xdev -name radbaked.cpp 2>&- || true"), "")
        for program in ("radbake", "radbaked", "radbake-worker"):
            self.assertNotIn("not found", self.run_inside("ldd", f"/opt/radbake/bin/{program}"))

    def test_image_runs_as_an_unprivileged_user_that_owns_the_data_only(self):
        self.assertEqual(self.run_inside("id", "-u"), str(USER))
        self.run_inside("test", "-w", "/var/lib/radbake")
        # Folders that it may not even read are no error.
        self.assertEqual(self.run_inside("sh", "-c", "find /opt /usr /etc -writable -not -type l 2>&- || true"), "")

    def test_server_is_healthy_bakes_the_same_bytes_and_ends_well_on_sigterm(self):
        server, address = self.start_server()
        health = ["127.0.0.1:7419" == word and address or word for word in CONFIG["Healthcheck"]["Test"][1:]]
        self.assertIn("engine version", self.run_inside(*health))
        tini = self.tini_of(server)
        status = pathlib.Path(f"/proc/{tini}/status").read_text()
        self.assertRegex(status, rf"Uid:\s+{USER}\s+{USER}\s+{USER}\s+{USER}")

        self.submit(self.place / "inside", "--server", address)
        self.submit(self.place / "outside")
        self.assertTrue(filecmp.cmp(self.place / "inside/lightmap_0.exr", self.place / "outside/lightmap_0.exr", False))

        os.kill(tini, signal.SIGTERM)
        self.assertEqual(server.wait(timeout=LIMIT_SECONDS), 0)
        with self.assertRaises(RuntimeError):
            self.run_inside(*health)

    def test_sigterm_in_the_middle_of_a_bake_ends_well_too(self):
        server, address = self.start_server()
        submit = subprocess.Popen([BIN / "radbake", "submit", SCENES / "cornell.glb", "-o", self.place / "long",
                                   "--atlas-size", "2048", "--rays", "65536", "--server", address],
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(submit.stdout.close)
        self.addCleanup(submit.wait)
        self.addCleanup(submit.kill)
        self.assertRegex(submit.stdout.readline(), "^bakes/")
        os.kill(self.tini_of(server), signal.SIGTERM)
        self.assertEqual(server.wait(timeout=LIMIT_SECONDS), 0)


if __name__ == "__main__":
    WORK.mkdir(parents=True, exist_ok=True)
    with open(WORK / "lock", "w") as only_one:
        fcntl.flock(only_one, fcntl.LOCK_EX)
        try:
            started = time.monotonic()
            BUILDAH = open_buildah()
            based = time.monotonic()
            CONFIG = build_image(BUILDAH)
            print(f"base image {based - started:.0f} s, image {time.monotonic() - based:.0f} s", flush=True)
        except Unavailable as reason:
            print(f"SKIPPED: {reason}")
            sys.exit(EXIT_SKIPPED)
        unittest.main(argv=sys.argv[:1] + sys.argv[4:])

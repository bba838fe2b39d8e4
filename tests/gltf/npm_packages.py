"""Installs the npm packages of package-lock.json into a build folder, once."""
import fcntl
import pathlib
import shutil
import subprocess

HERE = pathlib.Path(__file__).parent
FILES = ["package.json", "package-lock.json"]
# A registry that cannot be reached is a reason to skip; any other failure is one of ours.
UNREACHABLE = ["ENOTFOUND", "EAI_AGAIN", "ECONNREFUSED", "ECONNRESET", "ETIMEDOUT", "EHOSTUNREACH", "ENETUNREACH",
               "ERR_SOCKET_TIMEOUT", "ENOTCACHED"]
LIMIT_SECONDS = 600


class Unavailable(Exception):
    """The packages cannot be had here; the text says why."""


def install(folder):
    """-> the folder, which then holds node_modules. Tests that run side by side wait for each other."""
    for program in ("node", "npm"):
        if not shutil.which(program):
            raise Unavailable(f"there is no {program}: deploy/install-packages test")
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        wanted = "".join((HERE / name).read_text() for name in FILES)
        stamp = folder / "installed"
        if stamp.exists() and stamp.read_text() == wanted:
            return folder
        stamp.unlink(missing_ok=True)
        for name in FILES:
            shutil.copy(HERE / name, folder / name)
        result = subprocess.run(["npm", "ci", "--ignore-scripts", "--prefer-offline", "--no-audit", "--no-fund"],
                                cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                                timeout=LIMIT_SECONDS)
        if result.returncode != 0:
            if any(code in result.stderr for code in UNREACHABLE):
                raise Unavailable("npm cannot reach its registry")
            raise RuntimeError(f"npm ci failed: {result.stderr}")
        stamp.write_text(wanted)
    return folder

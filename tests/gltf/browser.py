"""Has headless Chromium draw a .glb with three.js: the page, its packages and the scene come from a server of our own."""
import contextlib
import http.server
import os
import pathlib
import queue
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import urllib.parse

HERE = pathlib.Path(__file__).parent
PAGES = {"/view.html": "text/html", "/view.js": "text/javascript", "/moz_lightmap.js": "text/javascript"}
LIMIT_SECONDS = 240


def find_chromium():
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def handler_for(scene, packages, answers):
    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            path = urllib.parse.urlsplit(self.path).path
            if path in PAGES:
                file, kind = HERE / path[1:], PAGES[path]
            elif path == "/scene.glb":
                file, kind = scene, "model/gltf-binary"
            elif path.startswith("/node_modules/three/") and path.endswith(".js") and ".." not in path:
                file, kind = packages / path[1:], "text/javascript"
            else:
                return self.send_error(404)
            data = pathlib.Path(file).read_bytes()
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        def do_POST(self):
            answers.put((self.path, self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            pass
    return Handler


def wait_for_answer(answers, browser):
    """Raises queue.Empty after the limit, or when the browser has ended without an answer."""
    end = time.monotonic() + LIMIT_SECONDS
    while True:
        try:
            return answers.get(timeout=1)
        except queue.Empty:
            if browser.poll() is not None or time.monotonic() > end:
                raise


def draw(scene, packages, **view):
    """A PNG's bytes. `view`: the parameters of view.js. WebGL runs on the CPU: any machine draws the same."""
    answers = queue.Queue()
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler_for(scene, packages, answers))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}/view.html?{urllib.parse.urlencode(view, safe=',')}"
    with tempfile.TemporaryDirectory(prefix="radbake-browser-", ignore_cleanup_errors=True) as profile:
        options = ["--headless=new", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                   "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
                   "--disable-dev-shm-usage", "--hide-scrollbars", f"--user-data-dir={profile}"]
        if os.geteuid() == 0:
            options.append("--no-sandbox")  # Chromium refuses to sandbox root
        # A session of its own: the browser is many processes, and they end together.
        with open(pathlib.Path(profile) / "log", "w+") as log:
            browser = subprocess.Popen([find_chromium(), *options, address], stdin=subprocess.DEVNULL, stdout=log,
                                       stderr=subprocess.STDOUT, start_new_session=True, env={**os.environ, "HOME": profile})
            try:
                kind, body = wait_for_answer(answers, browser)
            except queue.Empty:
                log.seek(0)
                raise RuntimeError(f"the browser drew nothing: {log.read()[-4000:]}") from None
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(browser.pid, signal.SIGKILL)
                browser.wait()
                server.shutdown()
                server.server_close()
    if kind != "/picture":
        raise RuntimeError(f"the page failed: {body.decode(errors='replace')}")
    return body

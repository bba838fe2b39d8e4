#!/usr/bin/env python3
"""Holds the files of deploy/ against the program.

  deploy_test.py BIN_FOLDER SUITE
"""
import contextlib
import hashlib
import json
import pathlib
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import yaml

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DEPLOY = ROOT / "deploy"
RADBAKED = pathlib.Path()
EXIT_SKIPPED = 77
# systemd's own measure, 0 to 100: a unit that says nothing has 96.
MAX_EXPOSURE = 20
# For what must not hang.
CALL_SECONDS = 240

KEY_LINE = re.compile(r"^(# )?([a-z-]+)=(.*)$", re.M)
METRIC = re.compile(r"\bradbake_[a-z_]+\b")


def run(*arguments):
    return subprocess.run([RADBAKED, *arguments], capture_output=True, text=True, timeout=20)


def metrics_of_the_program():
    return set(re.findall(r'"(radbake_[a-z_]+)"', (ROOT / "server/service/metrics.cpp").read_text()))


def metrics_in(text):
    """Names of metrics; of a histogram's parts the histogram's."""
    return {re.sub(r"(?<=_seconds)_(bucket|sum|count)$", "", name) for name in METRIC.findall(text)}


class Files(unittest.TestCase):
    def print_config(self, text):
        with tempfile.NamedTemporaryFile("w", suffix=".conf") as file:
            file.write(text)
            file.flush()
            return run("--config", file.name, "--print-config")

    def test_the_example_configuration_has_every_key_once_and_in_order(self):
        example = (DEPLOY / "radbaked.conf").read_text()
        keys = [key for _, key, _ in KEY_LINE.findall(example)]
        self.assertEqual(keys, [key for _, key, _ in KEY_LINE.findall(run("--print-config").stdout)])
        self.assertGreater(len(keys), 20)

    def test_the_example_configuration_tells_the_defaults_and_what_they_are_for(self):
        example = (DEPLOY / "radbaked.conf").read_text()
        printed = run("--print-config").stdout
        defaults = {key: value for _, key, value in KEY_LINE.findall(printed)}
        for is_comment, key, value in KEY_LINE.findall(example):
            if is_comment:
                self.assertEqual(value, defaults[key], key)
        # The words above each key are the program's own.
        words = [line for line in printed.splitlines() if line.startswith("# ") and not KEY_LINE.match(line)]
        for line in words:
            self.assertIn(line, example)

    def test_the_example_configuration_is_accepted_also_with_every_comment_taken_off(self):
        example = (DEPLOY / "radbaked.conf").read_text()
        self.assertEqual(self.print_config(example).returncode, 0)
        bare = "".join(f"{key}={value}\n" for _, key, value in KEY_LINE.findall(example) if value)
        accepted = self.print_config(bare)
        self.assertEqual(accepted.returncode, 0, accepted.stderr)

    def test_what_watches_names_metrics_that_there_are(self):
        known = metrics_of_the_program()
        self.assertGreater(len(known), 20)
        for name in ["prometheus/alerts.yaml", "prometheus/dashboard.json", "docs/operations.md"]:
            self.assertLessEqual(metrics_in((DEPLOY / name).read_text()), known, name)

    def test_the_page_on_operations_explains_every_metric_key_and_alert(self):
        page = (DEPLOY / "docs/operations.md").read_text()
        self.assertEqual(metrics_in(page), metrics_of_the_program())
        alerts = yaml.safe_load((DEPLOY / "prometheus/alerts.yaml").read_text())
        names = [rule["alert"] for group in alerts["groups"] for rule in group["rules"]]
        self.assertEqual(re.findall(r"^\| `(Radbake\w+)` \|", page, re.M), names)
        limits = [key for _, key, _ in KEY_LINE.findall(run("--print-config").stdout) if key.startswith(("max-", "min-"))]
        for key in limits + ["chunk-bytes", "admin-listen", "admin-open", "drain-grace", "log-json", "log-level"]:
            self.assertIn(f"`{key}", page)

    def test_alerts_have_what_prometheus_asks_for(self):
        alerts = yaml.safe_load((DEPLOY / "prometheus/alerts.yaml").read_text())
        for group in alerts["groups"]:
            for rule in group["rules"]:
                self.assertLessEqual(set(rule), {"alert", "expr", "for", "labels", "annotations"})
                self.assertIn(rule["labels"]["severity"], ["warning", "critical"])
                self.assertTrue(rule["annotations"]["summary"])
                self.assertEqual(rule["expr"].count("("), rule["expr"].count(")"), rule["alert"])

    def test_the_dashboard_draws_something_in_each_panel(self):
        dashboard = json.loads((DEPLOY / "prometheus/dashboard.json").read_text())
        self.assertEqual(len({panel["id"] for panel in dashboard["panels"]}), len(dashboard["panels"]))
        for panel in dashboard["panels"]:
            for target in panel["targets"]:
                self.assertTrue(METRIC.search(target["expr"]), panel["title"])
                self.assertEqual(target["expr"].count("("), target["expr"].count(")"), panel["title"])

    def test_compose_starts_the_server_with_options_that_it_has(self):
        service = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]["radbaked"]
        checked = run(*service["command"], "--print-config")
        self.assertEqual(checked.returncode, 0, checked.stderr)
        keys = {key: value for _, key, value in KEY_LINE.findall(checked.stdout)}
        self.assertEqual(keys["admin-listen"], "0.0.0.0:7420")
        for port in service["ports"]:
            self.assertTrue(port.startswith("127.0.0.1:"), port)
        self.assertGreater(int(service["stop_grace_period"].rstrip("s")), float(keys["drain-grace"]))


class Systemd(unittest.TestCase):
    def test_the_unit_is_found_good_by_systemd(self):
        unit = (DEPLOY / "systemd/radbaked.service").read_text()
        start = "ExecStart=/opt/radbake/bin/radbaked "
        self.assertIn(start, unit)
        with tempfile.TemporaryDirectory() as folder:
            # It looks for the program.
            path = pathlib.Path(folder) / "radbaked.service"
            path.write_text(unit.replace(start, f"ExecStart={RADBAKED} "))
            verified = subprocess.run(["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", path],
                                      capture_output=True, text=True, timeout=50)
            about_it = [line for line in verified.stderr.splitlines() if "radbaked.service" in line]
            self.assertEqual(about_it, [])
            self.assertEqual(verified.returncode, 0, verified.stderr)
            # And it does find what is wrong.
            path.write_text(path.read_text().replace("Type=notify", "Type=notifies"))
            wrong = subprocess.run(["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", path],
                                   capture_output=True, text=True, timeout=50)
            self.assertIn("notifies", wrong.stderr)

    def test_the_unit_leaves_the_server_little_that_it_could_do_to_the_machine(self):
        rated = subprocess.run(["systemd-analyze", "security", "--offline=true", f"--threshold={MAX_EXPOSURE}",
                                DEPLOY / "systemd/radbaked.service"], capture_output=True, text=True, timeout=50)
        self.assertEqual(rated.returncode, 0, rated.stdout + rated.stderr)

    def test_the_unit_waits_longer_than_the_server_may_take_to_stop(self):
        unit = (DEPLOY / "systemd/radbaked.service").read_text()
        grace = float(dict((k, v) for _, k, v in KEY_LINE.findall(run("--print-config").stdout))["drain-grace"])
        self.assertGreater(int(re.search(r"^TimeoutStopSec=(\d+)$", unit, re.M)[1]), grace)


class Backup(unittest.TestCase):
    def start(self, place, data):
        server = subprocess.Popen([RADBAKED, "--listen", f"unix:{place}/socket", "--data", data],
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(server.stdout.close)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        self.assertIn("listening on", server.stdout.readline())
        return server

    def run_radbake(self, place, *arguments):
        done = subprocess.run([RADBAKED.parent / "radbake", *map(str, arguments), "--server", f"unix:{place}/socket"],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=CALL_SECONDS)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_a_backup_of_a_running_server_is_restored_as_the_page_says(self):
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder)
            server = self.start(place, place / "data")
            scene = ROOT / "tests/scenes/cornell.glb"
            name = self.run_radbake(place, "submit", scene, "-o", place / "first", "--atlas-size", 64, "--rays", 16,
                                    "--max-patches", 300).splitlines()[0]
            # First the database, by SQLite's own backup, then the content.
            (place / "backup").mkdir()
            with contextlib.closing(sqlite3.connect(place / "data/jobs.sqlite")) as source, \
                    contextlib.closing(sqlite3.connect(place / "backup/jobs.sqlite")) as copy:
                source.backup(copy)
            shutil.copytree(place / "data/content/objects", place / "backup/content/objects")
            server.kill()
            server.wait()
            shutil.rmtree(place / "data")

            self.start(place, place / "backup")
            self.run_radbake(place, "download", name, "-o", place / "second")
            maps = [(place / run / "lightmap_0.exr").read_bytes() for run in ("first", "second")]
            self.assertEqual(maps[0], maps[1])
            for blob in (place / "backup/content/objects").rglob("*"):
                if blob.is_file():
                    self.assertEqual(hashlib.sha256(blob.read_bytes()).hexdigest(), blob.name)


def main():
    global RADBAKED
    RADBAKED = pathlib.Path(sys.argv[1]) / "radbaked"
    suite = sys.argv[2]
    if suite == "Systemd" and not shutil.which("systemd-analyze"):
        print("skipped: systemd-analyze is not installed")
        return EXIT_SKIPPED
    result = unittest.TextTestRunner(verbosity=2).run(unittest.defaultTestLoader.loadTestsFromTestCase(globals()[suite]))
    return 0 if result.wasSuccessful() and result.testsRun > 0 else 1


if __name__ == "__main__":
    sys.exit(main())

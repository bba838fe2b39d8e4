"""radbake and radbaked over TLS: certificates, tokens, and what the errors say.

  cli_security_test.py BIN_FOLDER SCENES_FOLDER [unittest arguments]
"""
import json
import pathlib
import subprocess
import sys
import unittest

import cli_test
from cli_test import BIN, CORNELL, LIMIT_SECONDS, QUICK

MAKE_CERTIFICATES = pathlib.Path(__file__).parent / "make_certificates"
TOKEN = "a.token.of.acme.which.is.long.enough"


class SecurityTest(cli_test.CliTest):
    def setUp(self):
        super().setUp()
        self.made = self.place / "made"
        self.made.mkdir()
        subprocess.run([MAKE_CERTIFICATES, self.made], check=True, timeout=LIMIT_SECONDS)
        (self.place / "token").write_text(TOKEN + "\n")

    def start_server(self, *arguments):
        """A server at a free port of localhost; its address."""
        with open(self.place / "log", "w") as log:
            server = subprocess.Popen(
                [BIN / "radbaked", "--listen", "localhost:0", "--data", self.place / "data", *arguments],
                env=self.env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log, text=True)
        self.addCleanup(server.stdout.close)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        return server.stdout.readline().split()[-1]

    def serve_tls(self, *arguments):
        return self.start_server("--tls-cert", self.made / "server.pem", "--tls-key", self.made / "server.key", *arguments)

    def serve_tokens(self):
        hashed = subprocess.run([BIN / "radbaked", "--hash-token"], input=TOKEN + "\n", capture_output=True, text=True,
                                timeout=LIMIT_SECONDS)
        self.assertEqual(hashed.returncode, 0, hashed.stderr)
        (self.place / "tokens").write_text(f"{hashed.stdout.strip()} acme submit\n")
        return self.serve_tls("--tokens", self.place / "tokens")

    def client(self, name):
        return ["--tls-cert", self.made / f"{name}.pem", "--tls-key", self.made / f"{name}.key"]

    def assert_refused(self, words, *arguments, **environment):
        result = self.run_cli("list", *arguments, **environment)
        self.assert_exit(result, 4)
        self.assertIn(words, result.stderr)
        # One line: not gRPC's log as well.
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)


class Tokens(SecurityTest):
    def test_a_scene_is_baked_over_tls_with_a_token(self):
        server = self.serve_tokens()
        ca = self.made / "ca.pem"
        submitted = self.run_cli("submit", CORNELL, "-o", self.place / "out", *QUICK, "--server", server,
                                 "--tls-ca", ca, "--token-file", self.place / "token")
        self.assert_exit(submitted, 0)
        self.assertTrue((self.place / "out" / "scene.glb").exists())
        # The same from the environment.
        listed = self.run_cli("list", "--json", RADBAKE_SERVER=server, RADBAKE_TLS_CA=str(ca), RADBAKE_TOKEN=TOKEN)
        self.assert_exit(listed, 0)
        self.assertEqual([bake["name"] for bake in json.loads(listed.stdout)["bakes"]],
                         [submitted.stdout.splitlines()[0]])

    def test_the_error_says_what_is_wrong(self):
        server = self.serve_tokens()
        ca = ["--tls-ca", self.made / "ca.pem"]
        self.assert_refused("asks for a token", "--server", server, *ca)
        self.assert_refused("not one that this server accepts", "--server", server, *ca, RADBAKE_TOKEN=TOKEN + "x")
        self.assert_refused("--tls-ca", "--server", server)
        self.assert_refused("is not trusted", "--server", server, "--tls-ca", self.made / "other-ca.pem")

    def test_a_token_is_not_sent_readable_for_others(self):
        result = self.run_cli("list", "--server", "bakery.example:7419", "--token-file", self.place / "token")
        self.assert_exit(result, 2)
        self.assertIn("without TLS", result.stderr)
        self.assertNotIn(TOKEN, result.stderr)

    def test_tls_options_that_are_no_good_are_usage_errors_that_name_their_file(self):
        (self.place / "no.pem").write_text("no certificate\n")
        ca = self.made / "ca.pem"
        for name, arguments in (
                ("tmp", ["--tls-ca", self.place / "tmp"]),
                ("no.pem", ["--tls-ca", self.place / "no.pem"]),
                ("nowhere", ["--tls-ca", self.place / "nowhere"]),
                ("tmp", ["--tls-ca", ca, "--tls-cert", self.place / "tmp", "--tls-key", self.made / "alice.key"]),
                ("tmp", ["--tls-ca", ca, "--tls-cert", self.made / "alice.pem", "--tls-key", self.place / "tmp"]),
                ("--tls-key", ["--tls-ca", ca, "--tls-cert", self.made / "alice.pem"]),
                ("tmp", ["--token-file", self.place / "tmp"])):
            with self.subTest(arguments=arguments):
                result = self.run_cli("list", "--server", "localhost:1", *arguments)
                self.assert_exit(result, 2)
                self.assertIn(name, result.stderr)

    def test_a_token_file_without_a_token_is_a_bad_option(self):
        (self.place / "token").write_text("two words\n")
        result = self.run_cli("list", "--server", "localhost:1", "--token-file", self.place / "token")
        self.assert_exit(result, 2)
        self.assertIn("--token-file", result.stderr)

    def test_a_token_that_can_be_guessed_is_not_hashed(self):
        hashed = subprocess.run([BIN / "radbaked", "--hash-token"], input="secret\n", capture_output=True, text=True,
                                timeout=LIMIT_SECONDS)
        self.assertEqual(hashed.returncode, 2)
        self.assertEqual(hashed.stdout, "")
        self.assertIn("32", hashed.stderr)


class Certificates(SecurityTest):
    def test_a_certificate_says_who_calls_and_its_error_what_is_wrong(self):
        server = ["--server", self.serve_tls("--tls-client-ca", self.made / "ca.pem"), "--tls-ca", self.made / "ca.pem"]
        self.assert_exit(self.run_cli("list", *server, *self.client("alice")), 0)
        self.assert_refused("asks for a client's certificate", *server)
        self.assert_refused("does not accept --tls-cert", *server, *self.client("stranger"))
        self.assert_refused("does not accept --tls-cert", *server, *self.client("expired"))
        self.assert_refused("is not the key of", *server, "--tls-cert", self.made / "alice.pem", "--tls-key",
                            self.made / "admin.key")
        self.assert_refused("names no tenant", *server, *self.client("nameless"))

    def test_a_server_without_tls_is_named_as_such(self):
        self.assert_refused("does not speak TLS", "--server", self.start_server(), "--tls-ca", self.made / "ca.pem")

    def test_a_server_that_others_can_reach_does_not_start_without_knowing_them(self):
        started = subprocess.run([BIN / "radbaked", "--listen", "0.0.0.0:0", "--data", self.place / "data"],
                                 capture_output=True, text=True, timeout=LIMIT_SECONDS)
        self.assertNotEqual(started.returncode, 0)
        self.assertIn("--listen 0.0.0.0:0", started.stderr)
        self.assertIn("--tls-cert", started.stderr)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)

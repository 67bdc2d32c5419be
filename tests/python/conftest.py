"""Fixtures: the nightglass binary, and scenes run into temporary directories.

The binary is $NIGHTGLASS_BIN, else target/release/nightglass.
"""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def execute():
    """Call as execute(exit code expected, "plan", scene, ...): the finished process."""
    binary = Path(os.environ.get("NIGHTGLASS_BIN", ROOT / "target" / "release" / "nightglass"))
    if not binary.is_file():
        pytest.fail(f"{binary} does not exist: cargo build --release, or set NIGHTGLASS_BIN")

    def call(code, *arguments):
        command = [str(binary.resolve()), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=150)
        assert (
            done.returncode == code
        ), f"{' '.join(command)}\nexit {done.returncode}\n{done.stderr}"
        return done

    return call


@pytest.fixture(scope="session")
def nightglass(execute):
    """Call as nightglass("plan", scene, ...): runs the binary, returns its standard output."""
    return lambda *arguments: execute(0, *arguments).stdout


@pytest.fixture(scope="session")
def refused(execute):
    """Call as refused("plan", scene, ...): what the binary says to bad input, exit code 2."""

    def call(*arguments):
        done = execute(2, *arguments)
        assert done.stdout == ""
        return done.stderr

    return call


@pytest.fixture(scope="session")
def produce(nightglass, tmp_path_factory):
    """Call as produce("render", scene_text, ...): the output directory of that command."""

    def call(command, scene_text, *options):
        base = tmp_path_factory.mktemp(command)
        scene = base / "scene.toml"
        scene.write_text(scene_text)
        nightglass(command, scene, "-o", base / "out", "-q", *options)
        return base / "out"

    return call


def pytest_terminal_summary(terminalreporter):
    """The figures behind the passes: what the tests printed."""
    lines = [
        line
        for report in terminalreporter.getreports("passed")
        if report.when == "call"
        for line in report.capstdout.splitlines()
    ]
    if lines:
        terminalreporter.section("figures")
        for line in dict.fromkeys(lines):
            terminalreporter.write_line(line)

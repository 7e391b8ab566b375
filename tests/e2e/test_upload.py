"""Bundles, simulations and the demo over a real server's HTTP, as processes that meet nowhere else."""

from __future__ import annotations

import csv
import io
import random
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import numpy as np
import pytest

from pondwatch.simulator.bundle import write_bundle
from pondwatch.simulator.simulation import Simulation
from pondwatch.simulator.spec import SimulationSpec

MAIN = (sys.executable, "-c", "from pondwatch.cli import main; main()")
SPEC = SimulationSpec(snapshots=36, coverage=6.0, noise_pitch=0.15)


def pondwatch(*arguments):
    return subprocess.run((*MAIN, *map(str, arguments)), capture_output=True, text=True, timeout=90, check=False)


@contextmanager
def running(*arguments) -> Iterator[str]:
    """A server process; its address, once it listens."""
    process = subprocess.Popen((*MAIN, *map(str, arguments)), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        assert process.stdout
        yield re.search(r"http://[\d.]+:\d+", process.stdout.readline().decode()).group()
    finally:
        process.terminate()
        process.communicate(timeout=30)


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with running("serve", "--data", tmp_path_factory.mktemp("data"), "--port", 0) as url:
        yield url


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundles") / "pond"
    write_bundle(Simulation(SPEC, 3), folder)
    header, *rows = (folder / "poses.csv").read_text().splitlines()
    random.Random(1).shuffle(rows)
    (folder / "poses.csv").write_text("\n".join([header, *rows]) + "\n")
    return folder


def session_of(done):
    assert done.returncode == 0, done.stderr
    return re.match(r"session (\S+)", done.stdout).group(1)


def get(server, path):
    return httpx.get(f"{server}/api/sessions{path}", trust_env=False, timeout=30).raise_for_status()


def counts(server, session):
    return get(server, f"/{session}").json()["counts"]


def table(text):
    return {row["sequence"]: row for row in csv.DictReader(io.StringIO(text))}


def test_an_uploaded_bundle_ends_with_the_poses_and_rods_of_a_corrected_one(server, bundle, tmp_path):
    done = pondwatch("upload", bundle, "--url", server)
    session = session_of(done)
    offline = pondwatch("correct", bundle, "--out", tmp_path / "result")

    assert done.stdout.endswith("36 stored, 0 there before, 0 refused\nfinished\n")
    assert offline.returncode == 0
    uploaded = table(get(server, f"/{session}/poses?format=csv").text)
    corrected = table((tmp_path / "result/poses.csv").read_text())
    assert uploaded.keys() == corrected.keys()
    for name, tolerance in (("x_m", 0.01 * 0.0005625), ("y_m", 0.01 * 0.0005625), ("theta_rad", 1e-4)):
        a, b = ([float(rows[n][name] or "nan") for n in sorted(rows)] for rows in (uploaded, corrected))
        np.testing.assert_allclose(a, b, atol=tolerance)
    assert get(server, f"/{session}/rods?format=csv").text == (tmp_path / "result/rods.csv").read_text()


def test_an_upload_killed_half_way_goes_on_where_it_was(server, bundle):
    process = subprocess.Popen(
        (*MAIN, "upload", str(bundle), "--url", server, "--rate", "15"), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout
    session = process.stdout.readline().decode().split()[1]
    while not counts(server, session)["snapshots"] > 5:
        time.sleep(0.05)
    process.kill()
    process.communicate()
    before = counts(server, session)["snapshots"]

    again = pondwatch("upload", bundle, "--url", server, "--session", session)

    stored, repeated = map(int, re.search(r"(\d+) stored, (\d+) there before, 0 refused", again.stdout).groups())
    assert 5 < before < 36
    assert stored + repeated == 36
    assert repeated >= before
    assert counts(server, session)["snapshots"] == 36


def test_an_upload_to_a_session_that_is_not_there_ends_with_one_line(server, bundle):
    done = pondwatch("upload", bundle, "--url", server, "--session", "none")

    assert done.returncode == 2
    assert done.stderr.startswith("pondwatch: The server refused (404)")
    assert done.stderr.count("\n") == 1


def test_a_simulation_through_a_bad_radio_is_stored_whole_and_once(server):
    options = ("--set", "broken=0.3", "--set", "twice=0.2", "--set", "delay_s=0.5", "--set", "loss=0.1")

    done = pondwatch("simulate", "--url", server, "--snapshots", 30, "--rate", 0, "--no-finish", *options)
    session = session_of(done)

    stored, repeated, refused = map(int, re.search(r"(\d+) stored, (\d+) there.* (\d+) refused", done.stdout).groups())
    assert stored == 30
    assert repeated > 0
    assert refused > 0
    assert done.stderr.count("refused (") == refused
    assert counts(server, session)["snapshots"] == 30


def test_a_simulated_bundle_is_what_the_simulator_gives_by_seed(tmp_path):
    done = pondwatch("simulate", "--out", tmp_path / "pond", "--seed", 5, "--snapshots", 6, "--path", "uniform")

    assert done.returncode == 0
    again = Simulation(SimulationSpec(snapshots=6), 5)
    assert (tmp_path / "pond/snapshots/000004.jpg").read_bytes() == again.snapshot(4).content
    assert (tmp_path / "pond/truth_poses.csv").exists()


@pytest.mark.parametrize("arguments", [(), ("--url", "http://x", "--out", "y"), ("--out", "y", "--lattice", "round")])
def test_a_simulation_that_makes_no_sense_ends_with_one_line(arguments):
    done = pondwatch("simulate", *arguments)

    assert done.returncode == 2
    assert done.stderr.count("\n") == 1


def test_a_demo_grows_and_goes_on_after_a_restart_as_the_same_inspection(tmp_path):
    def grown(url, least):
        until = time.monotonic() + 40
        while time.monotonic() < until:
            sessions = get(url, "").json()["sessions"]
            if sessions and sessions[0]["counts"]["snapshots"] >= least:
                return [session["name"] for session in sessions]
            time.sleep(0.1)
        raise AssertionError("the demo does not grow")

    demo = ("demo", "--data", tmp_path, "--port", 0, "--snapshots", 120, "--rate", 20)
    with running(*demo) as url:
        first = grown(url, 5)
    with running(*demo) as url:
        assert first == grown(url, 30) == ["Demo inspection 1"]


def test_a_demo_that_is_told_to_stop_leaves_no_robots_behind(tmp_path):
    with running("demo", "--data", tmp_path, "--port", 0, "--snapshots", 400, "--rate", 5) as url:
        until = time.monotonic() + 40
        while not get(url, "").json()["sessions"] and time.monotonic() < until:
            time.sleep(0.1)
        while url not in processes() and time.monotonic() < until:  # the robots' own command names the address
            time.sleep(0.1)
        assert url in processes()

    assert url not in processes()


def processes():
    return subprocess.run(["ps", "-eww", "-o", "args"], capture_output=True, text=True, check=True).stdout

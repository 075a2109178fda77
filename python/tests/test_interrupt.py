"""Ctrl-C ends a call at once."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

CALLS = {
    "simulate": "scram.simulate(robot, seconds=600)",
    "simulate_batch": "scram.simulate_batch(robot, seeds=range(5000), seconds=20)",
    "identify_robot": "scram.identify_robot(robot, columns, draws=5000)",
}

PROGRAM = """
import signal
import scram
# Ctrl-C is ignored in what a shell starts in the background, and these tests may be.
signal.signal(signal.SIGINT, signal.default_int_handler)
robot = scram.Robot("robot.toml")
columns = {
    "f_hz": [6, 7, 8, 6, 7, 8, 6, 7, 8],
    "alpha_deg": [60, 60, 60, 90, 90, 90, 120, 120, 120],
    **{name: [1.0] * 9 for name in ("vx_mm_per_s", "vy_mm_per_s", "yaw_deg_per_s")},
}
print("begins", flush=True)
try:
    CALL
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


@pytest.mark.parametrize("name", CALLS)
def test_an_interrupt_is_raised_at_once(root: Path, name: str) -> None:
    program = PROGRAM.replace("CALL", CALLS[name])
    process = subprocess.Popen([sys.executable, "-c", program], cwd=root, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begins\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    try:
        assert process.stdout.readline() == "interrupted\n"
        # Far above what it takes, far below what the call would.
        assert time.monotonic() - sent < 5.0
        assert process.wait(timeout=20) == 0
    finally:
        process.kill()


def test_other_threads_run_meanwhile(root: Path) -> None:
    import threading

    import scram

    robot = scram.Robot(root / "robot.toml")
    done = threading.Event()

    def work() -> None:
        scram.simulate(robot, seconds=2.0)
        done.set()

    thread = threading.Thread(target=work)
    thread.start()
    counted = 0
    while not done.is_set():
        counted += 1
        time.sleep(1e-3)
    thread.join()
    assert counted > 5, "Python went on while the engine worked"

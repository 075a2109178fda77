"""Ctrl-C ends a call at once, and no call keeps other threads waiting."""

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import scram
from scram._scram import Sweep


class Call(NamedTuple):
    """A call that takes longer than anybody waits here."""

    call: str
    before: str = ""
    told: bool = True
    """Whether the work ends where it is, too; else it goes on to its end."""


CALLS = {
    "simulate": Call("scram.simulate(robot, seconds=600)"),
    "simulate_batch": Call("scram.simulate_batch(robot, seeds=range(20_000), seconds=2)"),
    "diagnose": Call("scram.diagnose(rig, runs[:-1], runs[-1:])"),
    "diagnose_walk": Call("scram.diagnose_walk(robot, columns, draws=5000)"),
    "identify_motor": Call("scram.identify_motor(rig, runs[:-1], runs[-1:])"),
    "identify_backbone": Call("scram.identify_backbone(robot, releases)"),
    "identify_robot": Call("scram.identify_robot(robot, columns, draws=5000)"),
    "identify_potentiometer": Call(
        "scram.identify_potentiometer(robot, run)", "run = scram.simulate(robot, 'duty:1', 600, bench=True)", told=False
    ),
    "make_vec": Call("scram.envs.TurnVectorEnv(4000, randomize=1.0)", told=False),
    "reset": Call("envs.reset(seed=1)", "envs = scram.envs.TurnVectorEnv(600, randomize=1.0)", told=False),
    "step": Call(
        "envs.step(np.zeros(8, dtype=int))",
        "envs = scram.envs.TurnVectorEnv(8, interval_s=400.0, episode_s=800.0); envs.reset(seed=1)",
        told=False,
    ),
    "Sweep": Call("Sweep(many)", told=False),
    "Sweep.groups": Call("worker.groups()", "worker = Sweep(many, 'robot.toml')", told=False),
    "Sweep.rows": Call("worker.rows(range(8))", "worker = Sweep([*many, '--seconds', '60'], 'robot.toml')", told=False),
}

PROGRAM = """
import signal
import sys
import time
from pathlib import Path
import numpy as np
import scram
import scram.envs
from scram._scram import Sweep
# Ctrl-C is ignored in what a shell starts in the background, and these tests may be.
signal.signal(signal.SIGINT, signal.default_int_handler)
robot = scram.Robot("robot.toml")
columns = {
    "f_hz": [6, 7, 8, 6, 7, 8, 6, 7, 8],
    "alpha_deg": [60, 60, 60, 90, 90, 90, 120, 120, 120],
    **{name: [1.0] * 9 for name in ("vx_mm_per_s", "vy_mm_per_s", "yaw_deg_per_s")},
}
rig = scram.Robot("examples/hidden-effect/robot.toml")
runs = sorted(Path("examples/hidden-effect").glob("*.csv"))
releases = sorted(Path("examples/backbone").glob("release-*.csv"))
many = ["--axis", "ground.friction=0.5:1.0:2000", "--repeats", "1"]
BEFORE
print("begins", flush=True)
try:
    CALL
except KeyboardInterrupt:
    print("interrupted", flush=True)
def works():
    used = time.process_time()
    time.sleep(0.2)
    return time.process_time() - used > 0.05
while TOLD and works():
    pass
print("ended", flush=True)
"""


@pytest.mark.parametrize("name", CALLS)
def test_an_interrupt_is_raised_at_once(root: Path, name: str) -> None:
    call, before, told = CALLS[name]
    program = PROGRAM.replace("BEFORE", before).replace("CALL", call).replace("TOLD", str(told))
    process = subprocess.Popen([sys.executable, "-c", program], cwd=root, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begins\n"
    time.sleep(0.7)
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    try:
        assert process.stdout.readline() == "interrupted\n"
        # Far above what it takes, far below what the call would.
        assert time.monotonic() - sent < 3.0
        assert process.stdout.readline() == "ended\n"
        assert time.monotonic() - sent < 8.0
        assert process.wait(timeout=20) == 0
    finally:
        process.kill()


def table(file: Path, header: str, row: str) -> Path:
    file.write_text(header + "\n" + "".join(row.replace("K", str(k)) + "\n" for k in range(300_000)))
    return file


def simulated(root: Path, _: Path) -> Callable[[], object]:
    robot = scram.Robot(root / "robot.toml")
    return lambda: scram.simulate(robot, seconds=4.0)


def table_of_speeds(root: Path, place: Path) -> Callable[[], object]:
    file = table(place / "speeds.csv", "f_hz,alpha_deg,vx_mm_per_s,vy_mm_per_s,yaw_deg_per_s", "7,60,1,1,1")
    robot = scram.Robot(root / "robot.toml")
    return lambda: pytest.raises(scram.InputError, scram.identify_robot, robot, file, holdout=[(1, 1)])


def capture(_: Path, place: Path) -> Callable[[], object]:
    file = table(place / "capture.csv", "t_s,x_mm,y_mm,yaw_deg", "K,K,0,30")
    return lambda: scram.captured_speeds(file)


def release(root: Path, place: Path) -> Callable[[], object]:
    file = table(place / "release.csv", "t_s,angle_z_rad", "K,0")
    robot = scram.Robot(root / "robot.toml")
    return lambda: pytest.raises(scram.InputError, scram.identify_backbone, robot, [file], body="nobody")


def columns(_: Path, __: Path) -> Callable[[], object]:
    t_s = np.arange(6_000_000) * 1e-3
    given = {"t_s": t_s, "duty": np.full_like(t_s, 0.5), "angle_rad": t_s}
    return lambda: scram.Recording(given)


def groups(_: Path, __: Path) -> Callable[[], object]:
    worker = Sweep(["--axis", "ground.friction=0.5:1.0:200", "--repeats", "1"], "robot.toml")
    return worker.groups


def with_every_row(options: list[str]) -> Sweep:
    """A sweep whose rows are there, all of them the first one's."""
    driver = Sweep(options)
    _, cells, path = driver.rows(driver.open()[0][:1])[0]
    driver.book([(number, cells, path) for number in range(1, driver.total + 1)])
    return driver


def opened(_: Path, place: Path) -> Callable[[], object]:
    """Of a sweep whose rows are all there, and read again."""
    options = ["--axis", "ground.friction=0.5:1.0:30", "--repeats", "10000", "--seconds", "0.1", "--out", str(place)]
    with_every_row(options)
    return Sweep(options).open


@pytest.mark.parametrize("made", [simulated, table_of_speeds, capture, release, columns, groups, opened])
def test_other_threads_run_meanwhile(
    made: Callable[[Path, Path], Callable[[], object]], root: Path, tmp_path: Path
) -> None:
    call = made(root, tmp_path)
    took: list[float] = []

    def work() -> None:
        began = time.perf_counter()
        call()
        took.append(time.perf_counter() - began)

    thread = threading.Thread(target=work)
    ticks = [time.perf_counter()]
    thread.start()
    while thread.is_alive():
        time.sleep(1e-3)
        ticks.append(time.perf_counter())
    thread.join()
    longest = max(later - earlier for earlier, later in zip(ticks, ticks[1:], strict=False))
    assert took and longest < 0.5 * took[0], f"nobody else ran for {longest:.3f} s of {took}"


def test_an_interrupted_sweep_stays_locked_while_it_writes(root: Path, tmp_path: Path) -> None:
    """Its thread goes on, and no other sweep may come between."""
    options = ["--axis", "ground.friction=0.5:1.0:30", "--repeats", "10000", "--seconds", "0.1", "--out", str(tmp_path)]
    driver, other = with_every_row(options), Sweep(options)

    class Alarm(Exception):
        pass

    def ring(*_: object) -> None:
        raise Alarm

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, 0.05)
    try:
        with pytest.raises(Alarm):
            driver.finish()
    finally:
        signal.signal(signal.SIGALRM, before)
    with pytest.raises(scram.ScramError, match="a sweep is running in"):
        other.open()
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        try:
            assert other.open() == []
            break
        except scram.ScramError:
            time.sleep(0.05)
    assert (tmp_path / "sweep.csv").read_bytes().count(b"\n") == other.total + 1

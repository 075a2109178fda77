"""Sweeps and commands on a cluster: what one machine makes, whatever dies meanwhile."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from conftest import peer

import scram
from scram import cluster
from scram._scram import Sweep
from scram.cluster.__main__ import main

#: Conditions and length such that a sweep is long enough to kill something in the middle of it.
OPTIONS = ["--axis", "ground.friction=0.5:1.0:6", "--axis", "f=-8,-7,7,8", "--seconds", "0.5", "--repeats", "8"]
RUNS = 6 * 4 * 8


@pytest.fixture(scope="module")
def swept(command: str, root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of the same sweep by the command."""
    out = tmp_path_factory.mktemp("command")
    subprocess.run([command, "sweep", *OPTIONS, "--out", str(out)], cwd=root, check=True, capture_output=True)
    return out


def test_rows_made_in_any_order_are_the_commands(swept: Path, tmp_path: Path) -> None:
    driver = Sweep([*OPTIONS, "--out", str(tmp_path)])
    task = cluster.task_of(driver, [*OPTIONS, "--out", str(tmp_path)])
    pending = driver.open()
    assert sum(map(len, pending)) == driver.total == RUNS
    rows, seconds = cluster.make_rows(task, pending[::-1])
    assert seconds > 0.0
    driver.book(rows)
    assert [file.name for file in map(Path, driver.finish())] == ["sweep.csv"]
    for name in ("sweep.csv", "sweep.toml"):
        assert (tmp_path / name).read_bytes() == (swept / name).read_bytes(), name


def test_paths_are_kept_where_the_command_keeps_them(command: str, root: Path, tmp_path: Path) -> None:
    options = ["--axis", "alpha=0,90", "--axis", "f=7", "--seconds", "0.2", "--repeats", "2", "--drive", "ideal"]
    one, other = tmp_path / "command", tmp_path / "driver"
    subprocess.run([command, "sweep", *options, "--out", str(one)], cwd=root, check=True, capture_output=True)
    driver = Sweep([*options, "--out", str(other)])
    for group in driver.open():
        driver.book(driver.rows(group))
    driver.finish()
    for name in ("sweep.csv", "sweep_paths.csv", "sweep.toml"):
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


def test_the_command_goes_on_where_a_driver_stopped(command: str, swept: Path, root: Path, tmp_path: Path) -> None:
    driver = Sweep([*OPTIONS, "--out", str(tmp_path)])
    groups = driver.open()
    for group in groups[: len(groups) // 2]:
        driver.book(driver.rows(group))
    done = driver.done
    with pytest.raises(scram.ScramError, match="a sweep is running in"):
        Sweep([*OPTIONS, "--out", str(tmp_path)]).open()
    del driver
    told = subprocess.run(
        [command, "sweep", *OPTIONS, "--out", str(tmp_path)], cwd=root, check=True, capture_output=True, text=True
    )
    assert f"{done} of {RUNS} runs were in" in told.stderr
    assert (tmp_path / "sweep.csv").read_bytes() == (swept / "sweep.csv").read_bytes()


def test_a_worker_that_makes_other_rows_refuses(tmp_path: Path) -> None:
    driver = Sweep([*OPTIONS, "--out", str(tmp_path)])
    task = cluster.task_of(driver, OPTIONS)
    other = cluster.Task(task.arguments, task.files, task.about + "\n# another machine\n")
    with pytest.raises(scram.ScramError, match="this node makes other rows"):
        cluster.make_rows(other, [[0]])


def test_a_robot_file_travels_with_its_base(root: Path, tmp_path: Path) -> None:
    files = [file for file in sorted((root / "robots").glob("*.toml")) if "base = " in file.read_text()]
    based = next(file for file in files if scram.Robot(file).has_body)
    options = ["--robot", str(based), "--axis", "f=7", "--seconds", "0.2", "--repeats", "1", "--out", str(tmp_path)]
    driver = Sweep(options)
    task = cluster.task_of(driver, options)
    assert len(task.files) > 1
    rows, _ = cluster.make_rows(task, driver.open())
    assert len(rows) == 1


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--axis", "ground.frictoin=0.5"], "no such quantity"),
        (["--axis", "f"], "there is no `=`"),
        (["--step", "3e-4"], "--step 0.0003 does not go into"),
        (["--seconds", "0"], "seconds must be a number"),
        (["--robot", "nowhere.toml"], "no such file"),
        (["--search", "5"], "--search"),
    ],
)
def test_wrong_options_say_what_is_wrong(options: list[str], says: str) -> None:
    with pytest.raises(scram.ScramError, match=says):
        Sweep(options)


def test_no_cluster_at_an_address_is_an_error_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ray = peer("ray")

    def init(*_: object, **__: object) -> None:
        raise ConnectionError("Could not find any running Ray instance.")

    monkeypatch.setattr(ray, "init", init)
    assert main(["sweep", "--axis", "f=7", "--seconds", "0.2", "--out", str(tmp_path), "--address", "auto"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: no Ray at `auto`: Could not find any running Ray instance.\n  help: start one with `ray start --head`")


def test_the_recipe_for_an_array_of_jobs(swept: Path, root: Path, tmp_path: Path) -> None:
    recipe = (root / "docs" / "cluster.md").read_text()
    script = tmp_path / "sweep.sbatch"
    script.write_text("#!/bin/sh\n" + recipe.split("```sh\n#!/bin/sh\n")[1].split("```")[0])
    out = tmp_path / "out"
    sweep = " ".join([*OPTIONS, "--out", str(out)])
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"

    def job(part: int) -> None:
        slurm = {"SLURM_ARRAY_TASK_ID": str(part), "SLURM_ARRAY_TASK_COUNT": "3", "SWEEP": sweep, "PATH": path}
        subprocess.run(["sh", str(script)], cwd=root, check=True, capture_output=True, env={**os.environ, **slurm})

    for part in (0, 2):
        job(part)
    with pytest.raises(scram.ScramError, match=f"of {RUNS} runs are in no part"):
        cluster.collect(sweep.split())
    job(1)
    assert main(["collect", *sweep.split()]) == 0
    assert (out / "sweep.csv").read_bytes() == (swept / "sweep.csv").read_bytes()


@pytest.fixture
def on_the_path(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands begin with `scram`."""
    monkeypatch.setenv("PATH", f"{Path(command).parent}{os.pathsep}{os.environ['PATH']}")


@pytest.mark.usefixtures("on_the_path")
def test_commands_are_read_with_what_they_need(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "robot.toml").write_text("[motor]\n")
    lines = tmp_path / "commands"
    lines.write_text("# seeds\nscram sim --robot 'in/robot.toml'\n\nscram sweep --out {out}/one  # the other\n")
    found = cluster.read_commands("commands", ["in"])
    words = ("scram", "sim", "--robot", "in/robot.toml", "--out", "{out}"), ("scram", "sweep", "--out", "{out}/one")
    assert found.lines == words
    assert found.files == (("in/robot.toml", b"[motor]\n"),)
    assert [program for program, _ in found.versions] == ["scram"] and found.versions[0][1].startswith("scram ")
    (tmp_path / "in" / "robot.toml").write_text("[body]\n")
    assert cluster.read_commands("commands", ["in"]).about(0) != found.about(0) != found.about(1)


@pytest.mark.usefixtures("on_the_path")
@pytest.mark.parametrize(
    ("lines", "files", "says"),
    [
        ("", [], "no command"),
        ("scram sim 'half", [], "commands, line 1: No closing quotation"),
        ("scram sim", ["nowhere.toml"], "nowhere.toml: no such file"),
        ("scram sim", ["/etc/hostname"], "is not below the current directory"),
        ("no-such-program sim", [], "no-such-program cannot be run"),
    ],
)
def test_wrong_commands_say_what_is_wrong(
    lines: str, files: list[str], says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "commands").write_text(lines)
    with pytest.raises(scram.ScramError, match=says):
        cluster.read_commands("commands", files)


def test_a_command_without_a_core_is_refused() -> None:
    with pytest.raises(scram.InputError, match="1 core or more, not 0"):
        cluster.read_commands("commands", cores=0)


@pytest.mark.usefixtures("on_the_path")
def test_a_node_with_another_version_refuses(tmp_path: Path) -> None:
    other = cluster.Commands((("scram", "sim"),), (), versions=(("scram", "scram 0.0.0"),))
    with pytest.raises(scram.ScramError, match="install the same version"):
        cluster.run_commands(other, [0])


@pytest.fixture
def two_nodes() -> Iterator[tuple[Any, Any]]:
    """A cluster of two nodes with a core each, and the node that is not its head."""
    # Read when Ray is imported: the nodes of a test stay on the loopback interface.
    os.environ.setdefault(cluster.LOOPBACK, "0")
    cluster_utils = peer("ray.cluster_utils")
    loopback = {"node_ip_address": "127.0.0.1", "num_cpus": 1}
    nodes = cluster_utils.Cluster(initialize_head=True, head_node_args={**loopback, "include_dashboard": False})
    try:
        doomed = nodes.add_node(**loopback)
        nodes.wait_for_nodes()
        yield nodes, doomed
    finally:
        nodes.shutdown()


def works_on(node: Any, task: str) -> bool:
    """Whether a node has a task in work: its workers are the raylet's children, and Ray calls a process by its task meanwhile."""
    raylet = node.all_processes["raylet"][0].process.pid
    children = subprocess.run(["ps", "--ppid", str(raylet), "-o", "args="], capture_output=True, text=True, check=False)
    return any(line.startswith(f"ray::{task}") for line in children.stdout.splitlines())


def kill_at_work(nodes: Any, node: Any, task: str) -> None:
    """Kills a node that has a task in work, which dies with it."""
    until(lambda: works_on(node, task))
    nodes.remove_node(node, allow_graceful=False)


def finished(process: "subprocess.Popen[str]", seconds: float) -> str:
    try:
        _, said = process.communicate(timeout=seconds)
    finally:
        process.kill()
    assert process.returncode == 0, said
    return said


def rows_of(table: Path) -> int:
    return max(0, table.read_bytes().count(b"\n") - 1) if table.exists() else 0


def until(condition: Callable[[], bool], seconds: float = 90.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not come to that"
        time.sleep(0.05)


def test_a_node_and_a_driver_die_and_no_row_is_lost(
    two_nodes: tuple[Any, Any], swept: Path, root: Path, tmp_path: Path
) -> None:
    nodes, doomed = two_nodes
    table = tmp_path / "sweep.csv"
    arguments = [sys.executable, "-m", "scram.cluster", "sweep", *OPTIONS, "--address", nodes.address]

    def driver() -> "subprocess.Popen[str]":
        return subprocess.Popen([*arguments, "--out", str(tmp_path)], cwd=root, stderr=subprocess.PIPE, text=True)

    first = driver()
    until(lambda: rows_of(table) >= 16)
    os.kill(first.pid, signal.SIGKILL)
    first.communicate()
    kept = rows_of(table)
    assert 16 <= kept < RUNS
    second = driver()
    until(lambda: rows_of(table) > kept)
    kill_at_work(nodes, doomed, "make_rows")
    assert rows_of(table) < RUNS, "the node died in the middle"
    said = finished(second, 240.0)
    assert f"of {RUNS} runs were there already" in said
    assert table.read_bytes() == (swept / "sweep.csv").read_bytes()


@pytest.mark.usefixtures("on_the_path")
def test_a_node_dies_and_every_command_is_done(
    two_nodes: tuple[Any, Any], command: str, root: Path, tmp_path: Path
) -> None:
    nodes, doomed = two_nodes
    sweep = "sweep --axis f=7 --seconds 0.5 --repeats 200 --seed"
    lines = tmp_path / "commands"
    lines.write_text("".join(f"scram {sweep} {seed}\n" for seed in range(6)) + "scram sweep --axis nothing=7\n")
    out = tmp_path / "out"
    arguments = [sys.executable, "-m", "scram.cluster", "run", str(lines), "--with", "robot.toml", "--out", str(out)]
    first = subprocess.Popen([*arguments, "--address", nodes.address], cwd=root, stderr=subprocess.PIPE, text=True)
    until(lambda: len(list(out.glob("0*"))) >= 2)
    kill_at_work(nodes, doomed, "run_commands")
    _, said = first.communicate(timeout=240.0)
    assert first.returncode == 1 and "1 failed" in said and "0007" in said, said
    assert "no such quantity" in (out / "0007" / "stderr.txt").read_text()
    for seed in range(6):
        alone = tmp_path / str(seed)
        subprocess.run([command, *sweep.split(), str(seed), "--out", str(alone)], cwd=root, check=True, capture_output=True)
        assert (out / f"{seed + 1:04}" / "sweep.csv").read_bytes() == (alone / "sweep.csv").read_bytes()
    # What is there is not done again; what failed is.
    before = (out / "0001" / "done.json").stat().st_mtime_ns
    again = subprocess.run(arguments, cwd=root, capture_output=True, text=True, check=False)
    assert again.returncode == 1 and "6 of 7 commands were done already" in again.stderr, again.stderr
    assert (out / "0001" / "done.json").stat().st_mtime_ns == before


@pytest.mark.usefixtures("on_the_path")
def test_a_command_that_fits_on_no_node_is_refused(two_nodes: tuple[Any, Any], root: Path, tmp_path: Path) -> None:
    nodes, _ = two_nodes
    lines = tmp_path / "commands"
    lines.write_text("scram sweep --axis f=7 --seconds 0.1 --repeats 1\n")
    arguments = [sys.executable, "-m", "scram.cluster", "run", str(lines), "--out", str(tmp_path / "out")]
    # Two nodes of a core each have two together, and none of them has two.
    asked = [*arguments, "--cores", "2", "--address", nodes.address]
    done = subprocess.run(asked, cwd=root, capture_output=True, text=True, timeout=60.0, check=False)
    assert done.returncode == 2, done.stderr
    assert "a command needs 2 cores, and the largest node has 1\n  help: give --cores 1 or less" in done.stderr

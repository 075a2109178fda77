"""Commands over many machines: what each writes comes back to the driver, whatever dies meanwhile."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from scram.cluster._pool import Files, Pool, connected, say, unpacked
from scram.errors import InputError, MissingFileError, ScramError

#: Where a command's files go, in a line; at its end where a line does not say it.
OUT = "{out}"
#: Files that travel are no more than this, bytes.
MOST_BYTES = 256 << 20
#: What a command said and how it ended, beside its files.
SAID, ERRORS, DONE = "stdout.txt", "stderr.txt", "done.json"


@dataclass(frozen=True)
class Commands:
    """Commands by their words, and what a worker needs to run them."""

    lines: tuple[tuple[str, ...], ...]
    files: Files
    """What they read, by names relative to where they run."""
    cores: int = 1
    """Of each command."""
    versions: tuple[tuple[str, str], ...] = ()
    """What each program says of its version on the driver's machine."""

    @cached_property
    def _files_digest(self) -> str:
        """Of hundreds of megabytes: once for all commands."""
        digest = hashlib.sha256()
        for name, content in self.files:
            digest.update(f"\n{name} {len(content)}\n".encode())
            digest.update(content)
        return digest.hexdigest()

    def about(self, number: int) -> str:
        """What the result of a command depends on, as a digest."""
        return hashlib.sha256(json.dumps([self.lines[number], self.versions, self._files_digest]).encode()).hexdigest()


@dataclass(frozen=True)
class Ran:
    """How a command ended."""

    number: int
    exit_code: int
    seconds: float
    said: bytes
    errors: bytes
    files: Files


def read_commands(file: str | Path, files: Sequence[str | Path] = (), *, cores: int = 1) -> Commands:
    """The commands of a text file, one a line as in a shell without its expansions; empty lines and what follows ``#`` do not count.

    ``files`` are files and directories below the current directory that the commands read; they travel to where a command runs.

    Raises
    ------
    InputError
        A line cannot be split into words, there is none, a file is not below the current directory, or ``cores`` is below 1.
    MissingFileError
        There is no such file.
    """
    if cores < 1:
        raise InputError(f"a command needs 1 core or more, not {cores}")
    if not Path(file).is_file():
        raise MissingFileError(f"{file}: no such file\n  help: a text file with one command a line is expected")
    lines = []
    for number, line in enumerate(Path(file).read_text().splitlines(), 1):
        try:
            words = shlex.split(line, comments=True)
        except ValueError as error:
            raise InputError(f"{file}, line {number}: {error}") from None
        if words:
            lines.append(tuple(words if any(OUT in word for word in words) else [*words, "--out", OUT]))
    if not lines:
        raise InputError(f"{file}: no command\n  help: one a line, as `scram learn turn --direction left --seed 1`")
    programs = dict.fromkeys(line[0] for line in lines)
    return Commands(tuple(lines), travelling(files), cores, tuple((program, version(program)) for program in programs))


def travelling(paths: Sequence[str | Path]) -> Files:
    """Contents of files and of directories, by names relative to the current directory."""
    here = Path.cwd()
    found: dict[str, bytes] = {}
    for path in map(Path, paths):
        if not path.exists():
            raise MissingFileError(f"{path}: no such file")
        if not path.resolve().is_relative_to(here):
            raise InputError(f"{path} is not below the current directory, where the commands would look for it")
        for one in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if one.is_file():
                found[one.resolve().relative_to(here).as_posix()] = one.read_bytes()
    size = sum(map(len, found.values()))
    if size > MOST_BYTES:
        raise InputError(f"the files that travel are {size >> 20} MB, more than {MOST_BYTES >> 20}\n  help: name fewer")
    return tuple(found.items())


def version(program: str) -> str:
    """What a program says of itself, on the machine where this runs."""
    try:
        said = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    except OSError as error:
        raise ScramError(f"{program} cannot be run: {error.strerror}\n  help: it must be on the PATH of every node") from None
    return said.stdout.strip()


def run_commands(commands: Commands, numbers: Sequence[int]) -> tuple[list[Ran], float]:
    """Run some of the commands here, one after the other, and how long that took, s."""
    began = time.perf_counter()
    for program, theirs in commands.versions:
        if (mine := version(program)) != theirs:
            raise ScramError(
                f"{program} is {mine or 'another version'} on a node and {theirs or 'another one'} on the driver's machine\n"
                "  help: install the same version on every node"
            )
    return [run_one(commands, number) for number in numbers], time.perf_counter() - began


def run_one(commands: Commands, number: int) -> Ran:
    """Run a command in a directory of its own that has the files."""
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as place:
        directory, out = Path(place, "in"), Path(place, "out")
        directory.mkdir()
        unpacked(commands.files, directory)
        words = [word.replace(OUT, str(out)) for word in commands.lines[number]]
        # No more threads than it was given cores: others are at work on the same machine.
        environment = {**os.environ, "RAYON_NUM_THREADS": str(commands.cores)}
        done = subprocess.run(words, cwd=directory, env=environment, capture_output=True, stdin=subprocess.DEVNULL, check=False)
        written = sorted(file for file in out.rglob("*") if file.is_file())
        files = tuple((file.relative_to(out).as_posix(), file.read_bytes()) for file in written)
    return Ran(number, done.returncode, time.perf_counter() - began, done.stdout, done.stderr, files)


def run(commands: Commands, out: str | Path, *, address: str | None = None) -> list[Path]:
    """Run commands on a cluster, and keep what each one writes in a directory of ``out`` of its own: 0001 is the first one's.

    Called again, it runs those that are not there yet, failed, or are of other commands or files. Gives the directories of commands that
    failed. ``address`` is Ray's; without one the cores of this machine do the work.

    Raises
    ------
    InputError
        A command needs more cores than any node has.
    ScramError
        A node cannot run a program or has another version of it, or a result cannot be written.
    """
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    total = len(commands.lines)
    wanted = [number for number in range(total) if not is_done(place(out, number), commands.about(number))]
    if len(wanted) < total:
        say(f"{total - len(wanted)} of {total} commands were done already")
    failed = []
    if wanted:
        with connected(address):
            done = total - len(wanted)
            for some in Pool.of(run_commands, commands, wanted, commands.cores).results():
                for ran in some:
                    done += 1
                    keep(out, commands, ran)
                    how = "done" if ran.exit_code == 0 else f"failed with {ran.exit_code}"
                    say(f"{done} of {total}: {place(out, ran.number)} {how} after {ran.seconds:.0f} s")
                    if ran.exit_code != 0:
                        failed.append(place(out, ran.number))
    return sorted(failed)


def place(out: Path, number: int) -> Path:
    """The directory of a command."""
    return out / f"{number + 1:04}"


def is_done(directory: Path, about: str) -> bool:
    """Whether a directory has all that a command wrote, and is of the same one."""
    try:
        done = json.loads((directory / DONE).read_text())
    except FileNotFoundError:
        return False
    return bool(done["about"] == about and done["exit_code"] == 0)


def keep(out: Path, commands: Commands, ran: Ran) -> None:
    """Write what a command wrote, whole or not at all, in place of what was there."""
    directory = place(out, ran.number)
    beside = directory.with_name(f".{directory.name}")
    # Of a driver that was killed here.
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir()
    done = {
        "command": shlex.join(commands.lines[ran.number]),
        "exit_code": ran.exit_code,
        "seconds": round(ran.seconds, 3),
        "about": commands.about(ran.number),
    }
    own = ((SAID, ran.said), (ERRORS, ran.errors), (DONE, (json.dumps(done, indent=2) + "\n").encode()))
    unpacked((*ran.files, *own), beside)
    if directory.exists():
        shutil.rmtree(directory)
    beside.rename(directory)

"""The command line; exit codes are those of ``scram``."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import scram.cluster
from scram._scram import Sweep
from scram.cluster import collect, make_part, read_commands, run, sweep
from scram.errors import InputError, ScramError


def part_of(words: str) -> tuple[int, int]:
    """``3/8``: part 3, from 0, of 8."""
    number, _, count = words.partition("/")
    if not (number.isdecimal() and count.isdecimal() and int(number) < int(count)):
        raise argparse.ArgumentTypeError("NUMBER/COUNT is expected, the number from 0, as 3/8")
    return int(number), int(count)


def parser() -> argparse.ArgumentParser:
    """Of the three commands. Those about sweeps hand on what they do not know."""
    parser = argparse.ArgumentParser(
        prog="python -m scram.cluster",
        description=scram.cluster.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True)
    address = argparse.ArgumentParser(add_help=False)
    address.add_argument("--address", help="Ray's address, `auto` for a cluster that runs here [default: this machine alone]")
    # What these two do not know is a sweep's, and none of it is short for something of theirs.
    raw, options = argparse.RawDescriptionHelpFormatter, Sweep.help()
    one = commands.add_parser(
        "sweep", help="make a sweep", parents=[address], formatter_class=raw, epilog=options, allow_abbrev=False
    )
    one.add_argument("--part", type=part_of, metavar="NUMBER/COUNT", help="of an array of jobs: make this part, without Ray")
    commands.add_parser(
        "collect", help="put the parts of an array together", formatter_class=raw, epilog=options, allow_abbrev=False
    )
    one = commands.add_parser("run", help="run the commands of a file", parents=[address])
    one.add_argument("commands", type=Path, help="a command a line; {out} in it is where its files go, else --out is added")
    one.add_argument("--out", type=Path, required=True, help="a directory, in which every command gets one of its own")
    one.add_argument("--with", dest="files", action="extend", nargs="+", default=[], metavar="FILE", help="what the commands read")
    one.add_argument("--cores", type=int, default=1, help="of each command [default: 1]")
    return parser


def carried_out(own: argparse.Namespace, rest: list[str]) -> int:
    """Do what was asked for."""
    if own.command == "run":
        failed = run(read_commands(own.commands, own.files, cores=own.cores), own.out, address=own.address)
        print(f"written: {own.out}")
        if failed:
            print(f"error: {len(failed)} failed; stderr.txt says why: {', '.join(map(str, failed))}", file=sys.stderr)
        return 1 if failed else 0
    if own.command == "collect":
        files = collect(rest)
    elif own.part:
        files = [make_part(rest, *own.part)]
    else:
        files = sweep(rest, address=own.address)
    print(f"written: {', '.join(map(str, files))}")
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and give its exit code."""
    line = parser()
    own, rest = line.parse_known_args(arguments)
    if rest and own.command == "run":
        line.error(f"unrecognized arguments: {' '.join(rest)}")
    try:
        return carried_out(own, rest)
    except ScramError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1
    except KeyboardInterrupt:
        print("\nstopped; what was made is kept, and the same command goes on from there", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())

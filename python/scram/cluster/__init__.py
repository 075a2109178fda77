"""Work that outgrows a machine, on Ray.

``python -m scram.cluster sweep --address auto`` takes the options of ``scram sweep`` and writes the same tables, byte for byte. The driver
keeps every row in the journal of ``scram sweep`` as it comes: killed, it goes on where it was when the same is run again, here or by the
command itself.

``python -m scram.cluster run COMMANDS`` has every line of a file done on one of the machines: searches, diagnoses, campaigns and trainings
that differ by their seeds, settings or data.

What a node that dies had in work is done again by another one. ``docs/cluster.md`` says how far this goes.
"""

from scram.cluster._commands import Commands, read_commands, run, run_commands
from scram.cluster._pool import LOOPBACK, Pool
from scram.cluster._sweep import Rows, Task, collect, make_part, make_rows, sweep, task_of

__all__ = [
    "LOOPBACK",
    "Commands",
    "Pool",
    "Rows",
    "Task",
    "collect",
    "make_part",
    "make_rows",
    "read_commands",
    "run",
    "run_commands",
    "sweep",
    "task_of",
]

"""Prints every entity of a Rerun recording with each of its components, a pair a line."""

import sys

from rerun.chunk import RrdReader

found = set()
for chunk in RrdReader(sys.argv[1]).stream():
    for field in chunk.to_record_batch().schema:
        component = (field.metadata or {}).get(b"rerun:component")
        if component:
            found.add(f"{chunk.entity_path} {component.decode()}")
print("\n".join(sorted(found)))

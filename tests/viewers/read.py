"""Reads a recording as viewers do, and prints what it found as one JSON object.

    read.py run.mcap            with the official `mcap` and `foxglove` packages
    read.py run.mcap --rerun    as Rerun's viewer loads it
"""

import json
import struct
import sys

POSE_TOPICS = {"/tf": "FrameTransforms", "/pose": "PoseInFrame", "/feet": "PointCloud", "/forces": "SceneUpdate", "/scene": "SceneUpdate"}


def vector(v):
    return [v.x, v.y, v.z]


def quaternion(q):
    return [q.w, q.x, q.y, q.z]


def turned(q, v):
    """A vector turned by a unit quaternion w, x, y, z."""
    w, x, y, z = q
    a, b, c = v
    t = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)]
    return [a + w * t[0] + y * t[2] - z * t[1], b + w * t[1] + z * t[0] - x * t[2], c + w * t[2] + x * t[1] - y * t[0]]


def points(cloud):
    names = [field.name for field in cloud.fields]
    assert names == ["x", "y", "z", "fx_n", "fy_n", "fz_n", "red", "green", "blue", "alpha"], names
    assert cloud.point_stride == 28 and len(cloud.data) % 28 == 0
    return [dict(zip(names, struct.unpack_from("<6f4B", cloud.data, at))) for at in range(0, len(cloud.data), 28)]


def arrows(update):
    found = []
    for primitive in update.entities[0].arrows:
        along = turned(quaternion(primitive.pose.orientation), [1.0, 0.0, 0.0])
        length = primitive.shaft_length + primitive.head_length
        found.append({"at": vector(primitive.pose.position), "along": [length * part for part in along]})
    return found


def read(path):
    import foxglove.messages
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    found = {"schemas": {}, "tf": [], "pose": [], "feet": [], "forces": [], "entities": {}, "order": []}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for schema, channel, message in reader.iter_messages():
            if channel.topic in POSE_TOPICS and channel.topic not in found["schemas"]:
                official = getattr(foxglove.messages, POSE_TOPICS[channel.topic]).get_schema()
                assert (schema.name, schema.encoding) == (official.name, official.encoding), schema
                assert schema.data == official.data, f"{channel.topic}: not the published descriptor"
                found["schemas"][channel.topic] = schema.name
            elif channel.topic == "/robot_description":
                length = struct.unpack_from("<I", message.data, 4)[0]
                text = message.data[8 : 8 + length]
                assert message.data[:4] == b"\0\1\0\0" and len(message.data) == 8 + length and text[-1] == 0
                found["urdf"] = text[:-1].decode()
            found["order"].append(message.log_time)
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages(topics=list(POSE_TOPICS)):
            t = message.log_time * 1e-9
            stamp = lambda of: of.timestamp.seconds + 1e-9 * of.timestamp.nanos
            if channel.topic == "/tf":
                state = {}
                for transform in decoded.transforms:
                    assert abs(stamp(transform) - t) < 1e-9
                    pose = {"at": vector(transform.translation), "turn": quaternion(transform.rotation)}
                    state[transform.child_frame_id] = {"parent": transform.parent_frame_id, **pose}
                found["tf"].append({"t_s": t, "frames": state})
            elif channel.topic == "/pose":
                found["pose"].append({"t_s": t, "at": vector(decoded.pose.position), "turn": quaternion(decoded.pose.orientation)})
            elif channel.topic == "/feet":
                found["feet"].append(points(decoded))
            elif channel.topic == "/forces":
                found["forces"].append(arrows(decoded))
            else:
                for entity in decoded.entities:
                    counts = [len(entity.cubes), len(entity.spheres), len(entity.cylinders)]
                    found["entities"][entity.id] = {"frame": entity.frame_id, "locked": entity.frame_locked, "shapes": counts}
    found["is_sorted"] = found["order"] == sorted(found["order"])
    del found["order"]
    return found


def rerun(path):
    from rerun.chunk import McapReader

    found = {}
    for chunk in McapReader(path, timeline_type="duration_ns").stream():
        batch = chunk.to_record_batch()
        entity = found.setdefault(chunk.entity_path, {"rows": {}})
        for column, field in zip(batch.columns, batch.schema):
            name = (field.metadata or {}).get(b"rerun:component", b"").decode()
            if name:
                entity["rows"][name] = entity["rows"].get(name, 0) + len(column) - column.null_count
            if name in ("Transform3D:translation", "Transform3D:child_frame", "InstancePoses3D:translations", "Points3D:positions"):
                entity.setdefault("first", {}).setdefault(name, column[0].as_py())
    return found


if __name__ == "__main__":
    print(json.dumps(rerun(sys.argv[1]) if "--rerun" in sys.argv else read(sys.argv[1])))

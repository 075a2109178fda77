"""Opens a recording of `scram sim` in Rerun: the robot, its feet, the forces on them, and plots.

    pip install rerun-sdk==0.41.0 mcap==1.6.0 mcap-protobuf-support==0.6.0
    python docs/viewers/open_in_rerun.py out/latest/run.mcap
    python docs/viewers/open_in_rerun.py out/latest/run.mcap --save run.rrd

`rerun out/latest/run.mcap` draws robot, feet and pose without this. The script adds what Rerun does not read by itself: the
arrows of `/forces` (a foxglove.SceneUpdate), the numbers of the JSON topics as curves, and an arrangement of views.
"""

import argparse
import json

import rerun as rr
import rerun.blueprint as rrb
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from rerun.chunk import McapReader

TIMELINE = "message_log_time"
# Topic, column, entity of the curve.
CURVES = [
    ("/simulation", "truth_speed_rad_per_s", "/plots/speed_rad_per_s/true"),
    ("/simulation", "estimate_speed_rad_per_s", "/plots/speed_rad_per_s/estimated"),
    ("/simulation", "reference_speed_rad_per_s", "/plots/speed_rad_per_s/reference"),
    ("/sample", "duty", "/plots/duty"),
    ("/sample", "x_m", "/plots/position_m/x"),
    ("/sample", "y_m", "/plots/position_m/y"),
]


def arrow(primitive):
    """Origin, vector and colour of a foxglove.ArrowPrimitive, which points along its pose's x axis."""
    at, turn = primitive.pose.position, primitive.pose.orientation
    w, x, y, z = turn.w, turn.x, turn.y, turn.z
    length = primitive.shaft_length + primitive.head_length
    along = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
    colour = primitive.color
    return (at.x, at.y, at.z), [length * part for part in along], [colour.r, colour.g, colour.b, colour.a]


def log_forces(path):
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, _, message, update in reader.iter_decoded_messages(topics=["/forces"]):
            arrows = [arrow(primitive) for entity in update.entities for primitive in entity.arrows]
            origins, vectors, colours = zip(*arrows) if arrows else ([], [], [])
            rr.set_time(TIMELINE, duration=message.log_time * 1e-9)
            rr.log("/forces/arrows", rr.CoordinateFrame("world"), rr.Arrows3D(origins=origins, vectors=vectors, colors=colours, radii=4e-4))


def log_curves(path):
    found = {entity: ([], []) for _, _, entity in CURVES}
    walked = []
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=["/sample", "/simulation"]):
            values = json.loads(message.data)
            if values.get("x_m") is not None:
                walked.append((values["x_m"], values["y_m"], 2e-4))
            for topic, column, entity in CURVES:
                if topic == channel.topic and values.get(column) is not None:
                    found[entity][0].append(message.log_time * 1e-9)
                    found[entity][1].append(values[column])
    if walked:
        rr.log("/path", rr.CoordinateFrame("world"), rr.LineStrips3D([walked], radii=3e-4, colors=[22, 32, 43]), static=True)
    for entity, (times, values) in found.items():
        if times:
            rr.send_columns(entity, [rr.TimeColumn(TIMELINE, duration=times)], rr.Scalars.columns(scalars=values))


def blueprint():
    plots = [
        rrb.TimeSeriesView(name="Shaft's speed, rad/s", origin="/plots/speed_rad_per_s"),
        rrb.TimeSeriesView(name="Duty", origin="/plots/duty"),
        rrb.TimeSeriesView(name="Position, m", origin="/plots/position_m"),
    ]
    # The robot is some 15 cm long and starts with its front at 0.
    eye = rrb.EyeControls3D(position=(-0.2, -0.24, 0.17), look_target=(-0.06, 0, 0.01), eye_up=(0, 0, 1))
    robot = rrb.Spatial3DView(
        name="Robot",
        origin="/",
        contents=["+ $origin/**", "- /plots/**"],
        spatial_information=rrb.SpatialInformation(target_frame="world"),
        eye_controls=eye,
        background=(243, 244, 246),
    )
    return rrb.Blueprint(rrb.Horizontal(robot, rrb.Vertical(*plots), column_shares=[3, 2]), rrb.TimePanel(timeline=TIMELINE))


def main():
    parser = argparse.ArgumentParser(description="Opens a recording of `scram sim` in Rerun.")
    parser.add_argument("recording", help="run.mcap")
    parser.add_argument("--save", metavar="FILE.rrd", help="write a Rerun recording instead of opening the viewer")
    options = parser.parse_args()
    rr.init("scram", spawn=options.save is None)
    if options.save:
        rr.save(options.save, default_blueprint=blueprint())
    else:
        rr.send_blueprint(blueprint())
    drawn = McapReader(options.recording, timeline_type="duration_ns", exclude_topic_regex=["^/(sample|simulation|event|state)$"])
    rr.send_chunks(drawn.stream())
    # Larger than the feet, so that they are seen around them.
    rr.log("/feet", rr.Points3D.from_fields(radii=2.5e-3), static=True)
    log_forces(options.recording)
    log_curves(options.recording)


if __name__ == "__main__":
    main()

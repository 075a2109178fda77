"""Prints the layout of docs/viewers/foxglove.json: `layout.py > docs/viewers/foxglove.json` makes it anew.

Written with Foxglove's own types, so that a setting that it does not have is an error here.
"""

import foxglove.layouts as fl
import json


def series(path, label):
    return fl.PlotSeries(value=path, label=label, enabled=True, timestamp_method="receiveTime")


def plot(title, *paths, **settings):
    config = fl.PlotConfig(paths=list(paths), show_legend=True, legend_display="floating", is_synced=True, **settings)
    return fl.PlotPanel(title=title, config=config)


def scene():
    topic = fl.BaseRendererSceneUpdateTopicSettings
    return fl.ThreeDeePanel(
        title="Robot",
        config=fl.ThreeDeeConfig(
            fixed_frame="world",
            # The robot's front module: what follows it keeps the horizon.
            follow_tf="module1",
            follow_mode="follow-position",
            camera_state=fl.ThreeDeeCameraState(
                distance=0.45, perspective=True, phi=62, theta_offset=35, target_offset=(-0.07, 0, 0), fovy=32, near=0.005, far=50
            ),
            scene=fl.BaseRendererSceneSettings(background_color="#f3f4f6"),
            transforms=fl.BaseRendererTransforms(visible=False),
            topics={
                "/scene": topic(visible=True),
                "/forces": topic(visible=True),
                "/pose": fl.BaseRendererPoseTopicSettings(visible=True, type="axis", axis_scale=0.03),
            },
        ),
    )


def path():
    return plot(
        "Path from above, m",
        fl.PlotSeries(value="/pose.pose.position.y", label="y against x", enabled=True),
        x_axis_val="currentCustom",
        x_axis_path=fl.PlotXAxisPath(value="/pose.pose.position.x", enabled=True),
    )


def layout():
    plots = [
        plot(
            "Shaft's speed, rad/s",
            series("/simulation.truth_speed_rad_per_s", "true"),
            series("/simulation.estimate_speed_rad_per_s", "estimated"),
            series("/simulation.reference_speed_rad_per_s", "reference"),
        ),
        plot("Duty", series("/sample.duty", "duty")),
        plot("Heading, rad", series("/sample.yaw_rad", "heading")),
        path(),
    ]
    states = fl.StateTransitionsPanel(
        title="State",
        config=fl.StateTransitionsConfig(
            is_synced=True, paths=[fl.StateTransitionsSeries(value="/state.state", label="state", enabled=True)]
        ),
    )
    right = fl.SplitContainer(
        direction="column",
        items=[fl.SplitItem(proportion=3, content=panel) for panel in plots] + [fl.SplitItem(proportion=1, content=states)],
    )
    items = [fl.SplitItem(proportion=3, content=scene()), fl.SplitItem(proportion=2, content=right)]
    return fl.Layout(content=fl.SplitContainer(direction="row", items=items))


if __name__ == "__main__":
    print(json.dumps(json.loads(layout().to_json()), indent=1))

//! Writes a [`Scene`] beside a recording's samples, in the schemas that Foxglove and Rerun draw without set-up: protobuf with
//! Foxglove's published descriptors, and the robot's shapes as a URDF for Rerun, which draws no `foxglove.SceneUpdate`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Seek, Write};

use foxglove::Encode;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{
    ArrowPrimitive, Color, CubePrimitive, CylinderPrimitive, FrameTransform, FrameTransforms, PackedElementField,
    PointCloud, Pose, PoseInFrame, Quaternion, SceneEntity, SceneUpdate, SpherePrimitive, Timestamp, Vector3,
};
use mcap::records::MessageHeader;

use super::scene::{Form, Scene, SceneFoot, ScenePose, SceneState, Shape, WORLD};

/// Arrows of forces: the style sheet's colour of the 3D view.
const FORCE_COLOUR: [f64; 4] = [0.70, 0.07, 0.25, 1.0];
/// Feet on the ground are of the arrows' colour, others pale: red, green, blue, opacity.
const TOUCHING: [u8; 4] = [179, 18, 63, 255];
const LIFTED: [u8; 4] = [150, 160, 172, 255];
/// Share of an arrow that is its head, at most `HEAD_M`; its shaft's diameter.
const HEAD_SHARE: f64 = 0.3;
const HEAD_M: f64 = 0.003;
const SHAFT_M: f64 = 0.0008;

/// Numbers of a point of `/feet`; the colour follows them.
const FOOT_FIELDS: [&str; 6] = ["x", "y", "z", "fx_n", "fy_n", "fz_n"];
const COLOUR_FIELDS: [&str; 4] = ["red", "green", "blue", "alpha"];

/// Writes a scene's states as the samples pass.
pub(super) struct SceneWriter<'a> {
    scene: &'a Scene,
    given: usize,
    transforms: u16,
    pose: Option<u16>,
    feet: Option<[u16; 2]>,
    message: Vec<u8>,
}

impl<'a> SceneWriter<'a> {
    /// Adds the channels, and writes what does not change with `header`'s time.
    pub(super) fn begin<W: Write + Seek>(
        writer: &mut mcap::Writer<W>,
        scene: &'a Scene,
        log_time: u64,
    ) -> mcap::McapResult<Self> {
        let mut this = Self {
            scene,
            given: 0,
            transforms: channel::<FrameTransforms, W>(writer, "/tf")?,
            pose: None,
            feet: None,
            message: Vec::new(),
        };
        if scene.states.iter().any(|state| state.robot.is_some()) {
            this.pose = Some(channel::<PoseInFrame, W>(writer, "/pose")?);
        }
        if scene.states.iter().any(|state| !state.feet.is_empty()) {
            this.feet =
                Some([channel::<PointCloud, W>(writer, "/feet")?, channel::<SceneUpdate, W>(writer, "/forces")?]);
        }
        if scene.frames.iter().any(|frame| !frame.shapes.is_empty()) {
            let shapes = channel::<SceneUpdate, W>(writer, "/scene")?;
            let description = description_channel(writer)?;
            this.write(writer, shapes, log_time, &shapes_of(scene, log_time))?;
            let header = header(description, 0, log_time);
            writer.write_to_known_channel(&header, &cdr_string(&urdf(scene)))?;
        }
        Ok(this)
    }

    /// Writes the states up to a time, s; `log_time` turns a state's time into that of the file, ns.
    pub(super) fn until<W: Write + Seek>(
        &mut self,
        writer: &mut mcap::Writer<W>,
        t_s: f64,
        log_time: impl Fn(f64) -> u64,
    ) -> mcap::McapResult<()> {
        let scene = self.scene;
        while let Some(state) = scene.states.get(self.given).filter(|state| state.t_s <= t_s) {
            let time = log_time(state.t_s);
            self.write(writer, self.transforms, time, &transforms(scene, state, time))?;
            if let (Some(channel), Some(pose)) = (self.pose, &state.robot) {
                let message = PoseInFrame { timestamp: stamp(time), frame_id: WORLD.into(), pose: Some(posed(pose)) };
                self.write(writer, channel, time, &message)?;
            }
            if let Some([feet, forces]) = self.feet {
                self.write(writer, feet, time, &points(&state.feet, time))?;
                self.write(writer, forces, time, &arrows(scene, &state.feet, time))?;
            }
            self.given += 1;
        }
        Ok(())
    }

    fn write<W: Write + Seek, M: Encode>(
        &mut self,
        writer: &mut mcap::Writer<W>,
        channel: u16,
        time: u64,
        message: &M,
    ) -> mcap::McapResult<()> {
        self.message.clear();
        let encoded = message.encode(&mut self.message);
        encoded.map_err(|error| std::io::Error::other(error.to_string()))?;
        writer.write_to_known_channel(&header(channel, self.given, time), &self.message)
    }
}

fn header(channel_id: u16, index: usize, time: u64) -> MessageHeader {
    MessageHeader { channel_id, sequence: index as u32, log_time: time, publish_time: time }
}

fn channel<M: Encode, W: Write + Seek>(writer: &mut mcap::Writer<W>, topic: &str) -> mcap::McapResult<u16> {
    let schema = match M::get_schema() {
        Some(schema) => writer.add_schema(&schema.name, &schema.encoding, &schema.data)?,
        None => 0,
    };
    writer.add_channel(schema, topic, &M::get_message_encoding(), &BTreeMap::new())
}

/// A `std_msgs/msg/String` of ROS 2 with the URDF, under the name by which viewers know one.
fn description_channel<W: Write + Seek>(writer: &mut mcap::Writer<W>) -> mcap::McapResult<u16> {
    let schema = writer.add_schema("std_msgs/msg/String", "ros2msg", b"string data\n")?;
    writer.add_channel(schema, "/robot_description", "cdr", &BTreeMap::new())
}

/// A string as CDR has it, little-endian: a head of four bytes, the length with its final zero, the text.
fn cdr_string(text: &str) -> Vec<u8> {
    let length = text.len() as u32 + 1;
    let parts: [&[u8]; 4] = [&[0, 1, 0, 0], &length.to_le_bytes(), text.as_bytes(), &[0]];
    parts.concat()
}

fn stamp(time: u64) -> Option<Timestamp> {
    const NS: u64 = 1_000_000_000;
    Timestamp::new_checked(u32::try_from(time / NS).ok()?, (time % NS) as u32)
}

fn vector([x, y, z]: [f64; 3]) -> Option<Vector3> {
    Some(Vector3 { x, y, z })
}

fn quaternion([w, x, y, z]: [f64; 4]) -> Option<Quaternion> {
    Some(Quaternion { x, y, z, w })
}

fn posed(pose: &ScenePose) -> Pose {
    Pose { position: vector(pose.position), orientation: quaternion(pose.orientation) }
}

fn painted([r, g, b, a]: [f64; 4]) -> Option<Color> {
    Some(Color { r, g, b, a })
}

fn transforms(scene: &Scene, state: &SceneState, time: u64) -> FrameTransforms {
    let transform = |(frame, pose): (&super::SceneFrame, &ScenePose)| FrameTransform {
        timestamp: stamp(time),
        parent_frame_id: frame.parent.clone(),
        child_frame_id: frame.name.clone(),
        translation: vector(pose.position),
        rotation: quaternion(pose.orientation),
    };
    FrameTransforms { transforms: scene.frames.iter().zip(&state.poses).map(transform).collect() }
}

fn shapes_of(scene: &Scene, time: u64) -> SceneUpdate {
    let fixed = (WORLD, &scene.ground);
    let moving = scene.frames.iter().map(|frame| (frame.name.as_str(), &frame.shapes));
    let entities = std::iter::once(fixed).chain(moving).filter(|(_, shapes)| !shapes.is_empty());
    let entities = entities.map(|(frame, shapes)| {
        let mut entity = SceneEntity {
            timestamp: stamp(time),
            frame_id: frame.to_owned(),
            id: frame.to_owned(),
            // It follows its frame.
            frame_locked: true,
            ..SceneEntity::default()
        };
        for shape in shapes {
            add(&mut entity, shape);
        }
        entity
    });
    SceneUpdate { deletions: vec![], entities: entities.collect() }
}

fn add(entity: &mut SceneEntity, shape: &Shape) {
    let (pose, color) = (Some(posed(&shape.pose)), painted(shape.colour));
    match shape.form {
        Form::Box(size) => entity.cubes.push(CubePrimitive { pose, size: vector(size), color }),
        Form::Sphere(radius) => {
            entity.spheres.push(SpherePrimitive { pose, size: vector([2.0 * radius; 3]), color });
        }
        Form::Cylinder { radius, length } => entity.cylinders.push(CylinderPrimitive {
            pose,
            size: vector([2.0 * radius, 2.0 * radius, length]),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color,
        }),
    }
}

/// One entity, so that each message replaces the one before; feet in the air have no arrow.
fn arrows(scene: &Scene, feet: &[SceneFoot], time: u64) -> SceneUpdate {
    let arrow = |foot: &SceneFoot| {
        let newtons = foot.force.map(|part| part * part).iter().sum::<f64>().sqrt();
        let length = newtons * scene.arrow_m_per_n;
        (length > 0.0).then(|| {
            let head = (HEAD_SHARE * length).min(HEAD_M);
            let pose =
                ScenePose { position: foot.position, orientation: from_x(foot.force.map(|part| part / newtons)) };
            ArrowPrimitive {
                pose: Some(posed(&pose)),
                shaft_length: length - head,
                shaft_diameter: SHAFT_M,
                head_length: head,
                head_diameter: 2.5 * SHAFT_M,
                color: painted(FORCE_COLOUR),
            }
        })
    };
    let entity = SceneEntity {
        timestamp: stamp(time),
        frame_id: WORLD.into(),
        id: "forces".into(),
        arrows: feet.iter().filter_map(arrow).collect(),
        ..SceneEntity::default()
    };
    SceneUpdate { deletions: vec![], entities: vec![entity] }
}

/// The shortest turn from the x axis to a unit vector, w, x, y, z.
fn from_x([x, y, z]: [f64; 3]) -> [f64; 4] {
    let w = (0.5 * (1.0 + x)).max(0.0).sqrt();
    // Backwards: half a turn about z.
    if w < 1e-9 { [0.0, 0.0, 0.0, 1.0] } else { [w, 0.0, -z / (2.0 * w), y / (2.0 * w)] }
}

/// Feet as points with their forces, coloured by whether they touch.
fn points(feet: &[SceneFoot], time: u64) -> PointCloud {
    let mut data = Vec::new();
    for foot in feet {
        for value in foot.position.iter().chain(&foot.force) {
            data.extend((*value as f32).to_le_bytes());
        }
        data.extend(if foot.force == [0.0; 3] { LIFTED } else { TOUCHING });
    }
    let numbers = FOOT_FIELDS.iter().map(|name| (*name, NumericType::Float32, 4));
    let colours = COLOUR_FIELDS.iter().map(|name| (*name, NumericType::Uint8, 1));
    let mut stride = 0;
    let fields = numbers.chain(colours).map(|(name, kind, size)| {
        let offset = stride;
        stride += size;
        PackedElementField { name: name.to_owned(), offset, r#type: kind.into() }
    });
    let fields = fields.collect();
    PointCloud {
        timestamp: stamp(time),
        frame_id: WORLD.into(),
        pose: Some(posed(&ScenePose::at([0.0; 3]))),
        point_stride: stride,
        fields,
        data: data.into(),
    }
}

/// The shapes as a URDF whose links are the scene's frames. Its joints say nothing: the transforms are in `/tf`.
fn urdf(scene: &Scene) -> String {
    let mut text = String::from("<?xml version=\"1.0\"?>\n<robot name=\"scram\">\n");
    let mut materials = Vec::new();
    link(&mut text, &mut materials, WORLD, &scene.ground);
    for frame in &scene.frames {
        link(&mut text, &mut materials, &frame.name, &frame.shapes);
    }
    for frame in &scene.frames {
        let (name, parent) = (&frame.name, &frame.parent);
        let _ = writeln!(
            text,
            "<joint name=\"{name}_joint\" type=\"floating\"><parent link=\"{parent}\"/><child link=\"{name}\"/></joint>"
        );
    }
    text + "</robot>\n"
}

fn link(text: &mut String, materials: &mut Vec<[f64; 4]>, name: &str, shapes: &[Shape]) {
    let _ = writeln!(text, "<link name=\"{name}\">");
    for shape in shapes {
        let [x, y, z] = shape.pose.position;
        let [roll, pitch, yaw] = roll_pitch_yaw(shape.pose.orientation);
        let form = match shape.form {
            Form::Box([x, y, z]) => format!("<box size=\"{x} {y} {z}\"/>"),
            Form::Cylinder { radius, length } => format!("<cylinder radius=\"{radius}\" length=\"{length}\"/>"),
            Form::Sphere(radius) => format!("<sphere radius=\"{radius}\"/>"),
        };
        let known = materials.iter().position(|colour| *colour == shape.colour);
        let material = known.unwrap_or_else(|| {
            materials.push(shape.colour);
            materials.len() - 1
        });
        let [r, g, b, a] = shape.colour;
        let _ = writeln!(
            text,
            "<visual><origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/><geometry>{form}</geometry>\
             <material name=\"colour{material}\"><color rgba=\"{r} {g} {b} {a}\"/></material></visual>"
        );
    }
    text.push_str("</link>\n");
}

/// Angles about the fixed x, y and z axes in this order, rad, as URDF has them.
fn roll_pitch_yaw([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
    let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    [roll, pitch, yaw]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// v' = q v q⁻¹ of the x axis.
    fn turned_x([w, x, y, z]: [f64; 4]) -> [f64; 3] {
        [w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)]
    }

    #[test]
    fn arrows_point_where_the_force_does() {
        for force in [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [-1.0, 0.0, 0.0], [0.48, -0.6, 0.64]] {
            let found = turned_x(from_x(force));
            assert!(found.iter().zip(force).all(|(a, b)| (a - b).abs() < 1e-12), "{force:?}: {found:?}");
        }
    }

    #[test]
    fn a_turn_about_one_axis_is_that_angle_in_the_urdf() {
        let (sin, cos) = 0.15f64.sin_cos();
        for axis in 0..3 {
            let mut quaternion = [cos, 0.0, 0.0, 0.0];
            quaternion[axis + 1] = sin;
            let mut expected = [0.0; 3];
            expected[axis] = 0.3;
            let found = roll_pitch_yaw(quaternion);
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        }
    }
}

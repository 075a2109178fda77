//! A scene beside a recording: its own messages, and nothing that the reader of recordings would see.

use std::path::Path;

use foxglove::Decode;
use foxglove::messages::{FrameTransforms, PoseInFrame, SceneUpdate};
use recording::{
    AngleReading, Drive, Form, ReadOptions, Recording, Run, Scene, SceneFoot, SceneFrame, ScenePose, SceneState, Shape,
    WORLD, load, write_mcap,
};

fn recording(samples: usize) -> Recording {
    Recording {
        t_s: (0..samples).map(|i| i as f64 * 1e-3).collect(),
        enable: vec![true; samples],
        drive: Drive::Duty(vec![0.5; samples]),
        angle: AngleReading::Adc((0..samples).map(|i| Some(i as u16)).collect()),
        ..Recording::default()
    }
}

fn frame(name: &str, parent: &str) -> SceneFrame {
    let shape = Shape { form: Form::Sphere(0.01), pose: ScenePose::at([0.1, 0.2, 0.3]), colour: [0.5, 0.25, 1.0, 1.0] };
    SceneFrame { name: name.into(), parent: parent.into(), shapes: vec![shape] }
}

/// A body and what turns on it, a state every 10 ms.
fn scene(states: usize) -> Scene {
    let state = |i: usize| SceneState {
        t_s: i as f64 * 0.01,
        poses: vec![ScenePose::at([i as f64, 0.0, 0.5]), ScenePose::at([0.0; 3]).turned(0.1 * i as f64)],
        robot: Some(ScenePose::at([i as f64, 0.0, 0.0])),
        feet: vec![SceneFoot {
            position: [0.0, 1.0, 0.0],
            force: [0.0, 0.0, if i.is_multiple_of(2) { 2.0 } else { 0.0 }],
        }],
    };
    Scene {
        frames: vec![frame("body", WORLD), frame("rotor", "body")],
        arrow_m_per_n: 0.25,
        states: (0..states).map(state).collect(),
        ..Scene::default()
    }
}

fn write(path: &Path, scene: &Scene) -> Result<(), recording::RecordingError> {
    Run { recording: recording(100), scene: Some(scene.clone()), ..Run::default() }.write(path)
}

/// Messages of a topic, and their times.
fn messages(path: &Path, topic: &str) -> Vec<(u64, Vec<u8>)> {
    let bytes = std::fs::read(path).unwrap();
    let stream = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    stream.filter(|message| message.channel.topic == topic).map(|m| (m.log_time, m.data.to_vec())).collect()
}

#[test]
fn the_reader_of_recordings_sees_the_same_with_a_scene_and_without() {
    let directory = tempfile::tempdir().unwrap();
    let [with, without] = ["with.mcap", "without.mcap"].map(|name| directory.path().join(name));
    write(&with, &scene(10)).unwrap();
    write_mcap(&without, &recording(100)).unwrap();
    let read = load(&with).unwrap();
    assert_eq!(Recording { path: without.clone(), ..read }, load(&without).unwrap());
    assert!(std::fs::metadata(&with).unwrap().len() > std::fs::metadata(&without).unwrap().len());
}

#[test]
fn every_state_up_to_the_last_sample_is_there_at_its_time() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.mcap");
    // The last sample is at 99 ms: states at 100 ms and later are not in the file.
    write(&path, &scene(15)).unwrap();
    let transforms = messages(&path, "/tf");
    assert_eq!(transforms.len(), 10);
    for (i, (time, data)) in transforms.iter().enumerate() {
        assert_eq!(*time, i as u64 * 10_000_000);
        let decoded = FrameTransforms::decode(data.as_slice()).unwrap().transforms;
        let [body, rotor] = decoded.as_slice() else { panic!("{} frames", decoded.len()) };
        assert_eq!((body.parent_frame_id.as_str(), body.child_frame_id.as_str()), (WORLD, "body"));
        assert_eq!(body.translation.unwrap().x, i as f64);
        assert_eq!((rotor.parent_frame_id.as_str(), rotor.child_frame_id.as_str()), ("body", "rotor"));
        assert_eq!(rotor.rotation.unwrap().z, (0.05 * i as f64).sin());
    }
    let poses = messages(&path, "/pose");
    assert_eq!(PoseInFrame::decode(poses[7].1.as_slice()).unwrap().pose.unwrap().position.unwrap().x, 7.0);
    let arrows = |i: usize| {
        let update = SceneUpdate::decode(messages(&path, "/forces")[i].1.as_slice()).unwrap();
        update.entities[0].arrows.iter().map(|arrow| arrow.shaft_length + arrow.head_length).collect::<Vec<_>>()
    };
    assert_eq!((arrows(2), arrows(3)), (vec![0.5], vec![]), "0.25 m/N, and none in the air");
    assert_eq!(messages(&path, "/scene").len(), 1);
}

#[test]
fn a_scene_that_does_not_fit_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.mcap");
    let mut twice = scene(3);
    twice.frames[1].name = "body".into();
    let mut orphan = scene(3);
    orphan.frames[0].parent = "rotor".into();
    let mut spoiled = scene(3);
    spoiled.frames[0].name = "a\"/><x".into();
    let mut short = scene(3);
    short.states[2].poses.pop();
    let mut backwards = scene(3);
    backwards.states.swap(0, 2);
    for wrong in [twice, orphan, spoiled, short, backwards] {
        let error = write(&path, &wrong).expect_err("it must be refused").to_string();
        assert!(error.contains("the scene's frames and states do not fit"), "{error}");
        assert!(!path.exists());
    }
}

/// A file of whoever else, in which the samples are hours into a day's log: a sample, a picture, a sample, a picture.
fn with_pictures(path: &Path) {
    let mut writer = mcap::Writer::new(std::fs::File::create(path).unwrap()).unwrap();
    let none = std::collections::BTreeMap::new();
    let samples = writer.add_channel(0, "/sample", "json", &none).unwrap();
    let schema = writer.add_schema("Picture", "protobuf", b"descriptor").unwrap();
    let pictures = writer.add_channel(schema, "/camera/picture", "protobuf", &none).unwrap();
    for i in 0..2u32 {
        let log_time = 1_700_000_000_000_000_000 + u64::from(i) * 1_000_000;
        let header = |channel_id, log_time| mcap::records::MessageHeader {
            channel_id,
            sequence: i,
            log_time,
            publish_time: log_time - 7,
        };
        let sample = format!(r#"{{"t_s": {}, "duty": 0.5, "angle_rad": 0.1}}"#, f64::from(i) * 1e-3);
        writer.write_to_known_channel(&header(samples, log_time), sample.as_bytes()).unwrap();
        writer.write_to_known_channel(&header(pictures, log_time + 400_000), &[i as u8; 5]).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn what_viewers_draw_is_written_again_as_it_was_read() {
    let directory = tempfile::tempdir().unwrap();
    let [path, again] = ["run.mcap", "again.mcap"].map(|name| directory.path().join(name));
    write(&path, &scene(15)).unwrap();
    let run = Run::load(&path, &ReadOptions::default()).unwrap();
    assert!(run.others.topics().any(|topic| topic == "/tf"));
    run.write(&again).unwrap();
    assert!(std::fs::read(&path).unwrap() == std::fs::read(&again).unwrap());
}

#[test]
fn what_others_recorded_stays_beside_the_samples() {
    let directory = tempfile::tempdir().unwrap();
    let [path, again] = ["run.mcap", "again.mcap"].map(|name| directory.path().join(name));
    with_pictures(&path);
    Run::load(&path, &ReadOptions::default()).unwrap().write(&again).unwrap();
    // A recording's log time is that of its samples.
    let pictures = vec![(400_000, vec![0; 5]), (1_400_000, vec![1; 5])];
    assert_eq!(messages(&again, "/camera/picture"), pictures);
    let bytes = std::fs::read(&again).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let channel = summary.channels.values().find(|channel| channel.topic == "/camera/picture").unwrap();
    assert_eq!(channel.schema.as_ref().unwrap().data.as_ref(), b"descriptor");
}

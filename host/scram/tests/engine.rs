//! The console without a screen on a robot of the workbench, in virtual time.

mod common;

use std::time::Duration;

use common::bench::{bench, session};
use control::State;
use scram::console::Engine;

/// What the screen shows as a robot's target is what the robot does.
#[test]
fn a_refused_order_leaves_the_target_at_what_the_robot_does() {
    let line = bench(1, 9, |_| {});
    let mut engine = Engine::new(session(&line, 1, 9), "the bench");
    let mut typed = |text: &str| {
        engine.submit(text).expect("it can be typed");
        let end = engine.model().now + Duration::from_millis(300);
        while engine.model().now < end {
            engine.poll().expect("the line holds");
        }
        let robot = &engine.model().robots[0];
        (robot.target.clone(), robot.state)
    };
    typed("status");
    typed("status");
    typed("status");
    let driving = (Some("freq 7".to_owned()), Some(State::Speed));
    assert_eq!(typed("clear; freq 7"), driving);
    assert_eq!(typed("freq 50"), driving, "refused");
    assert_eq!(typed("save"), driving, "refused while it drives");
    assert_eq!(typed("clear"), driving, "there is nothing to clear");
    assert_eq!(typed("position 30").0.as_deref(), Some("position 30"));
    assert_eq!(typed("coast").0, None);
    assert_eq!(typed("freq 50").0, None);
    assert_eq!(typed("freq 7"), driving);
    assert_eq!(typed("stop").0, None);
}

//! Environments as a learner uses them: the same episodes whatever the company, ends, starts, robots drawn, collisions.

use hal_sim::body::Precision;
use robot_file::edit::Document;
use sweep::VariantBuilder;
use tasks::{
    Definition, DriveKind, Environments, Maze, MazeRun, Part, Randomization, Reset, Start, Steps, Straight, Task,
    TaskError, Turn,
};

fn robot() -> VariantBuilder {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml");
    let document = Document::load(path.as_ref()).unwrap();
    let robot = document.robot().unwrap();
    VariantBuilder::new(document, robot).unwrap()
}

fn turning() -> Definition {
    Definition { interval_s: 0.04, episode_s: 0.4, ..Definition::new(Task::Turn(Turn::default())) }
}

/// The same actions in every environment, whatever their number: those of environment `i`.
fn action(i: usize, step: usize) -> usize {
    (3 * i + 7 * step + step * step) % 10
}

/// What environment `seed` of these sees and earns over two episodes.
fn history(definition: &Definition, seeds: &[u64], followed: u64, threads: usize) -> Vec<(Vec<u32>, u64, bool, bool)> {
    let mut environments = Environments::with_threads(robot(), definition.clone(), seeds.len(), Some(threads)).unwrap();
    let resets: Vec<Reset> = seeds.iter().map(|seed| Reset::Seed(*seed)).collect();
    environments.reset_each(&resets).unwrap();
    let i = seeds.iter().position(|seed| *seed == followed).unwrap();
    let size = definition.observation_size();
    let mut first = vec![0.0; size];
    environments.observe(i, &mut first);
    let bits = |row: &[f32]| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let mut rows = vec![(bits(&first), 0, false, false)];
    for step in 0..2 * definition.episode_steps() {
        let actions: Vec<usize> = seeds.iter().map(|seed| action(*seed as usize, step)).collect();
        let Steps { observations, rewards, terminated, truncated } = environments.step(&actions).unwrap();
        let row = bits(&observations[i * size..(i + 1) * size]);
        rows.push((row, rewards[i].to_bits(), terminated[i], truncated[i]));
        let ended = |k: usize| if terminated[k] || truncated[k] { Reset::Next } else { Reset::Keep };
        environments.reset_each(&(0..seeds.len()).map(ended).collect::<Vec<_>>()).unwrap();
    }
    rows
}

#[test]
fn an_episode_depends_on_its_seed_alone() {
    let randomized = Randomization { share: 1.0, ..Randomization::default() };
    let start = Start { position_m: 0.01, heading_rad: 0.2 };
    for (drive, precision) in [
        (DriveKind::Exact, Precision::Single),
        (DriveKind::Exact, Precision::Double),
        (DriveKind::Motor, Precision::Single),
    ] {
        let definition = Definition { drive, precision, randomization: randomized.clone(), start, ..turning() };
        let alone = history(&definition, &[5], 5, 1);
        for (seeds, threads) in [(vec![4, 5, 6], 2), ((0..8).collect(), 2), ((0..8).rev().collect(), 1)] {
            assert_eq!(history(&definition, &seeds, 5, threads), alone, "{drive:?} {precision:?} among {seeds:?}");
        }
        assert_ne!(history(&definition, &[6], 6, 1), alone);
    }
}

#[test]
fn an_episode_is_truncated_when_its_time_is_over_and_the_next_one_is_another() {
    let definition =
        Definition { randomization: Randomization { share: 1.0, ..Randomization::default() }, ..turning() };
    let mut environments = Environments::new(robot(), definition, 2).unwrap();
    environments.reset(0, Some(1)).unwrap();
    let first = environments.episode_seed(0);
    let friction = environments.plan(0).contact.as_ref().unwrap().friction;
    for step in 1..=10 {
        let steps = environments.step(&[2, 7]).unwrap();
        assert_eq!(steps.truncated, [step == 10; 2]);
        assert!(steps.terminated == [false; 2] && (environments.time_s(0) - 0.04 * f64::from(step)).abs() < 1e-9);
    }
    environments.reset(0, None).unwrap();
    assert_ne!(environments.episode_seed(0), first);
    assert_ne!(environments.plan(0).contact.as_ref().unwrap().friction, friction);
    environments.reset(0, Some(1)).unwrap();
    assert_eq!(environments.episode_seed(0), first);
    assert_eq!(environments.plan(0).contact.as_ref().unwrap().friction, friction);
}

#[test]
fn robots_are_drawn_within_the_spreads_and_by_their_share() {
    let drawn = |share: f64| {
        let randomization = Randomization { share, ..Randomization::default() };
        let mut environments = Environments::new(robot(), Definition { randomization, ..turning() }, 1).unwrap();
        let mut frictions = vec![];
        for seed in 0..40 {
            environments.reset(0, Some(seed)).unwrap();
            frictions.push(environments.plan(0).contact.as_ref().unwrap().friction);
        }
        (frictions.iter().copied().fold(f64::INFINITY, f64::min), frictions.iter().copied().fold(0.0, f64::max))
    };
    // The file's friction is 0.8, from 0.45 to 1.3.
    assert_eq!(drawn(0.0), (0.8, 0.8));
    let (low, high) = drawn(1.0);
    assert!((0.45..0.55).contains(&low) && (1.2..1.3).contains(&high), "{low} … {high}");
    let (low, high) = drawn(0.1);
    assert!((0.765..0.78).contains(&low) && (0.83..0.85).contains(&high), "{low} … {high}");
}

#[test]
fn a_start_off_its_place_is_where_it_was_drawn() {
    let start = Start { position_m: 0.02, heading_rad: 0.5 };
    let definition = Definition { start, ..Definition::new(Task::Straight(Straight::default())) };
    let mut environments = Environments::new(robot(), definition, 1).unwrap();
    let mut widest = [0.0_f64; 3];
    for seed in 0..60 {
        environments.reset(0, Some(seed)).unwrap();
        let pose = environments.pose(0);
        for (widest, value) in widest.iter_mut().zip([pose.x, pose.y, pose.heading]) {
            *widest = widest.max(value.abs());
        }
    }
    for (widest, bound) in widest.into_iter().zip([0.02, 0.02, 0.5]) {
        assert!(widest <= bound + 1e-9 && widest > 0.85 * bound, "{widest} of {bound}");
    }
}

#[test]
fn a_robot_in_the_maze_starts_ahead_and_stays_between_its_walls() {
    let wide = MazeRun::new(Maze::figure_5_5(0.4));
    let usual = MazeRun::new(Maze::figure_5_5(Maze::CELL_M));
    // Hardly wider than the courier.
    let narrow = MazeRun::new(Maze::figure_5_5(0.064));
    for (run, touches) in [(wide, false), (usual, true), (narrow, true)] {
        let cell = run.maze.cell_m();
        let definition = Definition { episode_s: 12.0, ..Definition::new(Task::Maze(run.clone())) };
        let mut environments = Environments::new(robot(), definition, 1).unwrap();
        let start = environments.pose(0);
        let [x, y] = run.maze.start();
        // To the digits of single precision.
        assert!((start.x - x).hypot(start.y - y) < 1e-6 && start.heading.abs() < 1e-6, "{start:?}");
        let plan = environments.plan(0).clone();
        let mut outermost = 0.0_f64;
        for _ in 0..300 {
            environments.step(&[8]).unwrap();
            for (pose, module) in environments.snapshot(0).modules.iter().zip(&plan.modules) {
                let axes = hal_sim::body::coordinates::rotation(pose.orientation);
                let reach = 0.5 * (module.size[0] * axes[1][0].abs() + module.size[1] * axes[1][1].abs());
                outermost = outermost.max((pose.position[1] - y).abs() + reach);
            }
        }
        println!("cells of {cell} m: {:.2} mm from the middle at most", 1e3 * outermost);
        assert!(outermost < 0.5 * cell + 1e-3, "through the wall: {outermost} m from the middle of {cell} m");
        assert_eq!(outermost > 0.5 * cell, touches);
    }
}

#[test]
fn the_motor_turns_the_way_that_the_action_says() {
    for drive in [DriveKind::Exact, DriveKind::Motor] {
        let definition = Definition { drive, parts: vec![Part::Shaft], episode_s: 2.0, ..turning() };
        let mut environments = Environments::new(robot(), definition, 2).unwrap();
        environments.reset_each(&[Reset::Seed(1), Reset::Seed(2)]).unwrap();
        for _ in 0..40 {
            let steps = environments.step(&[2, 7]).unwrap();
            assert_eq!(steps.terminated, [false; 2], "{:?}", environments.fault(0));
        }
        // −7 Hz is counter-clockwise, +7 Hz clockwise.
        let before = [0, 1].map(|i| environments.snapshot(i).rotor.unwrap().angle);
        environments.step(&[2, 7]).unwrap();
        let turned = [0, 1].map(|i| environments.snapshot(i).rotor.unwrap().angle - before[i]);
        for (turned, hz) in turned.into_iter().zip([7.0, -7.0]) {
            let expected = std::f64::consts::TAU * hz * 0.04;
            assert!((turned - expected).abs() < 0.15, "{drive:?}: {turned} rad in a step, not {expected}");
        }
    }
}

#[test]
fn an_action_may_be_a_swing_of_the_controller() {
    let (drive, interval_s) = (DriveKind::Motor, 0.5);
    let swing = [-45.0, 105.0];
    let (parts, episode_s) = (vec![Part::Shaft], 4.0);
    let definition = Definition { oscillations_deg: vec![swing], drive, interval_s, parts, episode_s, ..turning() };
    let mut environments = Environments::new(robot(), definition, 2).unwrap();
    environments.record(0, true);
    environments.reset_each(&[Reset::Seed(1), Reset::Seed(2)]).unwrap();
    // The last one, for both; then a frequency for the second alone.
    for actions in [[10, 10], [10, 10], [10, 9], [10, 9]] {
        environments.step(&actions).unwrap();
    }
    let swung = environments.track(0).unwrap().snapshots.iter().skip(100);
    let angles: Vec<f64> = swung.map(|snapshot| snapshot.rotor.unwrap().angle.to_degrees()).collect();
    let turn = 360.0 * (angles[0] / 360.0).round();
    let reached = [f64::min, f64::max].map(|worse| angles.iter().copied().reduce(worse).unwrap() - turn);
    for (reached, bound) in reached.into_iter().zip(swing) {
        assert!((reached - bound).abs() < 8.0, "{reached}° instead of {bound}°");
    }
    assert!(environments.snapshot(1).rotor.unwrap().angle < -std::f64::consts::TAU, "clockwise, round and round");
}

#[test]
fn what_a_fault_leaves_out_is_standing_where_it_happened() {
    let turn = Turn::default();
    let definition = Definition { drive: DriveKind::Motor, ..Definition::new(Task::Turn(turn)) };
    let mut environments = Environments::new(robot(), definition.clone(), 1).unwrap();
    environments.reset(0, Some(1)).unwrap();
    let start = environments.pose(0);
    // To and fro at the highest speed until the supervisor has enough of it.
    let stopped =
        (0..definition.episode_steps()).find(|step| environments.step(&[[0, 9][step % 2]]).unwrap().terminated[0]);
    let left = definition.episode_steps() - 1 - stopped.expect("no fault");
    assert!(left > 0, "a fault at the very end");
    let pose = environments.pose(0);
    let off = (pose.x - start.x).powi(2) + (pose.y - start.y).powi(2);
    let standing = -turn.desired_rad_per_s.powi(2) * turn.k_rot - off * turn.k_pos;
    let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-9;
    let all = environments.left_out(0, 1.0);
    assert!(near(all, left as f64 * standing), "{all}");
    let discounted = environments.left_out(0, 0.9);
    assert!(near(discounted, standing * 0.9 * (1.0 - 0.9_f64.powi(left as i32)) / 0.1), "{discounted}");
    environments.reset(0, Some(2)).unwrap();
    environments.step(&[9]).unwrap();
    assert_eq!(environments.left_out(0, 1.0), 0.0);
}

#[test]
fn a_recorded_episode_has_a_snapshot_every_5_ms() {
    let mut environments = Environments::new(robot(), turning(), 2).unwrap();
    environments.record(1, true);
    environments.reset_each(&[Reset::Seed(1), Reset::Seed(1)]).unwrap();
    environments.step(&[7, 7]).unwrap();
    let times: Vec<f64> = environments.track(1).unwrap().snapshots.iter().map(|snapshot| snapshot.time_s).collect();
    assert_eq!(times.len(), 9);
    assert!(times.iter().enumerate().all(|(k, time)| (time - 0.005 * k as f64).abs() < 1e-9), "{times:?}");
    assert!(environments.track(0).is_none());
    assert_eq!(environments.pose(0), environments.pose(1), "recording changes nothing");
}

#[test]
fn what_is_wrong_is_said_by_name() {
    let wrong = |change: &dyn Fn(&mut Definition)| {
        let mut definition = turning();
        change(&mut definition);
        match Environments::new(robot(), definition, 1) {
            Err(TaskError::Definition { field, .. }) => field.to_owned(),
            Err(other) => other.to_string(),
            Ok(_) => "nothing".to_owned(),
        }
    };
    assert_eq!(wrong(&|_| ()), "nothing");
    assert_eq!(wrong(&|d| d.interval_s = f64::NAN), "interval_s");
    assert_eq!(wrong(&|d| d.interval_s = 0.00015), "interval_s");
    assert_eq!(wrong(&|d| d.frequencies_hz.clear()), "frequencies_hz");
    assert_eq!(wrong(&|d| d.oscillations_deg = vec![[-45.0, 105.0]]), "oscillations_deg");
    assert_eq!(wrong(&|d| d.parts = vec![Part::Walls]), "observe");
    assert_eq!(wrong(&|d| d.randomization.share = 2.0), "randomize");
    assert_eq!(wrong(&|d| d.task = Task::Turn(Turn { k_rot: f64::INFINITY, ..Turn::default() })), "k_rot");
    let unknown = Randomization { share: 0.5, paths: vec!["ground.frction".into()] };
    assert_eq!(wrong(&|d| d.randomization = unknown.clone()), "randomized");
    let refused = wrong(&|d| {
        d.drive = DriveKind::Motor;
        d.frequencies_hz = vec![7.0, 30.0];
    });
    assert!(refused.contains("30 Hz") && refused.contains("1.00 to 12.00"), "{refused}");
    let refused = wrong(&|d| {
        d.drive = DriveKind::Motor;
        d.oscillations_deg = vec![[10.0, 12.0]];
    });
    assert!(refused.contains("10°..12°") && refused.contains("to - from"), "{refused}");
    let mut environments = Environments::new(robot(), turning(), 2).unwrap();
    assert!(environments.step(&[1]).unwrap_err().to_string().contains("1 actions for 2"));
    assert!(environments.step(&[1, 10]).unwrap_err().to_string().contains("no action 10"));
}

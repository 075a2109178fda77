//! The blind tests' generator, tested by itself: a wrong truth would make every campaign worthless.

use std::f64::consts::{PI, TAU};

use rand::SeedableRng;
use rand_pcg::Pcg64;
use system_tests::blind::case::{self, Case, Category};
use system_tests::blind::excite::{FIT_RUNS, PLAN, TICKS_PER_S};
use system_tests::blind::files::Decimals;
use system_tests::blind::hidden::{Effect, Law, Shape};
use system_tests::blind::laws::{Battery, Bridge, Bristle, Gravity, Heating, TwoInertias, Weakening};
use system_tests::blind::measure::{self, Linear};
use system_tests::blind::rig::Rig;
use system_tests::blind::run::{simulate, simulate_with};
use system_tests::blind::sensing::Sensor;
use system_tests::blind::world::{Drive, World};

/// The thesis's linear motor, as little of a robot file as the generator reads.
const ROBOT: &str = "
[motor]
resistance_ohm = { value = 15.0 }
inductance_h = { value = 150e-6 }
torque_constant_nm_per_a = { value = 0.0209 }
rotor_inertia_kg_m2 = { value = 1.2e-6 }
viscous_nm_s_per_rad = { value = 1.12e-6 }
[load]
inertia_kg_m2 = { value = 0.0 }
[supply]
rail_v = { value = 5.0 }
";

const ON: Drive = Drive { duty: 1.0, enable: true };
const OFF: Drive = Drive { duty: 0.0, enable: false };

fn rig() -> Rig {
    Rig::nominal(ROBOT).expect("the file above is complete")
}

/// So heavy that it does not turn: what the winding sees is a resistor.
fn stalled() -> World {
    World::linear(Rig { inertia_kg_m2: 1e6, ..rig() })
}

fn draw(seed: u64, category: Category, only: Option<Effect>) -> Case {
    case::draw(seed, category, only, ROBOT).expect("the file above is complete")
}

fn quiet_sensor() -> Sensor {
    let mut sensor = Sensor::draw(&mut Pcg64::seed_from_u64(1));
    sensor.noise = 0.0;
    sensor.bits = 31;
    sensor.current_noise = None;
    sensor
}

#[test]
fn a_robot_file_that_lacks_a_number_is_refused_by_name() {
    let error = Rig::nominal(&ROBOT.replace("inductance_h", "inductance")).expect_err("no inductance");
    assert!(error.to_string().contains("motor.inductance_h"), "{error}");
}

#[test]
fn a_specimen_is_ten_to_thirty_per_cent_off_in_every_number() {
    let nominal = rig();
    for seed in 0..50 {
        let s = nominal.specimen((0.10, 0.30), &mut Pcg64::seed_from_u64(seed));
        for (is, says) in [
            (s.resistance_ohm, nominal.resistance_ohm),
            (s.inductance_h, nominal.inductance_h),
            (s.torque_constant, nominal.torque_constant),
            (s.inertia_kg_m2, nominal.inertia_kg_m2),
            (s.viscous, nominal.viscous),
        ] {
            let off = (is / says - 1.0).abs();
            assert!((0.10..=0.30).contains(&off), "seed {seed}: {is} against {says}");
        }
    }
}

/// The step response of the linear motor with its winding: two exponentials, from `J L ω'' + (J R + b L) ω' + (b R + K²) ω = K v`.
#[test]
fn step_response_follows_its_closed_form() {
    let rig = rig();
    let world = World::linear(rig);
    let (j, l, r, b, k) = (rig.inertia_kg_m2, rig.inductance_h, rig.resistance_ohm, rig.viscous, rig.torque_constant);
    let (a1, a0) = ((j * r + b * l) / (j * l), (b * r + k * k) / (j * l));
    let root = (a1 * a1 / 4.0 - a0).sqrt();
    // The slow root by Viète: the difference would cancel.
    let fast = -a1 / 2.0 - root;
    let slow = a0 / fast;
    let end = k * rig.rail_v / (b * r + k * k);
    // ω(0) = 0 and ω'(0) = 0.
    let (c_slow, c_fast) = (end * fast / (slow - fast), -end * slow / (slow - fast));
    let mut state = world.rest(0.3);
    for n in 1..=200 {
        world.hold(&mut state, ON, n == 1, 1e-3, 16e-6);
        let t = f64::from(n) * 1e-3;
        let speed = end + c_slow * (slow * t).exp() + c_fast * (fast * t).exp();
        let angle = 0.3 + end * t + c_slow / slow * ((slow * t).exp() - 1.0) + c_fast / fast * ((fast * t).exp() - 1.0);
        assert!(
            (world.shaft_speed(&state) - speed).abs() < 1e-5 * end,
            "speed at {t}: {} {speed}",
            world.shaft_speed(&state)
        );
        assert!(
            (world.shaft_angle(&state) - angle).abs() < 2e-5,
            "angle at {t}: {} {angle}",
            world.shaft_angle(&state)
        );
    }
}

#[test]
fn an_open_bridge_ends_the_current_and_the_shaft_coasts_exponentially() {
    let world = World::linear(rig());
    let mut state = world.rest(0.0);
    world.advance(&mut state, ON, 0.3, 20_000);
    world.advance(&mut state, OFF, 1e-3, 63);
    assert_eq!(state.current, 0.0);
    let (angle, speed) = (world.shaft_angle(&state), world.shaft_speed(&state));
    world.advance(&mut state, OFF, 0.7, 44_000);
    let time = world.rig.inertia_kg_m2 / world.rig.viscous;
    assert!((world.shaft_speed(&state) - speed * (-0.7 / time).exp()).abs() < 1e-8);
    assert!((world.shaft_angle(&state) - angle - speed * time * (1.0 - (-0.7 / time).exp())).abs() < 1e-7);
}

fn coulomb(level: f64) -> Bristle {
    Bristle {
        coulomb_nm: level,
        static_ratio: 1.0,
        stribeck_speed: 10.0,
        weakening: Weakening::Exponential(2.0),
        loss_driving: 0.0,
        loss_driven: 0.0,
        loss_power: 1.0,
        loss_reference_nm: 1.0,
        presliding: 5e-3,
        elastic_share: 0.3,
        micro_damping: 0.1,
        remembers_load: false,
        lean: 0.0,
        patch: None,
    }
}

/// Coasting against Coulomb and viscous friction: `ω = (ω₀ + c/b) e^(−t/τ) − c/b`, and it stops where that says, within
/// the bristle's length.
#[test]
fn coast_down_with_coulomb_friction_stops_where_it_should() {
    let mut world = World::linear(rig());
    let (c, b, j) = (3e-4, world.rig.viscous, world.rig.inertia_kg_m2);
    world.bristles = vec![coulomb(c)];
    let mut state = world.rest(0.0);
    world.advance(&mut state, ON, 0.4, 40_000);
    world.advance(&mut state, OFF, 1e-3, 100);
    let (angle, speed) = (world.shaft_angle(&state), world.shaft_speed(&state));
    let tau = j / b;
    let stop = tau * (1.0 + speed * b / c).ln();
    let reach = tau * speed - c / b * stop;
    world.advance(&mut state, OFF, 0.5 * stop, 30_000);
    let half = (speed + c / b) * (-0.5 * stop / tau).exp() - c / b;
    assert!((world.shaft_speed(&state) - half).abs() < 1e-4, "{} {half}", world.shaft_speed(&state));
    world.advance(&mut state, OFF, 0.5 * stop + 0.5, 90_000);
    assert!(world.shaft_speed(&state).abs() < 0.05, "{}", world.shaft_speed(&state));
    assert!(
        (world.shaft_angle(&state) - angle - reach).abs() < 2.0 * 5e-3,
        "{} {reach}",
        world.shaft_angle(&state) - angle
    );
}

#[test]
fn a_bristle_below_its_breakaway_is_a_spring_and_gives_everything_back() {
    let mut world = World::linear(rig());
    world.bristles = vec![Bristle { micro_damping: 0.0, ..coulomb(4e-4) }];
    world.rig.viscous = 0.0;
    // A fifth of the level, below the elastic share of 0.3 even at the overshoot's double.
    let duty = 0.12 * 4e-4 / world.rig.stall_torque();
    let mut state = world.rest(0.0);
    let drive = Drive { duty, enable: true };
    world.advance(&mut state, drive, 1.0, 100_000);
    let held = world.shaft_angle(&state);
    assert!((held - 0.12 * 5e-3).abs() < 2e-5, "{held}");
    world.advance(&mut state, Drive { duty: 0.0, enable: true }, 1.0, 100_000);
    assert!(world.shaft_angle(&state).abs() < 2e-5, "{}", world.shaft_angle(&state));
}

#[test]
fn stribeck_friction_holds_until_its_static_level_and_slides_at_its_lower_one() {
    let bristle = Bristle { static_ratio: 2.0, stribeck_speed: 1.0, ..coulomb(2e-4) };
    let mut world = World::linear(rig());
    world.bristles = vec![bristle];
    let drive = |level: f64| Drive { duty: level / world.rig.stall_torque(), enable: true };
    let mut state = world.rest(0.0);
    // Slowly up to 1.9 times the Coulomb level: no slip beyond presliding.
    for n in 0..190 {
        world.advance(&mut state, drive(2e-4 * 0.01 * f64::from(n)), 5e-3, 500);
    }
    assert!(world.shaft_angle(&state).abs() < 2.5 * 5e-3, "slipped to {}", world.shaft_angle(&state));
    // Over it: it breaks away. Then back to 1.5 times, where it would not have started but keeps sliding.
    world.advance(&mut state, drive(2e-4 * 3.0), 0.2, 20_000);
    let before = world.shaft_speed(&state);
    world.advance(&mut state, drive(2e-4 * 1.5), 0.5, 50_000);
    assert!(before > 10.0 && world.shaft_speed(&state) > 1.0, "{before} {}", world.shaft_speed(&state));
    assert!((bristle.level(1e3, 0.0, 0.0) - 2e-4).abs() < 1e-12);
}

#[test]
fn gears_lose_their_share_and_more_when_driven_back() {
    let gears = Bristle { coulomb_nm: 0.0, loss_driving: 0.1, loss_driven: 0.12, ..coulomb(0.0) };
    assert!((gears.level(50.0, 1e-3, 0.0) - 1e-4).abs() < 1e-9);
    assert!((gears.level(-50.0, 1e-3, 0.0) - 1.2e-4).abs() < 1e-9);
    assert_eq!(gears.level(50.0, 0.0, 0.0), 0.0);
}

#[test]
fn a_tilted_mass_without_losses_keeps_its_energy() {
    let mut world = World::linear(rig());
    world.rig.viscous = 0.0;
    let gravity =
        Gravity { torque_nm: 3e-4, direction: 0.4, second_share: 0.04, second_direction: 1.0, swings_out: 0.0 };
    world.gravity = Some(gravity);
    let mut state = world.rest(2.0);
    let energy = |angle: f64, speed: f64| {
        0.5 * world.rig.inertia_kg_m2 * speed * speed
            - gravity.torque_nm * ((angle - 0.4).cos() + 0.5 * 0.04 * (2.0 * (angle - 1.0)).cos())
    };
    let start = energy(2.0, 0.0);
    for _ in 0..2000 {
        world.advance(&mut state, OFF, 1e-3, 63);
        let now = energy(world.shaft_angle(&state), world.shaft_speed(&state));
        assert!((now - start).abs() < 1e-9 * gravity.torque_nm, "{now} {start}");
    }
}

#[test]
fn a_stalled_winding_behind_the_bridge_loses_the_bridges_drop() {
    let bridge = Bridge {
        transistors_v: 1.0,
        knee_a: 3e-3,
        transistor_ohm: 0.5,
        diode_v: 0.9,
        diode_log_v: 0.02,
        diode_ohm: 0.4,
    };
    for duty in [1.0, 0.5, -0.7] {
        let mut world = stalled();
        world.bridge = Some(bridge);
        let mut state = world.rest(0.0);
        world.advance(&mut state, Drive { duty, enable: true }, 0.01, 640);
        let volts = world.rig.resistance_ohm * state.current + bridge.drop(state.current, duty);
        assert!((volts - duty * world.rig.rail_v).abs() < 1e-6, "{volts}");
        assert!(state.current * duty > 0.0);
    }
    // Below the knee nothing much flows.
    let mut world = stalled();
    world.bridge = Some(bridge);
    let mut state = world.rest(0.0);
    world.advance(&mut state, Drive { duty: 0.05, enable: true }, 0.01, 640);
    assert!(state.current < 3e-3, "{}", state.current);
}

#[test]
fn a_battery_sags_at_once_and_then_by_two_relaxations() {
    let battery = Battery { series_ohm: 1.0, pair_ohm: [0.4, 0.8], pair_s: [0.05, 1.0] };
    let mut world = stalled();
    world.battery = Some(battery);
    let (v, r) = (world.rig.rail_v, world.rig.resistance_ohm);
    let mut state = world.rest(0.0);
    world.advance(&mut state, ON, 2e-4, 20);
    assert!((state.current - v / (r + 1.0)).abs() < 1e-4 * v / r, "{}", state.current);
    world.advance(&mut state, ON, 12.0, 400_000);
    assert!((state.current - v / (r + 2.2)).abs() < 1e-5 * v / r, "{}", state.current);
    // At half duty the battery carries half the current and the motor feels a quarter of the resistance.
    world.advance(&mut state, Drive { duty: 0.5, enable: true }, 12.0, 400_000);
    assert!((state.current - 0.5 * v / (r + 2.2 / 4.0)).abs() < 1e-5 * v / r, "{}", state.current);
}

#[test]
fn a_winding_warms_to_its_balance() {
    let mut world = stalled();
    world.heating = Some(Heating { kelvin_per_watt: 60.0, time_s: 0.5, housing_kelvin_per_watt: 0.0, housing_s: 40.0 });
    let mut state = world.rest(0.0);
    world.advance(&mut state, ON, 10.0, 500_000);
    // T = k V²/(R (1 + αT)).
    let cold = 60.0 * world.rig.rail_v.powi(2) / world.rig.resistance_ohm;
    let warm = (-1.0 + (1.0f64 + 4.0 * 0.0039 * cold).sqrt()) / (2.0 * 0.0039);
    let current = world.rig.rail_v / (world.rig.resistance_ohm * (1.0 + 0.0039 * warm));
    assert!((state.current - current).abs() < 1e-6, "{} {current}", state.current);
}

/// Play of ±0.05 rad, with teeth that come to bear over a length, rad.
fn play(soft_contact: f64) -> TwoInertias {
    TwoInertias {
        load_share: 0.4,
        stiffness: 2.0,
        damping: 1e-5,
        half_gap: 0.05,
        load_drag_share: 0.0,
        doubles_at: f64::INFINITY,
        soft_contact,
    }
}

#[test]
fn a_gap_lets_the_rotor_run_ahead_and_a_spring_follows() {
    let mut world = World::linear(rig());
    let gap = play(0.0);
    world.two = Some(gap);
    let mut state = world.rest(0.0);
    world.advance(&mut state, Drive { duty: 0.02, enable: true }, 5e-3, 500);
    assert_eq!(world.shaft_angle(&state), 0.0, "the load moves before the rotor has crossed the gap");
    world.advance(&mut state, ON, 0.5, 50_000);
    let speed = world.shaft_speed(&state);
    assert!((speed / world.rig.free_speed() - 1.0).abs() < 1e-2, "{speed}");
    let soft = TwoInertias { damping: 0.0, half_gap: 0.0, ..gap };
    assert_eq!(soft.torque(0.1, 0.0), 0.2);
}

#[test]
fn teeth_that_come_to_bear_pass_nothing_within_the_play_and_are_whole_beyond() {
    let teeth = play(0.004);
    for twist in [-0.05, -0.02, 0.0, 0.02, 0.05] {
        assert_eq!(teeth.torque(twist, 1.0), 0.0, "{twist} rad");
    }
    // The stiffness grows evenly from none to all of it: a parabola, and a line that is half that length behind.
    for (touched, into) in [(0.002, 0.0005), (0.004, 0.002), (0.01, 0.008)] {
        let twist = teeth.half_gap + touched;
        assert!((teeth.torque(twist, 0.0) - teeth.stiffness * into).abs() < 1e-12, "{touched} rad");
        assert_eq!(teeth.torque(-twist, 0.0), -teeth.torque(twist, 0.0));
    }
}

#[test]
fn half_the_step_changes_no_reading_by_a_twentieth_of_the_noise() {
    let mut rng = Pcg64::seed_from_u64(11);
    let first = Shape::draw(&mut rng);
    let both = |effect: &Effect| [Law::First, Law::Second].map(|law| (*effect, Shape { law, ..first }));
    for (effect, shape) in Effect::ALL.iter().flat_map(both) {
        let (mut world, mut sensor) = (World::linear(rig()), quiet_sensor());
        shape.apply(effect, 0.5f64.clamp(effect.bounds().0, effect.bounds().1), &mut world, &mut sensor);
        sensor.delay_jitter = 0.0;
        for plan in [PLAN[0], PLAN[4]] {
            let mut drives = system_tests::blind::excite::run(plan, TICKS_PER_S, &mut Pcg64::seed_from_u64(5));
            // Half of a run has steps and a coast-down, or a sweep, creeping and bursts.
            drives.truncate(4000);
            let run = |finer| {
                simulate_with(&world, &sensor, &drives, TICKS_PER_S, 0.2, &mut Pcg64::seed_from_u64(7), finer).clean
            };
            let (coarse, fine) = (run(1.0), run(0.5));
            // Over a rollout, as everything is judged: a stop a few µrad away shifts the rest of a run by as much.
            let change = |n: usize| (coarse[n] - coarse[n - 100]) - (fine[n] - fine[n - 100]);
            let square = (100..coarse.len()).map(|n| change(n).powi(2)).sum::<f64>();
            let rms = (square / (coarse.len() - 100) as f64).sqrt();
            // Impacts in a gap are chaotic: which bounce it is decides where in the gap (30 mrad wide) the load rests.
            let bound = if effect == Effect::Backlash { 3e-3 } else { 5e-5 };
            assert!(rms < bound, "{}, {:?}: {rms:.2e} rad RMS over 0.1 s", effect.name(), shape.law);
        }
    }
}

#[test]
fn the_measure_finds_a_linear_motor_again() {
    let specimen = rig().specimen((0.10, 0.30), &mut Pcg64::seed_from_u64(3));
    let world = World::linear(specimen);
    let sensor = quiet_sensor();
    let runs: Vec<_> = PLAN
        .iter()
        .enumerate()
        .map(|(n, plan)| {
            let mut rng = Pcg64::seed_from_u64(20 + n as u64);
            let drives = system_tests::blind::excite::run(plan, TICKS_PER_S, &mut rng);
            simulate(&world, &sensor, &drives, TICKS_PER_S, 0.0, &mut rng)
        })
        .collect();
    let nominal = rig();
    let rate = |rig: &Rig| (rig.torque_constant.powi(2) / rig.resistance_ohm + rig.viscous) / rig.inertia_kg_m2;
    let start = Linear { driven: rate(&nominal), open: nominal.viscous / nominal.inertia_kg_m2, gain: 0.0 };
    let found = measure::fit(&runs[..FIT_RUNS], start);
    let gain = specimen.stall_torque() / specimen.inertia_kg_m2;
    assert!((found.driven / rate(&specimen) - 1.0).abs() < 1e-3, "{found:?}");
    assert!((found.open / (specimen.viscous / specimen.inertia_kg_m2) - 1.0).abs() < 1e-2, "{found:?}");
    assert!((found.gain / gain - 1.0).abs() < 1e-3, "{found:?} {gain}");
    let size = measure::size(&runs, FIT_RUNS, start);
    assert!(size.misfit < 1.5e-4, "a linear motor has no misfit but its winding's lag: {size:?}");
}

#[test]
fn the_noise_floor_is_what_noise_and_quantisation_say() {
    for seed in 1..4 {
        let case = draw(seed, Category::Nothing, None);
        let step = TAU / f64::from(1u32 << case.sensor.bits);
        // Two of a hundred degrees of freedom go to the initial angle and speed.
        let expected = ((case.sensor.noise.powi(2) + step * step / 12.0) * 0.98).sqrt();
        assert!((case.size.floor / expected - 1.0).abs() < 0.02, "{} {expected}", case.size.floor);
        assert!(case.size.ratio() < 1.02, "nothing hidden, ratio {}", case.size.ratio());
    }
}

#[test]
fn sizes_reach_their_targets_within_the_bars_bounds() {
    for (seed, effect) in [(1, Effect::CoulombFriction), (2, Effect::DriverDrop), (3, Effect::SensorDelay)] {
        let case = draw(seed, Category::Hidden, Some(effect));
        assert_eq!(case.truth(), [effect.name()]);
        assert!((case.size.ratio() / case.target - 1.0).abs() < 0.021, "{} wanted {}", case.size.ratio(), case.target);
        assert!((1.5..=6.0).contains(&case.target));
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let texts = |seed| {
        let case = draw(seed, Category::Hidden, Some(Effect::GravityTilt));
        case.runs.iter().map(|run| run.csv(case.sensor.wrapped, Decimals::FULL)).collect::<Vec<_>>()
    };
    assert_eq!(texts(7), texts(7));
    assert_ne!(texts(7), texts(8));
}

#[test]
fn seeds_draw_every_effect_and_the_same_excitations_for_another_effect() {
    let a = draw(5, Category::Hidden, Some(Effect::GravityTilt));
    let b = draw(5, Category::Hidden, Some(Effect::SensorNonlinearity));
    assert_eq!(a.runs[2].drive, b.runs[2].drive);
    assert_eq!(a.world.rig, b.world.rig);
    for run in &a.runs {
        assert_eq!(run.t_s.len(), 8000);
        assert!(run.t_s.windows(2).all(|pair| pair[1] > pair[0]), "time must increase");
        assert!(run.drive.iter().all(|drive| drive.duty.abs() <= 1.0));
    }
    // Held-out runs are other waveforms.
    assert_ne!(a.runs[0].drive[..2000], a.runs[5].drive[..2000]);
}

#[test]
fn a_wrapped_file_stays_within_one_turn_and_holds_every_sample() {
    let case = draw(9, Category::Nothing, None);
    let run = &case.runs[0];
    let text = run.csv(true, Decimals::FULL);
    let mut lines = text.lines();
    assert!(lines.next().is_some_and(|header| header.starts_with("t_s,enable,duty,angle_rad")));
    for (n, line) in lines.enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |cell: usize| cells[cell].parse::<f64>().expect("a number");
        assert!((number(0) - run.t_s[n]).abs() < 1e-9);
        assert_eq!(number(2), run.drive[n].duty);
        assert!(number(3).abs() <= PI + 1e-6);
        let turns = (number(3) - run.reading[n]) / TAU;
        assert!((turns - turns.round()).abs() < 1e-6);
    }
}

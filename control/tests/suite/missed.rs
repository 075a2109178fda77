//! Missed control periods: the estimator bridges them in two steps, near where single steps would have led.

use control::Actuation;
use control::estimator::Estimator;

use crate::common::parameters;

/// A filter that turns at a speed (rad/s).
fn turning(speed: f32) -> Estimator {
    let p = parameters();
    let mut filter = Estimator::new(&p);
    filter.acquire(&p, 1.0, speed);
    filter
}

/// Where one prediction over `ticks` leads and where as many single ones do: deviations in angle (rad) and speed
/// (rad/s), and the ratios of the standard deviations of both.
fn deviation(speed: f32, actuation: Actuation, ticks: u16) -> [f32; 4] {
    let p = parameters();
    let (mut once, mut singly) = (turning(speed), turning(speed));
    once.predict(&p, &p.estimator.speed, actuation, ticks);
    for _ in 0..ticks {
        singly.predict(&p, &p.estimator.speed, actuation, 1);
    }
    let (a, b) = (once.estimate(), singly.estimate());
    let (c, d) = (once.covariance(), singly.covariance());
    let angle = control::angle::wrap(a.angle - b.angle).abs();
    [angle, (a.speed - b.speed).abs(), (c.angle / d.angle).sqrt(), (c.speed / d.speed).sqrt()]
}

#[test]
fn no_period_and_one_are_as_ever() {
    let p = parameters();
    let drive = Actuation { duty: 0.9, enable: true };
    let mut filter = turning(40.0);
    filter.predict(&p, &p.estimator.speed, drive, 0);
    assert_eq!(filter.estimate(), turning(40.0).estimate());
    assert!(deviation(40.0, drive, 1).iter().zip([0.0, 0.0, 1.0, 1.0]).all(|(is, ought)| (is - ought).abs() < 1e-6));
}

#[test]
fn many_missed_periods_lead_where_single_ones_do() {
    // The last two: from the highest speed into full reverse, and without current, where only friction brakes.
    let cases = [(44.0, 0.95), (-44.0, -0.95), (0.0, 1.0), (10.0, -1.0), (55.0, -1.0), (44.0, 0.0)];
    for (speed, duty) in cases {
        for enable in [true, false] {
            for ticks in 2..=20u16 {
                let [angle, rate, angle_spread, speed_spread] = deviation(speed, Actuation { duty, enable }, ticks);
                let what = format!(
                    "{speed} rad/s, {duty} {enable}, {ticks} periods: off by {angle} rad, {rate} rad/s, spreads {angle_spread}, {speed_spread}"
                );
                // Worst after 20: what the bridge's drop and the drag did meanwhile was taken as at the beginning.
                assert!(angle < 0.05 && rate < 5.0, "{what}");
                assert!((0.99..2.1).contains(&angle_spread) && (0.99..1.01).contains(&speed_spread), "{what}");
                if ticks <= 5 {
                    assert!(angle < 5e-4 && rate < 0.2, "{what}");
                }
            }
        }
    }
}

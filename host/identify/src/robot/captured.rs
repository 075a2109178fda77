//! Mean speeds of a robot that was filmed.

use common::wrap;

use crate::capture::Body;

/// How a robot lies in what was filmed of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// From the body's x axis to the robot's front, counter-clockwise seen from above, rad.
    pub ahead_rad: f64,
}

/// Frames so near in time are one.
const SAME_S: f64 = 1e-6;
/// Frames that say how the robot stood before it was filmed walking.
const AT_REST: usize = 5;

/// Longitudinal and lateral speed, mm/s, and yaw, °/s, between two times of a capture, in the frame in which the robot stood at its
/// start: as [`hal_sim::body::Track::speeds`] defines them, of the body in place of the modules' centroid. With `rear`, the front is
/// where the body lies from there, and the middle of both is what moves. None where it was lost or was not filmed so long.
#[must_use]
pub fn speeds(body: &Body, rear: Option<&Body>, placement: Placement, from_s: f64, to_s: f64) -> Option<[f64; 3]> {
    let poses = poses(body, rear, placement);
    let begun: Vec<f64> = poses.iter().take(AT_REST).map(|pose| pose.heading).collect();
    let first = *begun.first()?;
    let heading = first + begun.iter().map(|heading| wrap(heading - first)).sum::<f64>() / begun.len() as f64;
    let (from, to) = (at(&poses, from_s)?, at(&poses, to_s)?);
    let time = to_s - from_s;
    let (dx, dy) = ((to.x - from.x) / time, (to.y - from.y) / time);
    let (sin, cos) = heading.sin_cos();
    let within = poses.iter().filter(|pose| pose.t_s > from_s && pose.t_s < to_s);
    let headings: Vec<f64> =
        std::iter::once(from.heading).chain(within.map(|pose| pose.heading)).chain([to.heading]).collect();
    let turned: f64 = headings.windows(2).map(|pair| wrap(pair[1] - pair[0])).sum();
    Some([1e3 * (cos * dx + sin * dy), 1e3 * (cos * dy - sin * dx), (turned / time).to_degrees()])
}

/// Place in the plane, m, and heading, rad.
#[derive(Clone, Copy, Debug)]
struct Pose {
    t_s: f64,
    x: f64,
    y: f64,
    heading: f64,
}

/// Of the frames in which everything was seen.
fn poses(body: &Body, rear: Option<&Body>, placement: Placement) -> Vec<Pose> {
    let of = |k: usize| {
        let [x, y, _] = body.position[k];
        let (x, y, heading) = match rear {
            Some(rear) => {
                let of_body = body.t_s[k];
                // Times increase: the frame at this time is the first that is not before it.
                let k = rear.t_s.partition_point(|t| *t <= of_body - SAME_S);
                rear.t_s.get(k).filter(|t| (*t - of_body).abs() < SAME_S)?;
                let [rx, ry, _] = rear.position[k];
                (0.5 * (x + rx), 0.5 * (y + ry), (y - ry).atan2(x - rx))
            }
            None => (x, y, yaw(body.orientation[k]?) + placement.ahead_rad),
        };
        (x.is_finite() && y.is_finite() && heading.is_finite()).then_some(Pose { t_s: body.t_s[k], x, y, heading })
    };
    (0..body.t_s.len()).filter_map(of).collect()
}

/// Of the x axis, seen from above.
fn yaw([w, x, y, z]: [f64; 4]) -> f64 {
    (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
}

/// Between the two frames around a time.
fn at(poses: &[Pose], t_s: f64) -> Option<Pose> {
    /// Half a frame at 50 Hz: a capture may end so much before the time.
    const SLACK_S: f64 = 0.01;
    let after = poses.iter().position(|pose| pose.t_s >= t_s);
    let last = poses.last().filter(|last| t_s - last.t_s <= SLACK_S);
    let after = match after {
        Some(after) => after,
        None => return last.copied(),
    };
    let b = poses[after];
    let Some(before) = after.checked_sub(1) else { return (b.t_s - t_s <= SLACK_S).then_some(b) };
    let a = poses[before];
    let share = (t_s - a.t_s) / (b.t_s - a.t_s);
    let between = |a: f64, b: f64| a + share * (b - a);
    let heading = a.heading + share * wrap(b.heading - a.heading);
    Some(Pose { t_s, x: between(a.x, b.x), y: between(a.y, b.y), heading })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body that goes 10 mm/s ahead and 3 mm/s to the left of where it faces at first, 40° from the room's x, and turns by 7 °/s;
    /// filmed at 120 Hz with every fifth frame lost.
    fn body(offset: f64) -> Body {
        let (sin, cos) = 40f64.to_radians().sin_cos();
        let mut body = Body { name: "robot".into(), t_s: vec![], position: vec![], orientation: vec![] };
        for k in 0..360 {
            let t = f64::from(k) / 120.0;
            let (ahead, left) = (0.010 * t, 0.003 * t);
            let half = 0.5 * ((40.0 + 7.0 * t).to_radians() - offset);
            body.t_s.push(t);
            let place = [cos * ahead - sin * left, sin * ahead + cos * left, 0.02];
            body.position.push(if k % 5 == 3 { [f64::NAN; 3] } else { place });
            body.orientation.push((k % 5 != 3).then_some([half.cos(), 0.0, 0.0, half.sin()]));
        }
        body
    }

    #[test]
    fn speeds_are_in_the_frame_of_the_start() {
        for offset in [0.0, 3.0] {
            let found = speeds(&body(offset), None, Placement { ahead_rad: offset }, 1.0, 2.0).unwrap();
            for (found, truth) in found.iter().zip([10.0, 3.0, 7.0]) {
                // The heading of the first frames is that of the start but for 0.1°.
                assert!((found - truth).abs() < 0.03, "{found}, truth {truth}");
            }
        }
        assert_eq!(speeds(&body(0.0), None, Placement::default(), 1.0, 4.0), None);
    }

    #[test]
    fn two_points_have_a_heading() {
        let front = body(0.0);
        let mut rear = front.clone();
        for (k, place) in rear.position.iter_mut().enumerate() {
            let heading = (40.0 + 7.0 * rear.t_s[k]).to_radians();
            *place = [place[0] - 0.1 * heading.cos(), place[1] - 0.1 * heading.sin(), 0.0];
            rear.orientation[k] = None;
        }
        let [ahead, left, yaw] = speeds(&front, Some(&rear), Placement::default(), 1.0, 2.0).unwrap();
        // The middle of both lies 50 mm behind the front one, and swings as they turn: by its chord's velocity.
        let (a, b) = (7f64.to_radians(), 14f64.to_radians());
        assert!((ahead - (10.0 + 50.0 * (a.cos() - b.cos()))).abs() < 0.03, "{ahead}");
        assert!((left - (3.0 - 50.0 * (b.sin() - a.sin()))).abs() < 0.03, "{left}");
        assert!((yaw - 7.0).abs() < 1e-6, "{yaw}");
    }
}

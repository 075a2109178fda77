//! Runs as they were read through the sensor's blind arc: which of the readings are none depends on where a model says that the
//! shaft is.

use effects::Id;
use rayon::prelude::*;
use robot_file::robot::Robot;

use super::Session;
use crate::blind_arc::{self, BlindArc};
use crate::fit::{self, Fit, Until};
use crate::track::Track;
use crate::{DiagnoseError, Options};

/// Times that runs are read about an effect, with what was fitted to the last reading, at most.
const READ_ABOUT: usize = 3;
/// Rounds of a fit of an effect alone at most.
const ROUNDS_ADDED: usize = 15;

/// The runs as they were read with a blind arc.
#[derive(Clone)]
pub struct ArcRead {
    /// Where it lies.
    arc: BlindArc,
    /// Runs to fit on and to judge by, with the readings from the arc.
    pub(super) read: [Vec<Track>; 2],
    /// What the model leaves unexplained that said which readings these are.
    unexplained: f64,
}

impl ArcRead {
    /// Nothing is dropped yet; `None` of a sensor without an arc.
    pub fn of(robot: &Robot, fit: &[Track], held_out: &[Track]) -> Option<Self> {
        let read = || [fit.to_vec(), held_out.to_vec()];
        BlindArc::of(robot).map(|arc| Self { arc, read: read(), unexplained: f64::INFINITY })
    }
}

impl Session {
    /// The runs to fit on and to judge by without what the sensor shows in its blind arc as the model of a fit follows them, and
    /// how many readings that leaves unexplained; `None` without an arc.
    fn read_through_arc(&self, fit: &Fit) -> Option<([Vec<Track>; 2], f64)> {
        let arc = self.arc.as_ref()?;
        let plant = fit.plant(&self.model);
        let mut read = arc.read.clone();
        let unexplained = read
            .par_iter_mut()
            .flatten()
            .filter(|track| track.has_blind_arc)
            .map(|track| blind_arc::drop_blind(track, &plant, self.horizon_s, arc.arc))
            .sum();
        Some((read, unexplained))
    }

    /// The session as it would be with the runs read about an effect, and the fit with it, where that explains more readings: of
    /// some effects the one that explains most at one of its starting points, with the file's own numbers. Where the shaft was
    /// lost in the blind arc for want of an effect, every fit is to wrong readings, and none leads back.
    pub fn read_about_effects(&self, effects: &[Id], options: &Options) -> Result<Option<(Self, Fit)>, DiagnoseError> {
        let Some(arc) = &self.arc else { return Ok(None) };
        let starts = |&effect: &Id| self.all_starts(&[effect]).into_iter().map(move |start| (effect, start));
        let begun: Vec<(Id, usize)> = effects.iter().flat_map(starts).collect();
        let read = |(effect, start): (Id, usize)| {
            let fit = Fit::begin(&self.model, &[effect], start, self.fit_guess.clone());
            self.read_through_arc(&fit).map(|(_, unexplained)| (fit, unexplained))
        };
        let best = begun.into_par_iter().filter_map(read).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((mut fit, _)) = best else { return Ok(None) };
        let mut other = self.clone();
        other.forget_arc();
        for _ in 0..READ_ABOUT {
            if !other.drop_blind(&fit, options)? {
                break;
            }
            let alone = |added| fit::fit(&other.model, &other.data(), added, Until::settled(ROUNDS_ADDED, 1e-3));
            fit = other.suited(other.begun_anew(&fit), &other.unfitted, alone);
        }
        let explains_more = other.arc.as_ref().is_some_and(|other| other.unexplained < arc.unexplained);
        Ok(explains_more.then_some((other, fit)))
    }

    /// What is read next through the arc is taken, whatever it leaves unexplained.
    fn forget_arc(&mut self) {
        if let Some(arc) = &mut self.arc {
            arc.unexplained = f64::INFINITY;
        }
    }

    /// Drops what the sensor shows in its blind arc, as the model of a fit follows the runs, where that explains more of what
    /// was read than the model that was followed before, and leaves enough. Whether it does; the baseline is then to be
    /// settled anew.
    pub fn drop_blind(&mut self, fit: &Fit, options: &Options) -> Result<bool, DiagnoseError> {
        let Some((read, unexplained)) = self.read_through_arc(fit) else { return Ok(false) };
        let Some(arc) = self.arc.as_mut().filter(|arc| unexplained < arc.unexplained) else { return Ok(false) };
        let before = std::mem::replace(&mut arc.unexplained, unexplained);
        let [fit, held_out] = read;
        let kept = [std::mem::replace(&mut self.fit, fit), std::mem::replace(&mut self.held_out, held_out)];
        if self.cut(options).is_err() {
            // A model that has lost the shaft drops too much.
            [self.fit, self.held_out] = kept;
            if let Some(arc) = &mut self.arc {
                arc.unexplained = before;
            }
            self.cut(options)?;
            return Ok(false);
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use control::Actuation;
    use effects::DriverDrop;
    use hal_sim::SimulatedRobot;
    use recording::{AngleReading, Drive, Recording};
    use robot_file::robot::Quantity;

    use super::*;
    use crate::tests::bench;

    /// A run of a simulated robot with a potentiometer as its sensor reads it: duties from times (s) on, `None` with the bridge open.
    fn scripted(robot: &Robot, script: &[(f64, Option<f64>)], seconds: f64, seed: u64) -> Recording {
        let mut world = SimulatedRobot::new(robot, seed);
        let tick_s = world.tick_s();
        let mut out = Recording::default();
        let (mut duties, mut codes) = (Vec::new(), Vec::new());
        for tick in 0..(seconds / tick_s) as usize {
            let t_s = tick as f64 * tick_s;
            let duty = script.iter().take_while(|(from, _)| *from <= t_s).last().and_then(|(_, duty)| *duty);
            out.t_s.push(t_s);
            out.enable.push(duty.is_some());
            duties.push(duty.unwrap_or(0.0));
            codes.push(Some(world.sample().angle.0));
            world.advance(Actuation { duty: duty.unwrap_or(0.0) as f32, enable: duty.is_some() });
        }
        out.angle = AngleReading::Adc(codes);
        out.drive = Drive::Duty(duties);
        out
    }

    /// Steps of the duty either way, with the bridge open now and then: time from which on, s, and duty.
    const STEPS: [(f64, Option<f64>); 16] = [
        (0.0, None),
        (0.05, Some(-0.419)),
        (0.815, Some(-0.204)),
        (1.371, Some(-0.331)),
        (1.739, Some(-0.402)),
        (2.632, Some(-0.211)),
        (3.386, Some(0.407)),
        (3.512, Some(0.216)),
        (3.707, Some(0.329)),
        (4.527, Some(-0.343)),
        (4.738, Some(0.425)),
        (6.038, Some(0.217)),
        (6.202, Some(-0.443)),
        (7.17, None),
        (7.758, Some(-0.203)),
        (8.05, None),
    ];

    /// The bench with the robot's potentiometer, as its file has it and as it is, with a driver that keeps 0.8 V for itself.
    fn bench_with_a_drop() -> (Robot, Robot) {
        let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap();
        let file = Robot { sensor: robot.sensor, ..bench() };
        let mut truth = file.clone();
        let quantity = |value| Quantity { value, low: value, high: value, source: "test".into() };
        truth.effects.insert::<DriverDrop>([0.8, 0.0, 0.0].map(quantity).to_vec());
        (file, truth)
    }

    #[test]
    fn a_shaft_that_was_lost_in_the_arc_is_found_about_the_effect_that_it_lacks() {
        let (file, truth) = bench_with_a_drop();
        let runs: Vec<Recording> = (1..3).map(|seed| scripted(&truth, &STEPS, 8.3, seed)).collect();
        let options = Options::default();
        let (session, _) = Session::open(&file, &runs[..1], &runs[1..], &options).unwrap();
        let effects = ["coulomb_friction", "driver_drop", "driver_deadband"].map(|name| Id::of(name).unwrap());
        let (found, fit) = session.read_about_effects(&effects, &options).unwrap().unwrap();
        let unexplained = |session: &Session| session.arc.as_ref().unwrap().unexplained;
        let (before, after) = (unexplained(&session), unexplained(&found));
        assert!(after < 0.2 * before, "{after} of {before}");
        assert_eq!(fit.effects, [effects[1]]);
        let drop_v = found.model.values(&fit.effects, |number| fit.value(number))[&effects[1]][0];
        assert!((drop_v - 0.8).abs() < 0.03, "{drop_v} V");
    }
}

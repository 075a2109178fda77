//! One diagnosis at work: the runs made ready, the noise floor, and fits and judgements of models on them.

use std::ops::Range;
use std::path::Path;

use effects::{Effect, GravityTilt, Id};
use robot_file::robot::Robot;

use super::current::{self, current_noise};
use super::fit::{self, Data, Fit, Until};
use super::floor::{self, Scatter};
use super::ground;
use super::held;
use super::nominal::FileModel;
use super::probe::Shape;
use super::repeats;
use super::rollout::{self, Rolled, Starts};
use super::track::{Cut, Segment, Track};
use super::{DiagnoseError, Options};
use arc::ArcRead;
use recording::Recording;

mod arc;

/// Rollouts that a set of runs is cut into at most; long recordings are thinned evenly.
const MOST_ROLLOUTS: usize = 1500;
/// They are followed for this long in all at most, s: slowly sampled runs have long rollouts.
const MOST_FOLLOWED_S: f64 = 1000.0;
/// Readings further apart than this, s, and than this many of the file's time constants, follow no shaft.
const SLOWEST_READINGS: (f64, f64) = (0.1, 2.0);
/// A noise estimate below this is no noise but a recording of a simulation; the floor stays above it, rad.
const LEAST_NOISE: f64 = 1e-6;

/// Runs, model and floor.
#[derive(Clone)]
pub struct Session {
    /// The file's model.
    pub model: FileModel,
    /// Runs to fit on.
    pub fit: Vec<Track>,
    /// Runs to judge by.
    pub held_out: Vec<Track>,
    /// Length of a rollout, s.
    pub horizon_s: f64,
    /// Mean square of the held-out readings' noise, rad².
    pub noise: f64,
    /// The same of the fit runs, rad².
    pub fit_noise: f64,
    /// The file's own numbers, with the starts that suit them.
    pub unfitted: Fit,
    /// The sensor's blind arc, where it has one.
    arc: Option<ArcRead>,
    /// Noise of the current reading, A.
    sigma_current: Option<f64>,
    /// First guesses of the held-out starts.
    guesses: Vec<Starts>,
    fit_guess: Starts,
    /// A third of the fit rollouts or less, in blocks, for a first look.
    coarse: Vec<Track>,
    /// Which segments those are.
    coarse_segments: Vec<Vec<usize>>,
}

/// A look from a further starting point is given up where its cost stays above this many times the best one's.
const FAR: f64 = 4.0;
/// A fit whose cost will stay above this many times another one's is beaten by it.
pub const BEATEN: f64 = 1.1;
/// A fit in small steps takes so many rounds, or ends where one brings less than this share of the cost.
const POLISH_ROUNDS: usize = 6;
const POLISH_TOLERANCE: f64 = 1e-6;
/// Rollouts of a block of the coarse set, and how many blocks there are at least to each that is taken.
const COARSE: (usize, usize) = (5, 3);
/// Readings that are enough for a look.
const ENOUGH_READINGS: f64 = 8000.0;

/// How a model does on the held-out runs.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// Rollouts by track.
    pub rolled: Vec<Rolled>,
    /// Squared error and degrees of freedom of each rollout, all tracks end to end.
    pub errors: Vec<(f64, f64)>,
    /// The starts.
    pub starts: Starts,
}

impl Evaluation {
    /// Mean square error, rad².
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        mean(self.errors.iter().copied())
    }

    /// The same if no rollout left more than a mean square, rad²: how much of the runs is followed, and not how far off the rest is.
    #[must_use]
    pub fn capped_square(&self, most: f64) -> f64 {
        mean(self.errors.iter().map(|&(error, freedom)| (error.min(most * freedom), freedom)))
    }

    /// Readings that were judged by, less the starts' degrees of freedom.
    #[must_use]
    pub fn readings(&self) -> f64 {
        self.errors.iter().map(|(_, freedom)| freedom).sum()
    }
}

/// Mean of squared errors over all their degrees of freedom.
fn mean(errors: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (sum, freedom) = errors.fold((0.0, 0.0), |total, one| (total.0 + one.0, total.1 + one.1));
    sum / freedom.max(1.0)
}

/// Files of one name, as every simulated run has, are called by their directories too.
fn name_apart<'a>(runs: impl Iterator<Item = (&'a mut Track, &'a Recording)>) {
    let mut runs: Vec<(&mut Track, &Recording)> = runs.collect();
    let names: Vec<String> = runs.iter().map(|(track, _)| track.name.clone()).collect();
    for (track, recording) in &mut runs {
        let is_shared = names.iter().filter(|name| **name == track.name).count() > 1;
        let directory = recording.path.parent().and_then(Path::file_name);
        if let (true, Some(directory)) = (is_shared, directory) {
            track.name = format!("{}/{}", directory.to_string_lossy(), track.name);
        }
    }
}

/// Runs that are too short, or in which too little is known.
fn too_few(tracks: &[Track], horizon_s: f64) -> DiagnoseError {
    let (with, help) = if tracks.iter().any(|track| track.pull_unknown.contains(&true)) {
        (
            "in which the readings say how the walking body pulls at the shaft",
            "record longer runs, or runs at other frequencies, at which the robot's steps are alike",
        )
    } else {
        ("with enough angle readings", "record longer runs; the angle must be there most of the time")
    };
    DiagnoseError::Recording {
        run: tracks[0].name.clone(),
        problem: format!("no five rollouts of {horizon_s:.2} s {with}"),
        help: help.to_owned(),
    }
}

impl Session {
    /// Makes runs ready, refits the file's own numbers, and measures the floor; of a robot that walks, without its body.
    pub fn open(
        robot: &Robot,
        fit: &[Recording],
        held_out: &[Recording],
        options: &Options,
    ) -> Result<(Self, Fit), DiagnoseError> {
        if fit.is_empty() {
            return Err(DiagnoseError::NothingToFit);
        }
        if held_out.is_empty() {
            return Err(DiagnoseError::NothingHeldOut);
        }
        let tracks = |recordings: &[Recording], from: usize| {
            let made: Result<Vec<Track>, _> =
                recordings.iter().enumerate().map(|(i, one)| Track::new(robot, one, from + i)).collect();
            made
        };
        // On the ground gravity pulls at the eccentric through the body that leans, as the simulation has it.
        let on_ground = fit.iter().chain(held_out).any(|one| one.pose.iter().any(Option::is_some));
        let mut level = robot.clone();
        if on_ground {
            level.effects.remove(GravityTilt::SPEC.name);
        }
        let (fitted, judged) = (tracks(fit, 0)?, tracks(held_out, fit.len())?);
        // Held readings are not there any more.
        if fitted.iter().chain(&judged).any(|track| track.repeats.are_held()) {
            level.effects.remove(held::NAME);
        }
        let model = FileModel::new(&level).with_repeats(repeats::most(&fitted));
        let mut session = Self {
            unfitted: Fit::begin(&model, &[], 0, Vec::new()),
            model,
            fit: fitted,
            held_out: judged,
            horizon_s: 0.0,
            noise: 0.0,
            fit_noise: 0.0,
            sigma_current: None,
            arc: None,
            guesses: Vec::new(),
            fit_guess: Vec::new(),
            coarse: Vec::new(),
            coarse_segments: Vec::new(),
        };
        name_apart(session.fit.iter_mut().chain(&mut session.held_out).zip(fit.iter().chain(held_out)));
        session.check_sampling()?;
        session.cut(options)?;
        let has_arc = session.fit.iter().chain(&session.held_out).any(|track| track.has_blind_arc);
        session.arc = ArcRead::of(robot, &session.fit, &session.held_out).filter(|_| has_arc);
        let file = Fit::begin(&session.model, &[], 0, Vec::new());
        let changed = session.drop_blind(&file, options)?;
        let mut baseline = session.settle(&file);
        if changed && session.drop_blind(&baseline, options)? {
            baseline = session.settle(&baseline);
        }
        Ok((session, baseline))
    }

    /// Refuses runs whose readings say nothing of how the shaft moves in between.
    fn check_sampling(&self) -> Result<(), DiagnoseError> {
        let (least, time_constant_s) = (SLOWEST_READINGS.0, self.model.time_constant_s);
        let slowest = least.max(SLOWEST_READINGS.1 * time_constant_s);
        let Some(slow) = self.fit.iter().chain(&self.held_out).find(|track| track.usual_step() > slowest) else {
            return Ok(());
        };
        Err(DiagnoseError::Recording {
            run: slow.name.clone(),
            problem: format!(
                "its readings are {:.2} s apart, and the robot file's shaft takes up its speed in {time_constant_s:.3} s",
                slow.usual_step()
            ),
            help: "t_s is in seconds: is the file's in ms? Record at least ten readings in each 0.1 s".to_owned(),
        })
    }

    /// Whether a robot on the ground was recorded.
    #[must_use]
    pub fn on_ground(&self) -> bool {
        self.fit.iter().chain(&self.held_out).any(|track| track.first_pose.is_some())
    }

    /// Whether an effect on the shaft is the body's here, which the file has: on the ground gravity pulls at the eccentric through it.
    #[must_use]
    pub fn is_of_the_body(&self, effect: Id) -> bool {
        self.on_ground() && effect.name() == GravityTilt::SPEC.name
    }

    /// Whether a mean square (rad²) that is left of the held-out runs asks for an effect. A walking body that is not followed to the last
    /// may leave a little, and what it does to the shaft is no noise to a screen.
    #[must_use]
    pub fn is_to_be_explained(&self, left: f64) -> bool {
        !self.on_ground() || !ground::is_left_by_the_body(self.noise, left)
    }

    /// Takes over where a body's pull has been found and where it is unknown, into the runs as they were read too.
    pub fn take_pull(&mut self, options: &Options) -> Result<(), DiagnoseError> {
        self.cut(options)?;
        let known = self.fit.iter().chain(&self.held_out);
        let read = self.arc.iter_mut().flat_map(|arc| arc.read.iter_mut().flatten());
        for (track, known) in read.zip(known) {
            track.load_torque.clone_from(&known.load_torque);
            track.pull_unknown.clone_from(&known.pull_unknown);
        }
        Ok(())
    }

    fn cut(&mut self, options: &Options) -> Result<(), DiagnoseError> {
        let all = || self.fit.iter().chain(&self.held_out);
        let usual = all().map(Track::usual_step).fold(0.0, f64::max);
        self.horizon_s = options.horizon_s.unwrap_or_else(|| self.model.usual_horizon(usual));
        let most_rollouts = MOST_ROLLOUTS.min((MOST_FOLLOWED_S / self.horizon_s) as usize);
        for tracks in [&mut self.fit, &mut self.held_out] {
            let most_segments = (most_rollouts / tracks.len()).max(10);
            for track in tracks.iter_mut() {
                track.cut(Cut { horizon_s: self.horizon_s, most_segments });
            }
            if tracks.iter().map(|track| track.segments.len()).sum::<usize>() < 5 {
                return Err(too_few(tracks, self.horizon_s));
            }
        }
        let window = self.horizon_s * 0.25;
        let guess = |tracks: &[Track], window| tracks.iter().map(|track| rollout::guess(track, window)).collect();
        self.fit_guess = guess(&self.fit, window);
        self.guesses = vec![guess(&self.held_out, window), guess(&self.held_out, self.horizon_s)];
        Ok(())
    }

    /// Whether a current was read that sets the scale of torques.
    #[must_use]
    pub fn has_current(&self) -> bool {
        self.sigma_current.is_some()
    }

    /// Refits the file's numbers, from where a fit has them, and measures the noise about the outcome, in turns: neither
    /// needs the other to be good.
    pub fn settle(&mut self, from: &Fit) -> Fit {
        self.guesses.truncate(2);
        self.sigma_current = current_noise(&self.fit);
        self.unfitted = Fit::begin(&self.model, &[], 0, self.fit_guess.clone());
        let _ = rollout::refine_all(&self.unfitted.plant(&self.model), &self.fit, &mut self.unfitted.starts, &[], 2);
        let mut fit = Fit::begin(&self.model, &from.effects, 0, self.unfitted.starts.clone());
        fit.take_over(from);
        self.fit_noise = self.measure(&fit, true);
        fit = fit::fit(&self.model, &self.data(), fit, Until::settled(6, 1e-3));
        self.fit_noise = self.measure(&fit, true);
        self.trust_current(&fit);
        fit = fit::fit(&self.model, &self.data(), fit, Until::settled(25, 1e-5));
        let starts = self.guesses[0].clone();
        self.guesses.push(starts);
        self.noise = self.measure(&fit, false);
        self.thin();
        fit
    }

    /// The current is trusted as far as the refitted model agrees with it, and a third of that: what is wrong with it
    /// is not new in every sample, and it is only there to set the scale of the torques.
    fn trust_current(&mut self, fit: &Fit) {
        let Some(noise) = self.sigma_current else { return };
        let plant = fit.plant(&self.model);
        let mut sizes: Vec<f64> = Vec::new();
        for (track, starts) in self.fit.iter().zip(&fit.starts).filter(|(track, _)| !track.current.is_empty()) {
            let rolled = rollout::rollout(&plant, track, starts, None, true);
            sizes.extend(current::current_residuals(track, &rolled).map(|(_, left)| left.abs()));
        }
        self.sigma_current = Some(3.0 * noise.max(1.4826 * common::median(&mut sizes).unwrap_or(0.0)));
    }

    /// Measures the noise about a fit's rollouts, and marks spikes. `fitted`: on the fit runs, else on the held-out ones.
    pub fn measure(&mut self, fit: &Fit, fitted: bool) -> f64 {
        let plant = fit.plant(&self.model);
        let (tracks, mut starts) =
            if fitted { (&mut self.fit, fit.starts.clone()) } else { (&mut self.held_out, self.guesses[0].clone()) };
        for track in tracks.iter_mut() {
            for (weight, angle) in track.weight.iter_mut().zip(&track.angle) {
                *weight = f64::from(angle.is_finite());
            }
        }
        let rolled = rollout::refine_all(&plant, tracks, &mut starts, &[], if fitted { 1 } else { 3 });
        let scatters: Vec<Scatter> =
            tracks.iter().zip(&rolled).map(|(track, rolled)| floor::scatter(track, &rolled.0)).collect();
        for (track, scatter) in tracks.iter_mut().zip(&scatters) {
            for &spike in &scatter.spikes {
                track.weight[spike] = 0.0;
            }
        }
        floor_of(tracks, &scatters)
    }

    /// The numbers of a fit to runs that have since been cut anew, with first guesses of the starts.
    #[must_use]
    pub fn begun_anew(&self, fit: &Fit) -> Fit {
        Fit { starts: self.fit_guess.clone(), ..fit.clone() }
    }

    /// The same for a model with some effects of it.
    #[must_use]
    pub fn begun_from(&self, effects: &[Id], fit: &Fit) -> Fit {
        let mut begun = Fit::begin(&self.model, effects, 0, self.fit_guess.clone());
        begun.take_over(fit);
        begun
    }

    /// Lowers the noise of the fit runs to what is left about a better model than the settled one, which may have lost the
    /// shaft and taken much for noise.
    pub fn lower_fit_noise(&mut self, fit: &Fit) {
        let mut fit = self.begun_anew(fit);
        let _ = rollout::refine_all(&fit.plant(&self.model), &self.fit, &mut fit.starts, &[], 2);
        let before = self.fit_noise;
        self.fit_noise = self.measure(&fit, true).min(before);
        self.thin();
    }

    /// Parts of the held-out rollouts that are to judge each other: runs, or halves of the only one.
    #[must_use]
    pub fn parts(&self) -> Vec<Range<usize>> {
        let mut end = 0;
        let by_run = self.held_out.iter().map(|track| {
            let first = end;
            end += track.segments.len();
            first..end
        });
        let parts: Vec<Range<usize>> = by_run.collect();
        if parts.len() > 1 { parts } else { vec![0..end / 2, end / 2..end] }
    }

    /// What fits are made to.
    #[must_use]
    pub fn data(&self) -> Data<'_> {
        Data { tracks: &self.fit, sigma: self.fit_noise.sqrt(), sigma_current: self.sigma_current }
    }

    /// Sets a third of the fit rollouts apart, or fewer where those are enough.
    fn thin(&mut self) {
        let readings: f64 = self.fit.iter().map(Track::readings).sum();
        let (block, least) = COARSE;
        let stride = least.max((readings / ENOUGH_READINGS) as usize);
        self.coarse.clear();
        self.coarse_segments.clear();
        for (index, track) in self.fit.iter().enumerate() {
            // Blocks are staggered from run to run, so that the same part of each run is not always missing.
            let taken: Vec<usize> = (0..track.segments.len()).filter(|i| (i / block + index) % stride == 0).collect();
            let mut thinned = track.clone();
            thinned.segments = taken
                .iter()
                .map(|&i| {
                    let follows = i > 0 && taken.binary_search(&(i - 1)).is_ok();
                    Segment { linked: track.segments[i].linked && follows, ..track.segments[i] }
                })
                .collect();
            self.coarse.push(thinned);
            self.coarse_segments.push(taken);
        }
    }

    /// A first look at the file's model with further effects: a few rounds on a third of the rollouts, beginning where
    /// another fit ended, from some of the effects' starting points. The starts of the outcome are those of `from`.
    #[must_use]
    pub fn look(&self, effects: &[Id], from: &Fit, starts: &[usize], (rounds, least): (usize, f64)) -> Fit {
        self.best_of_starts(effects, from, starts, |begun, best| self.look_on(begun, from, rounds, best.min(least)))
    }

    /// The same with a curve over one coordinate beside what a fit has.
    #[must_use]
    pub fn look_with_curve(&self, from: &Fit, shape: Shape, rounds: usize) -> Fit {
        let begun = Fit { starts: self.coarse_starts(from), ..from.with_curve(shape) };
        self.look_on(begun, from, rounds, f64::INFINITY)
    }

    /// The cost of a model on the rollouts of a first look.
    #[must_use]
    pub fn coarse_cost(&self, fit: &Fit) -> f64 {
        let data = Data { tracks: &self.coarse, ..self.data() };
        fit::cost_of(&self.model, &data, &Fit { starts: self.coarse_starts(fit), ..fit.clone() })
    }

    /// All starting points of effects.
    #[must_use]
    pub fn all_starts(&self, effects: &[Id]) -> Vec<usize> {
        (0..self.model.starts(effects)).collect()
    }

    /// A first look that begins at another fit's numbers, the file's own for one: they stay there until those of the effects suit them.
    /// Without the effect they may have been refitted to where no step leads back from.
    #[must_use]
    pub fn look_suited(&self, effects: &[Id], from: &Fit, starts: &[usize], (rounds, least): (usize, f64)) -> Fit {
        self.best_of_starts(effects, from, starts, |begun, best| {
            let suited = self.suited(begun, from, |added| self.look_on(added, from, rounds, f64::INFINITY));
            self.look_on(suited, from, rounds, best.min(least))
        })
    }

    /// The best of what comes of a fit from each starting point of effects, with the other numbers from another fit. A
    /// fit is told the least cost so far.
    fn best_of_starts(&self, effects: &[Id], from: &Fit, starts: &[usize], fit: impl Fn(Fit, f64) -> Fit) -> Fit {
        let mut best: Option<Fit> = None;
        let mut tried: Vec<Vec<f64>> = Vec::new();
        for &start in starts {
            let mut begun = Fit::begin(&self.model, effects, start, self.coarse_starts(from));
            begun.take_over(from);
            // What the other fit has of the effects is the same from every starting point.
            if tried.contains(&begun.coordinates) {
                continue;
            }
            tried.push(begun.coordinates.clone());
            let one = fit(begun, best.as_ref().map_or(f64::INFINITY, |best| best.cost));
            if best.as_ref().is_none_or(|best| one.cost < best.cost) {
                best = Some(one);
            }
        }
        best.unwrap_or_else(|| Fit::begin(&self.model, effects, 0, self.coarse_starts(from)))
    }

    /// A fit that has begun, with those numbers of added effects that suit the ones of another fit, by a fit of them alone.
    fn suited(&self, mut begun: Fit, from: &Fit, alone: impl FnOnce(Fit) -> Fit) -> Fit {
        let mut added = begun.clone();
        added.hold(from);
        if added.free.iter().any(|one| !one.held()) {
            added = alone(added);
            begun.take_over(&added);
            begun.cost = added.cost;
        }
        begun
    }

    /// A look, given up where it will stay far from the least cost that others have reached.
    fn look_on(&self, begun: Fit, from: &Fit, rounds: usize, least: f64) -> Fit {
        let data = Data { tracks: &self.coarse, ..self.data() };
        let until = Until { rounds, tolerance: 1e-3, far: FAR * least, beaten: BEATEN * least, follow_on: false };
        let mut fit = fit::fit(&self.model, &data, begun, until);
        fit.starts.clone_from(&from.starts);
        fit
    }

    fn coarse_starts(&self, fit: &Fit) -> Starts {
        let coarse = self.coarse_segments.iter().zip(&fit.starts);
        coarse.map(|(taken, starts)| taken.iter().map(|&i| starts[i]).collect()).collect()
    }

    /// Fits the file's model with further effects to all rollouts, with the numbers that it shares with another fit from
    /// there; those stay until the others suit them. Of `least` see [`Self::finish`].
    #[must_use]
    pub fn again(&self, effects: &[Id], from: &Fit, rounds: usize, tolerance: f64, least: f64) -> Fit {
        let starts = self.all_starts(effects);
        let mut fit = self.best_of_starts(effects, from, &starts, |begun, least| {
            self.suited(begun, from, |added| self.look_on(added, from, rounds, least))
        });
        fit.starts.clone_from(&from.starts);
        self.finish(fit, rounds, tolerance, least)
    }

    /// Fits to all rollouts, beginning at a fit's numbers; not to the end where it is beaten by the least cost that others have
    /// reached.
    #[must_use]
    pub fn finish(&self, mut fit: Fit, rounds: usize, tolerance: f64, least: f64) -> Fit {
        let _ = rollout::refine_all(&fit.plant(&self.model), &self.fit, &mut fit.starts, &[], 2);
        fit::fit(&self.model, &self.data(), fit, Until::settled(rounds, tolerance).beaten(BEATEN * least))
    }

    /// Fits on in small steps of the integrator, for numbers that are reported: their intervals are narrow.
    #[must_use]
    pub fn in_small_steps(&self, fit: &Fit) -> Fit {
        fit::in_small_steps(&self.model, &self.data(), fit.clone(), Until::settled(POLISH_ROUNDS, POLISH_TOLERANCE))
    }

    /// Readings that the coarse set has, about: the cost that noise alone would leave there.
    #[must_use]
    pub fn coarse_readings(&self) -> f64 {
        self.coarse.iter().map(Track::readings).sum::<f64>().max(1.0)
    }

    /// Judges a model by free rollouts on the held-out runs. The start (angle and speed) of each rollout is fitted to
    /// the readings of that rollout, from several first guesses; two degrees of freedom are booked for it.
    #[must_use]
    pub fn evaluate(&self, fit: &Fit) -> Evaluation {
        let plant = fit.plant(&self.model);
        let mut starts = self.guesses[0].clone();
        let evaluation = rollout::refine_all(&plant, &self.held_out, &mut starts, &self.guesses[1..], 6);
        let mut errors = Vec::new();
        let mut rolled = Vec::new();
        for (track, (rollouts, sums)) in self.held_out.iter().zip(evaluation) {
            for (segment, sum) in track.segments.iter().zip(sums) {
                let readings: f64 = track.weight[segment.first..segment.last].iter().sum();
                errors.push((sum, (readings - 2.0).max(1.0)));
            }
            rolled.push(rollouts);
        }
        Evaluation { rolled, errors, starts }
    }

    /// Mean square noise about a judged model's rollouts, rad².
    #[must_use]
    pub fn scatter_about(&self, evaluation: &Evaluation) -> f64 {
        let scatters: Vec<Scatter> =
            self.held_out.iter().zip(&evaluation.rolled).map(|(track, rolled)| floor::scatter(track, rolled)).collect();
        floor_of(&self.held_out, &scatters)
    }

    /// Keeps the starts of a judgement as a first guess for the next.
    pub fn remember(&mut self, evaluation: &Evaluation) {
        if self.guesses.len() < 3 {
            self.guesses.push(evaluation.starts.clone());
        } else {
            self.guesses[2] = evaluation.starts.clone();
        }
    }
}

/// Mean square that noise alone leaves of the rollouts of some runs, rad².
fn floor_of(tracks: &[Track], scatters: &[Scatter]) -> f64 {
    let mut readings: Vec<f64> = tracks
        .iter()
        .flat_map(|track| track.segments.iter().map(|one| track.weight[one.first..one.last].iter().sum::<f64>()))
        .collect();
    let usual = common::median(&mut readings).unwrap_or(0.0);
    Scatter::of_rollouts(scatters, usual as usize).max(LEAST_NOISE * LEAST_NOISE)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Rig, bench};
    use super::*;

    #[test]
    fn runs_of_one_file_name_are_called_by_their_directories() {
        let recorded = Rig::off().run(1, 1, 1.0);
        let paths = ["a/run.mcap", "b/run.mcap", "c/other.csv"];
        let recordings: Vec<Recording> =
            paths.iter().map(|path| Recording { path: path.into(), ..recorded.clone() }).collect();
        let mut tracks: Vec<Track> =
            recordings.iter().enumerate().map(|(i, one)| Track::new(&bench(), one, i).unwrap()).collect();
        name_apart(tracks.iter_mut().zip(&recordings));
        let names: Vec<&str> = tracks.iter().map(|track| track.name.as_str()).collect();
        assert_eq!(names, ["a/run", "b/run", "other"]);
    }
}

//! The course of a diagnosis: a screen, and where it raises an alarm fits of single effects, of pairs, and of second effects.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use effects::{Acts, Coordinate, Id};
use robot_file::robot::Robot;

use super::bootstrap::Bootstrap;
use super::fit::Fit;
use super::ground;
use super::odd_runs;
use super::open_numbers;
use super::pairs;
use super::place;
use super::probe::Follows;
use super::screen::Screen;
use super::search::{self, Candidate};
use super::selection::{Decision, Selection, leaves_much, reaches, trace};
use super::session::Session;
use super::verdict::{LeftOver, Verdict};
use super::{DiagnoseError, Options, is_implausible, judged, wrong_rig};

/// Times that the effects are tried, at most: again where what lies in the sensor's blind arc looks otherwise with the best.
const PASSES: usize = 3;
/// The same of a robot on the ground, where how the body pulls looks otherwise too.
const PASSES_ON_GROUND: usize = 4;

/// Noise is alike in all rollouts: its mean square is at most this many times the usual one's, which it reaches where it remembers
/// for as long as a rollout. What is rare and large, a shaft that sticks now and then, is no noise, though no curve sees it.
const ALIKE: f64 = 1.6;

/// Noise that remembers leaves at most this many times its fast scatter (mean square): what leaves more is no noise of a sensor.
const REMEMBERED: f64 = 6.25;

/// Up to so many floors a misfit may be one of the numbers that the fit runs leave open; a larger one makes the fit know less of them than
/// they tell.
const SMALL: f64 = 1.2;

/// A friction that is even around the shaft leaves at most this share of its rest to a curve over the angle.
const AROUND: f64 = 0.02;

/// What takes most of a misfit away leaves at most this share of the mean square error.
const MOST: f64 = 0.5;

/// Models do as well as the best up to this factor of its mean square error.
const AS_WELL: f64 = 1.01;
/// Of those so many are asked whether they leave noise.
const MOST_ASKED: usize = 3;

/// What is asked.
pub struct Inquiry<'a> {
    /// The robot file.
    pub robot: &'a Robot,
    /// How to diagnose.
    pub options: &'a Options,
    /// Screens so far of the runs as they are read now, curves included where they were added.
    screens: Mutex<Vec<Known>>,
}

/// A model's screen.
struct Known {
    effects: Vec<Id>,
    coordinates: Vec<f64>,
    screen: Screen,
    curves: &'static [Follows],
}

/// What was found.
pub struct Found {
    /// Runs, model and floor.
    pub session: Session,
    /// The refitted nominal model.
    pub baseline: Candidate,
    /// Models that were tried.
    pub candidates: Vec<Candidate>,
    /// Resamples of the held-out rollouts.
    pub bootstrap: Bootstrap,
    /// The decision.
    pub decision: Decision,
    /// The screen about the model that is named, or about the nominal one.
    pub rest: Screen,
    /// The coordinate that the rest follows, where something is unexplained.
    pub place: Option<&'static str>,
    /// Runs in which the nominal model misses by far although nothing is left of it in the held-out ones.
    pub odd_runs: Option<LeftOver>,
    /// Mean square error of a model whose rest is noise by all that a screen can tell, rad²; 0 where there is none. Noise that
    /// remembers leaves more than its fast scatter, which [`Session::noise`] is.
    pub remembered: f64,
    /// What the refitted model leaves of the held-out runs is no more than the fit runs leave its numbers open.
    pub is_of_open_numbers: bool,
}

/// Whether an effect is a torque that is the same all round the shaft, as most frictions are. What a play of the sensor leaves may follow
/// the angle: where the shaft has turned round, a law that is nearly right leaves most.
fn is_even(effect: &Id) -> bool {
    effect.spec().shows_in == Coordinate::Speed && effect.spec().acts == Acts::Shaft
}

/// Whether a model takes most of the misfit away.
fn takes_most(model: &Candidate, baseline: &Candidate) -> bool {
    model.mean_square() < MOST * baseline.mean_square()
}

/// Whether an effect is a friction that differs around the shaft.
fn is_uneven(effect: &Id) -> bool {
    effect.is_friction() && effect.spec().shows_in == Coordinate::Angle
}

impl Found {
    /// For comparisons.
    #[must_use]
    pub fn selection(&self) -> Selection<'_> {
        Selection {
            noise: self.session.noise.max(self.remembered),
            baseline: &self.baseline,
            candidates: &self.candidates,
            bootstrap: &self.bootstrap,
        }
    }

    /// The model whose rest has a place: the named one; or one that was taken back for what it leaves, or a friction that is even
    /// around the shaft, as what is uneven is in the mean, if it takes most of the misfit away; or the nominal one.
    fn left_by(&self) -> &Candidate {
        let even = |one: &Candidate| one.effects.len() == 1 && one.effects.iter().all(is_even);
        let most = |one: &&Candidate| (one.refuted || even(one)) && takes_most(one, &self.baseline);
        let without_name = || search::best_of(self.candidates.iter().filter(most));
        let named = self.decision.named().map(|named| &self.candidates[named]);
        named.or_else(without_name).unwrap_or(&self.baseline)
    }

    /// The single effect that explains the misfit, where one does.
    fn explained_by_one(&self) -> Option<usize> {
        let explains =
            |&named: &usize| self.candidates[named].effects.len() == 1 && self.decision.verdict != Verdict::Unexplained;
        self.decision.named().filter(explains)
    }

    fn decide(&mut self, alarm: bool) {
        self.decision = self.selection().decide(alarm);
    }

    /// Fits the nominal model and those that are still standing on in small steps. How well they follow the held-out runs stays as it
    /// was judged.
    fn refit_what_is_reported(&mut self) {
        let Self { session, baseline, candidates, decision, .. } = self;
        baseline.fit = session.in_small_steps(&baseline.fit);
        for &place in &decision.class {
            candidates[place].fit = session.in_small_steps(&candidates[place].fit);
        }
    }

    fn refine_floor(&mut self) {
        self.session.noise = search::floor(&self.session, &self.candidates);
    }
}

impl<'a> Inquiry<'a> {
    /// Nothing is known yet.
    #[must_use]
    pub fn new(robot: &'a Robot, options: &'a Options) -> Self {
        Self { robot, options, screens: Mutex::default() }
    }

    /// From the refitted nominal model to a decision.
    pub fn run(&self, mut session: Session, mut baseline: Candidate) -> Result<Found, DiagnoseError> {
        let effects = search::candidates(&session, self.robot, &self.options.also_try)?;
        let (rest, candidates) = self.models(&mut session, &mut baseline, &effects)?;
        let bootstrap = Bootstrap::new(baseline.evaluation.errors.len(), self.options.seed);
        let decision = Decision { verdict: Verdict::Nothing, class: Vec::new() };
        let mut found = Found {
            session,
            baseline,
            candidates,
            bootstrap,
            decision,
            rest,
            place: None,
            odd_runs: None,
            remembered: 0.0,
            is_of_open_numbers: false,
        };
        found.refine_floor();
        // What is far off may lie where a linear look from the refitted model sees nothing of what is missing.
        let too_much = found.baseline.mean_square() > REMEMBERED * found.session.noise;
        let mut alarm = found.rest.alarm() || too_much || found.selection().any_explains();
        let is_small = found.baseline.mean_square() <= SMALL * SMALL * found.session.noise;
        if alarm && is_small {
            let (baseline, noise) = (&found.baseline, found.session.noise);
            found.is_of_open_numbers = open_numbers::explain(&found.session, baseline, noise, self.options.seed);
            alarm = !found.is_of_open_numbers;
        }
        let alarm = alarm && found.session.is_to_be_explained(found.baseline.mean_square());
        found.decide(alarm);
        self.ask_further(&mut found, &effects);
        if found.decision.named().is_none() && is_implausible(&found.session, &found.baseline) {
            return Err(wrong_rig(self.robot, &found.session, &found.baseline));
        }
        if alarm && found.decision.verdict == Verdict::Unexplained {
            self.ask_what_is_left(&mut found, &effects);
            self.ask_further(&mut found, &effects);
        }
        if let Some(named) = found.decision.named() {
            found.rest = self.screen(&found.session, &found.candidates[named], &effects);
        }
        let names_none = found.decision.named().is_none();
        if names_none {
            found.odd_runs = odd_runs::of(&found.session, &found.baseline);
            if found.odd_runs.is_some() {
                found.decision.verdict = Verdict::Unexplained;
            }
        }
        if found.decision.verdict == Verdict::Unexplained {
            let after = found.left_by();
            let mut rest = self.screen(&found.session, after, &effects);
            self.add_curves(&mut rest, &found.session, after, &Follows::ALL);
            found.rest = rest;
            self.locate(&mut found);
        }
        found.refit_what_is_reported();
        Ok(found)
    }

    /// Finds the coordinate that the rest follows. A curve says more than that some run is odd; where no curve says anything, there
    /// is still where the rest is large.
    fn locate(&self, found: &mut Found) {
        self.options.tell("looking where the rest lives", 0.92);
        let follows = place::of(&found.session, found.left_by(), found.selection().noise, &found.rest);
        if follows.is_some_and(|follows| follows != Follows::Run) {
            found.odd_runs = None;
        }
        let is_odd = found.odd_runs.is_some();
        let predicted = || place::predicted(&found.session, found.left_by()).filter(|_| !is_odd);
        found.place = follows.map(Follows::name).or_else(predicted);
    }

    /// Looks for a second effect where one explains the misfit, and takes back names that what is left then speaks against: what a
    /// friction leaves for want of the second one does not.
    fn ask_further(&self, found: &mut Found, effects: &[Id]) {
        if found.explained_by_one().is_none() {
            self.refute(found, effects);
        }
        let mut asked = None;
        while let Some(named) = found.explained_by_one().filter(|&named| asked != Some(named)) {
            self.second(found, named, effects);
            asked = Some(named);
            self.refute(found, effects);
        }
    }

    /// Takes back names, one after the other, of models that what they leave speaks against.
    fn refute(&self, found: &mut Found, effects: &[Id]) {
        while let Some(named) = found.decision.named().filter(|&named| self.is_refuted(found, named, effects)) {
            debug_assert!(!found.candidates[named].refuted, "what was taken back is not named again");
            found.candidates[named].refuted = true;
            found.decide(true);
        }
    }

    /// Whether a model is spoken against by what it leaves: friction that is the same all round the shaft, by a rest that follows the
    /// angle; one that explains a part, by a rest that follows what it follows itself; and a model that is judged by the noise which another
    /// one leaves, by more of a rest than a trace.
    fn is_refuted(&self, found: &Found, place: usize, effects: &[Id]) -> bool {
        let (session, model) = (&found.session, &found.candidates[place]);
        let noise = found.selection().noise;
        if found.remembered > 0.0 {
            let mut screen = self.screen(session, model, effects);
            self.add_curves(&mut screen, session, model, &Follows::ALL);
            let seen = screen.seen() * model.mean_square();
            if seen > trace(model) * (found.baseline.mean_square() - noise) {
                return true;
            }
        }
        // Noise that remembers, and of its own no more than a trace, is still to be asked for.
        let leaves_noise = || self.noise_left_by(session, &found.baseline, model, effects).is_some();
        if found.decision.verdict == Verdict::Unexplained
            && self.leaves_its_own(session, model, effects)
            && !leaves_noise()
        {
            return true;
        }
        if !model.effects.iter().any(is_even) || found.selection().is_at_floor(model) {
            return false;
        }
        let mut screen = self.screen(session, model, effects);
        self.add_curves(&mut screen, session, model, &Follows::AROUND);
        // What is named beside a friction may leave a trace of its own over the angle, and only a friction that is uneven itself one there.
        let all_even = model.effects.iter().all(is_even);
        let uneven = model.effects.iter().any(is_uneven);
        let speaks_against =
            |(follows, share): (Follows, f64)| share > AROUND && (all_even || follows == Follows::Mesh && !uneven);
        screen.strongest_curve().is_some_and(speaks_against)
    }

    /// Whether what an effect leaves follows most of all what the effect itself follows: then the place is right and the law is not.
    fn leaves_its_own(&self, session: &Session, model: &Candidate, effects: &[Id]) -> bool {
        let own = |effect: &Id| match effect.spec().shows_in {
            Coordinate::Time | Coordinate::Ground => None,
            coordinate => Some(coordinate.name()),
        };
        let followed: Vec<&str> = model.effects.iter().filter_map(own).collect();
        if followed.is_empty() {
            return false;
        }
        let mut screen = self.screen(session, model, effects);
        self.add_curves(&mut screen, session, model, &Follows::ALL);
        screen.strongest_curve().is_some_and(|(follows, _)| followed.contains(&follows.name()))
    }

    /// Where the best model does not reach the fast scatter, what it leaves may still be noise, which remembers: the best single
    /// effect is asked first, then the best model and those that do as well.
    fn ask_what_is_left(&self, found: &mut Found, effects: &[Id]) {
        let single = search::singles(&found.candidates).first().copied();
        let error = |place: usize| found.candidates[place].mean_square();
        let least = search::best(&found.candidates).map_or(0.0, Candidate::mean_square);
        let does_as_well = |place: &usize| Some(*place) != single && error(*place) <= AS_WELL * least;
        let mut best: Vec<usize> = (0..found.candidates.len()).filter(does_as_well).collect();
        best.sort_by(|&a, &b| error(a).total_cmp(&error(b)));
        for place in single.into_iter().chain(best.into_iter().take(MOST_ASKED)) {
            let model = &found.candidates[place];
            if model.refuted {
                continue;
            }
            if let Some(noise) = self.noise_left_by(&found.session, &found.baseline, model, effects) {
                found.remembered = noise;
                found.decide(true);
                if found.decision.verdict != Verdict::Unexplained {
                    return;
                }
            }
        }
    }

    /// The noise (mean square, rad²) in what a model leaves, where no screen sees anything in it, or no more than the trace of laws that are
    /// nearly right: a share of what the model has taken away.
    fn noise_left_by(&self, session: &Session, baseline: &Candidate, model: &Candidate, effects: &[Id]) -> Option<f64> {
        let mut screen = self.screen(session, model, effects);
        self.add_curves(&mut screen, session, model, &Follows::ALL);
        let seen = screen.seen();
        let noise = model.mean_square() * (1.0 - seen);
        let is_trace = seen > 0.0 && model.mean_square() - noise <= trace(model) * (baseline.mean_square() - noise);
        let is_alike = noise <= ALIKE * model.usual_square();
        (noise <= REMEMBERED * session.noise && is_alike && (is_trace || screen.is_noise())).then_some(noise)
    }

    /// Whether what a model leaves is noise to a screen; or, of a single effect that takes most away, all but a trace is, as it is asked in
    /// the end ([`Self::ask_what_is_left`]): nothing else need be tried then.
    fn is_left_with_noise(&self, session: &Session, baseline: &Candidate, model: &Candidate, effects: &[Id]) -> bool {
        let asked = model.effects.len() == 1 && takes_most(model, baseline);
        self.leaves_noise(session, model, effects)
            || (asked && self.noise_left_by(session, baseline, model, effects).is_some())
    }

    /// Whether no screen sees anything in what a model leaves.
    fn leaves_noise(&self, session: &Session, model: &Candidate, effects: &[Id]) -> bool {
        let mut screen = self.screen(session, model, effects);
        if screen.is_noise() {
            self.add_curves(&mut screen, session, model, &Follows::FIRST);
        }
        screen.is_noise()
    }

    /// A screen about a model: one that was made, or a new one.
    fn screen(&self, session: &Session, model: &Candidate, effects: &[Id]) -> Screen {
        self.known(model, &[]).unwrap_or_else(|| {
            let screen = Screen::of_effects(&session.model, &session.data(), &model.fit, effects, self.options.seed);
            self.keep(model, &screen, &[]);
            screen
        })
    }

    /// Screens curves about a model too.
    fn add_curves(&self, screen: &mut Screen, session: &Session, model: &Candidate, which: &'static [Follows]) {
        match self.known(model, which) {
            Some(known) => *screen = known,
            None => {
                screen.add_curves(&session.model, &session.data(), &model.fit, self.options.seed, which);
                self.keep(model, screen, which);
            }
        }
    }

    fn known(&self, model: &Candidate, curves: &[Follows]) -> Option<Screen> {
        let screens = self.screens.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |one: &&Known| {
            one.curves == curves && one.effects == model.effects && one.coordinates == model.fit.coordinates
        };
        screens.iter().find(same).map(|one| one.screen.clone())
    }

    fn keep(&self, model: &Candidate, screen: &Screen, curves: &'static [Follows]) {
        let coordinates = model.fit.coordinates.clone();
        let kept = Known { effects: model.effects.clone(), coordinates, screen: screen.clone(), curves };
        self.screens.lock().unwrap_or_else(PoisonError::into_inner).push(kept);
    }

    /// Tries models, where a screen of the nominal one raises an alarm; returns that screen.
    fn models(
        &self,
        session: &mut Session,
        baseline: &mut Candidate,
        effects: &[Id],
    ) -> Result<(Screen, Vec<Candidate>), DiagnoseError> {
        let mut screen = self.screen(session, baseline, effects);
        let mut candidates: Vec<Candidate> = Vec::new();
        let on_ground = session.on_ground();
        let passes = if on_ground { PASSES_ON_GROUND } else { PASSES };
        for pass in 0..passes {
            if !screen.alarm() {
                self.add_curves(&mut screen, session, baseline, &Follows::FIRST);
            }
            let seen = screen.alarm() || leaves_much(session.noise, baseline);
            if !seen || !session.is_to_be_explained(baseline.mean_square()) {
                return Ok((screen, Vec::new()));
            }
            let done = AtomicUsize::new(0);
            let proposals = screen.proposals(&session.model);
            let enough = |tried: &[Candidate]| {
                let noise = search::floor(session, tried);
                let reached = tried.iter().any(|one| reaches(noise, baseline, one));
                // Of a small misfit nothing is named that the screen does not find promising.
                !leaves_much(noise, baseline)
                    || reached
                    || search::best(tried).is_some_and(|best| self.is_left_with_noise(session, baseline, best, effects))
            };
            let done = || {
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                let done = pass as f64 + done as f64 / effects.len() as f64;
                self.options.tell("fitting effects", 0.15 + 0.65 * done / passes as f64);
            };
            let about = |model: &Candidate| self.screen(session, model, effects).proposals(&session.model);
            let asks = search::Asks { effects, enough: &enough, proposals: &about, done: &done };
            candidates = search::models(session, baseline, &proposals, &candidates, &asks);
            // The model with an effect may follow the shaft through the sensor's blind arc where that without it was lost, and a walking
            // body, about which the noise of a model that was lost says nothing.
            let noise = if on_ground { search::floor(session, &candidates) } else { session.noise };
            let best = search::best(&candidates).filter(|best| !reaches(noise, baseline, best));
            // To follow a body anew takes as long as all else, and under a model that leaves so little it is followed well enough.
            let looks_again = pass + 1 < passes && (!on_ground || leaves_much(noise, baseline));
            let Some(best) = best.filter(|_| looks_again) else { break };
            let mut followed = best.fit.clone();
            if !self.look_anew(session, &followed)? {
                let Some((other, fit)) = session.read_about_effects(effects, self.options)? else { break };
                (*session, followed) = (other, fit);
                search::take(session, &mut candidates, &followed);
            }
            let fit = session.settle(&baseline.fit);
            session.lower_fit_noise(&followed);
            *baseline = judged(session, fit);
            self.screens.lock().unwrap_or_else(PoisonError::into_inner).clear();
            screen = self.screen(session, baseline, effects);
        }
        Ok((screen, candidates))
    }

    /// Reads the runs anew by a model that follows them better: what the sensor showed in its blind arc, and how a walking body pulls. Whether
    /// that changed anything.
    fn look_anew(&self, session: &mut Session, fit: &Fit) -> Result<bool, DiagnoseError> {
        if session.on_ground() {
            Ok(ground::follow_anew(session, self.robot, fit, self.options))
        } else {
            session.drop_blind(fit, self.options)
        }
    }

    /// Looks for a second effect in what a screen about the named one leaves.
    fn second(&self, found: &mut Found, named: usize, effects: &[Id]) {
        self.options.tell("fitting second effects", 0.85);
        let single = &found.candidates[named];
        let leaves_more = !found.selection().is_at_floor(single);
        let screen = self.screen(&found.session, single, effects);
        // Where it leaves more than the floor's own error, what promises most is tried though no screen is sure of it: what it gains decides.
        let sure = screen.effects();
        let is_asked = |effect: &Id| leaves_more || sure.contains(effect);
        let proposals: Vec<_> =
            screen.proposals(&found.session.model).into_iter().filter(|one| is_asked(&one.effect)).collect();
        let pairs = pairs::beside(&found.session, single, &proposals);
        if pairs.is_empty() {
            return;
        }
        found.candidates.extend(pairs);
        if found.selection().with_second(&found.decision).is_some() {
            pairs::add_relatives(&found.session, &found.baseline, &mut found.candidates, effects);
        }
        // A pair may have found what the single effect missed for want of a good start, and then needs no second effect.
        pairs::apart(&found.session, &found.baseline, &mut found.candidates);
        found.refine_floor();
        found.decide(true);
        if let Some(pair) = found.selection().with_second(&found.decision) {
            found.decision = pair;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_frictions_only_a_patch_differs_around_the_shaft() {
        let names = |is: fn(&Id) -> bool| Id::all().filter(is).map(Id::name).collect::<Vec<_>>();
        let mut frictions = names(|effect| effect.is_friction());
        frictions.sort_unstable();
        let expected =
            ["coulomb_friction", "directional_friction", "friction_patch", "load_friction", "stribeck_friction"];
        assert_eq!(frictions, expected);
        assert_eq!(names(is_uneven), ["friction_patch"]);
        assert!(!names(is_even).contains(&"sensor_hysteresis"), "{:?}", names(is_even));
    }
}

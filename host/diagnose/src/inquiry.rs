//! The course of a diagnosis: a screen, and where it raises an alarm fits of single effects, of pairs, and of second effects.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use effects::Id;
use robot_file::robot::Robot;

use super::bootstrap::Bootstrap;
use super::pairs;
use super::screen::Screen;
use super::search::{self, Candidate};
use super::selection::{Decision, Selection, leaves_much, reaches};
use super::session::Session;
use super::verdict::Verdict;
use super::{DiagnoseError, Options, is_implausible, judged, wrong_rig};

/// Times that the effects are tried, at most: again where what lies in the sensor's blind arc looks otherwise with the best.
const PASSES: usize = 3;

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
    has_curves: bool,
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
    /// Mean square error of a model whose rest is noise by all that a screen can tell, rad²; 0 where there is none. Noise that
    /// remembers leaves more than its fast scatter, which [`Session::noise`] is.
    pub remembered: f64,
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

    fn decide(&mut self, alarm: bool) {
        self.decision = self.selection().decide(alarm);
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
        let mut found = Found { session, baseline, candidates, bootstrap, decision, rest, remembered: 0.0 };
        found.refine_floor();
        // What is far off may lie where a linear look from the refitted model sees nothing of what is missing.
        let alarm = found.rest.alarm() || found.selection().any_explains();
        found.decide(alarm);
        if found.decision.named().is_none() && is_implausible(&found.session, &found.baseline) {
            return Err(wrong_rig(self.robot, &found.session, &found.baseline));
        }
        if alarm && found.decision.verdict == Verdict::Unexplained {
            self.ask_what_is_left(&mut found, &effects);
        }
        if let Some(named) = found.decision.named() {
            found.rest = self.screen(&found.session, &found.candidates[named], &effects);
            if found.candidates[named].effects.len() == 1 && found.decision.verdict != Verdict::Unexplained {
                self.options.tell("fitting second effects", 0.85);
                self.second(&mut found, named, &effects);
            }
        }
        if found.decision.verdict == Verdict::Unexplained && found.rest.follows().is_none() {
            let after = found.decision.named().map_or(&found.baseline, |named| &found.candidates[named]);
            self.add_curves(&mut found.rest, &found.session, after);
        }
        Ok(found)
    }

    /// Where the best model does not reach the fast scatter, what it leaves may still be noise, which remembers.
    fn ask_what_is_left(&self, found: &mut Found, effects: &[Id]) {
        let Some(best) = search::best(&found.candidates) else { return };
        if self.leaves_noise(&found.session, best, effects) {
            found.remembered = best.mean_square();
            found.decide(true);
        }
    }

    /// Whether no screen sees anything in what a model leaves.
    fn leaves_noise(&self, session: &Session, model: &Candidate, effects: &[Id]) -> bool {
        let mut screen = self.screen(session, model, effects);
        if screen.is_noise() {
            self.add_curves(&mut screen, session, model);
        }
        screen.is_noise()
    }

    /// A screen about a model: one that was made, or a new one.
    fn screen(&self, session: &Session, model: &Candidate, effects: &[Id]) -> Screen {
        self.known(model, false).unwrap_or_else(|| {
            let screen = Screen::of_effects(&session.model, &session.data(), &model.fit, effects, self.options.seed);
            self.keep(model, &screen, false);
            screen
        })
    }

    /// Screens curves about a model too.
    fn add_curves(&self, screen: &mut Screen, session: &Session, model: &Candidate) {
        match self.known(model, true) {
            Some(known) => *screen = known,
            None => {
                screen.add_curves(&session.model, &session.data(), &model.fit, self.options.seed);
                self.keep(model, screen, true);
            }
        }
    }

    fn known(&self, model: &Candidate, has_curves: bool) -> Option<Screen> {
        let screens = self.screens.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |one: &&Known| {
            one.has_curves == has_curves && one.effects == model.effects && one.coordinates == model.fit.coordinates
        };
        screens.iter().find(same).map(|one| one.screen.clone())
    }

    fn keep(&self, model: &Candidate, screen: &Screen, has_curves: bool) {
        let coordinates = model.fit.coordinates.clone();
        let kept = Known { effects: model.effects.clone(), coordinates, screen: screen.clone(), has_curves };
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
        for pass in 0..PASSES {
            if !screen.alarm() {
                self.add_curves(&mut screen, session, baseline);
            }
            if !screen.alarm() && !leaves_much(session.noise, baseline) {
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
                    || search::best(tried).is_some_and(|best| self.leaves_noise(session, best, effects))
            };
            let done = || {
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                let passes = pass as f64 + done as f64 / effects.len() as f64;
                self.options.tell("fitting effects", 0.15 + 0.65 * passes / PASSES as f64);
            };
            let about = |model: &Candidate| self.screen(session, model, effects).proposals(&session.model);
            let asks = search::Asks { enough: &enough, proposals: &about, done: &done };
            candidates = search::models(session, baseline, &proposals, &candidates, &asks);
            // The model with an effect may follow the shaft through the sensor's blind arc where that without it was lost.
            let best = search::best(&candidates).filter(|best| !reaches(session.noise, baseline, best));
            let Some(best) = best.filter(|_| pass + 1 < PASSES) else { break };
            if !session.drop_blind(&best.fit, self.options)? {
                break;
            }
            let fit = session.settle(&baseline.fit);
            session.lower_fit_noise(&best.fit);
            *baseline = judged(session, fit);
            self.screens.lock().unwrap_or_else(PoisonError::into_inner).clear();
            screen = self.screen(session, baseline, effects);
        }
        Ok((screen, candidates))
    }

    /// Looks for a second effect in what a screen about the named one leaves.
    fn second(&self, found: &mut Found, named: usize, effects: &[Id]) {
        let sure = found.rest.effects();
        let proposals: Vec<_> =
            found.rest.proposals(&found.session.model).into_iter().filter(|one| sure.contains(&one.effect)).collect();
        let pairs = pairs::beside(&found.session, &found.candidates[named], &proposals);
        if pairs.is_empty() {
            return;
        }
        found.candidates.extend(pairs);
        let screened = found.candidates[named].fit.coordinates.clone();
        // A pair may have found what the single effect missed for want of a good start, and then needs no second effect.
        pairs::apart(&found.session, &found.baseline, &mut found.candidates);
        found.decide(true);
        if let Some(pair) = found.selection().with_second(&found.decision) {
            found.decision = pair;
        }
        if let Some(now) = found.decision.named()
            && (now != named || found.candidates[now].fit.coordinates != screened)
        {
            found.rest = self.screen(&found.session, &found.candidates[now], effects);
        }
    }
}

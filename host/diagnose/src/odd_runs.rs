//! Runs that were fitted on and are unlike those that judge: a model may stand at the floor on all held-out runs and miss by far in one
//! of the others, where alone something shows that it lacks.

use super::fit::{self, Fit};
use super::probe::Follows;
use super::rollout::squared_errors;
use super::search::Candidate;
use super::session::Session;
use super::verdict::LeftOver;

/// A run is odd where a model leaves this many times (mean square) what it leaves in the worst of the held-out runs.
const ODD: f64 = 3.0;

/// Where the rest lives of a model that leaves nothing in the held-out runs; `None` where no run is odd.
#[must_use]
pub fn of(session: &Session, model: &Candidate) -> Option<LeftOver> {
    let held_out = session.parts().into_iter().map(|part| {
        let errors = model.evaluation.errors[part].iter();
        mean(errors.fold((0.0, 0.0), |total, one| (total.0 + one.0, total.1 + one.1)))
    });
    let bound = ODD * held_out.fold(session.noise, f64::max);
    let sums = sums_by_run(session, &model.fit);
    let odd: Vec<usize> = (0..sums.len()).filter(|&run| mean(sums[run]) > bound).collect();
    let excess = |run: usize| (sums[run].0 - session.noise * sums[run].1).max(0.0);
    let (first, last) = (odd.first()?, odd.last()?);
    Some(LeftOver {
        coordinate: Follows::Run.name().to_owned(),
        from: *first as f64,
        to: *last as f64,
        share: odd.iter().map(|&run| excess(run)).sum::<f64>() / (0..sums.len()).map(excess).sum::<f64>(),
        runs: odd.iter().map(|&run| session.fit[run].name.clone()).collect(),
    })
}

/// Per run that was fitted on: sum of squared errors, rad², and how many readings count.
fn sums_by_run(session: &Session, fit: &Fit) -> Vec<(f64, f64)> {
    let rolled = fit::roll_all(&session.model, &session.data(), fit);
    let sums = session.fit.iter().zip(&rolled);
    sums.map(|(track, rolled)| (squared_errors(track, &rolled.readings).iter().sum(), track.readings())).collect()
}

fn mean((sum, count): (f64, f64)) -> f64 {
    sum / count.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Rig, bench, coulomb};
    use super::super::{Options, Verdict, diagnose};
    use recording::Recording;

    /// Six runs with names.
    fn runs(rig: &Rig) -> Vec<Recording> {
        let mut runs = rig.runs(3);
        for (i, run) in runs.iter_mut().enumerate() {
            run.path = format!("run-{i}.csv").into();
        }
        runs
    }

    #[test]
    #[ignore = "two minutes: .ci/long"]
    fn a_rest_that_only_one_fitted_run_shows_is_said_with_its_name() {
        let mut all = runs(&Rig::off());
        let mut rubs = Rig::off();
        rubs.shaft.laws = coulomb(1.5e-3);
        all[2] = Recording { path: "run-2.csv".into(), ..rubs.run(32, 2, 2.0) };
        let diagnosis = diagnose(&bench(), &all[..4], &all[4..], &Options::default()).unwrap();
        assert_eq!((diagnosis.verdict, diagnosis.causes.len()), (Verdict::Unexplained, 0), "{:?}", diagnosis.causes);
        let left_over = diagnosis.left_over.unwrap();
        assert_eq!((left_over.coordinate.as_str(), left_over.runs), ("run", vec!["run-2".to_owned()]));
        // The numbers, drawn towards that run, leave a little in the others.
        assert!(left_over.share > 0.7, "{}", left_over.share);
    }
}

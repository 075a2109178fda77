//! Learning where what is best is known.

use tasks::Steps;

use super::*;

/// A row of cells with the goal at one end: actions go left, stay, go right; a step costs 1, and the goal ends the episode. What is
/// seen is the place. An episode is cut off after twenty steps.
struct Row {
    cells: i64,
    places: Vec<i64>,
    steps: Vec<usize>,
}

impl Row {
    fn new(count: usize) -> Self {
        Self { cells: 7, places: vec![0; count], steps: vec![0; count] }
    }

    fn see(&self, which: usize) -> f32 {
        self.places[which] as f32 / self.cells as f32 - 0.5
    }
}

impl Environments for Row {
    fn count(&self) -> usize {
        self.places.len()
    }

    fn observation_size(&self) -> usize {
        1
    }

    fn actions(&self) -> usize {
        3
    }

    fn episode_steps(&self) -> usize {
        20
    }

    fn reset(&mut self, which: usize, seed: u64) -> Result<Vec<f32>, LearnError> {
        self.places[which] = (seed % self.cells as u64) as i64;
        self.steps[which] = 0;
        Ok(vec![self.see(which)])
    }

    fn step(&mut self, actions: &[usize]) -> Result<Steps, LearnError> {
        for ((place, steps), action) in self.places.iter_mut().zip(&mut self.steps).zip(actions) {
            *place = (*place + *action as i64 - 1).clamp(0, self.cells);
            *steps += 1;
        }
        Ok(Steps {
            observations: (0..self.count()).map(|which| self.see(which)).collect(),
            rewards: vec![-1.0; self.count()],
            terminated: self.places.iter().map(|&place| place == self.cells).collect(),
            truncated: self.steps.iter().map(|&steps| steps >= 20).collect(),
        })
    }
}

fn hyperparameters() -> Hyperparameters {
    Hyperparameters { steps: 256, learning_rate: 1e-3, entropy_coefficient: 0.01, ..Hyperparameters::default() }
}

fn learner(seed: u64) -> Learner<Row> {
    Learner::new(Row::new(8), hyperparameters(), seed).unwrap()
}

#[test]
fn the_way_to_a_goal_is_learned() {
    for seed in [1, 2, 3] {
        let mut learner = learner(seed);
        let first = learner.update().unwrap();
        let mut last = first.clone();
        for _ in 0..40 {
            last = learner.update().unwrap();
        }
        // From everywhere straight to the goal: 4 steps in the mean over the seven cells where episodes begin.
        let (before, after) = (first.mean_return.unwrap(), last.mean_return.unwrap());
        assert!(before < -8.0 && after > -4.6, "seed {seed}: {before} before, {after} after");
        let policy = learner.policy();
        assert!((0..7).all(|place| policy.best(&[place as f32 / 7.0 - 0.5]) == 2), "seed {seed}");
    }
}

#[test]
fn a_seed_gives_one_policy_and_another_seed_another() {
    let trained = |seed: u64| {
        let mut learner = learner(seed);
        for _ in 0..3 {
            learner.update().unwrap();
        }
        learner.policy()
    };
    assert_eq!(trained(5), trained(5));
    assert_ne!(trained(5), trained(6));
}

#[test]
fn a_training_that_was_stopped_goes_on_as_if_it_had_not_been() {
    let mut learner = learner(9);
    for _ in 0..3 {
        learner.update().unwrap();
    }
    let text = serde_json::to_string(&learner.checkpoint()).unwrap();
    let checkpoint: Checkpoint = serde_json::from_str(&text).unwrap();
    let mut resumed = Learner::resume(Row::new(8), &checkpoint).unwrap();
    for _ in 0..3 {
        assert_eq!(resumed.update().unwrap(), learner.update().unwrap());
    }
    assert_eq!(resumed.policy(), learner.policy());
    assert_eq!(resumed.checkpoint(), learner.checkpoint());
}

#[test]
fn what_does_not_fit_is_refused_with_its_name() {
    let refused = |change: &dyn Fn(&mut Hyperparameters)| {
        let mut wrong = hyperparameters();
        change(&mut wrong);
        Learner::new(Row::new(8), wrong, 1).err().unwrap().to_string()
    };
    assert_eq!(refused(&|h| h.steps = 100), "steps: expected a multiple of 8, the number of environments");
    assert_eq!(
        refused(&|h| h.batch_size = 1),
        "batch_size: expected a whole number from 2 to 256, the steps of an update"
    );
    assert_eq!(refused(&|h| h.discount = 1.5), "discount: expected a number from 0 to 1");
    let checkpoint = learner(1).checkpoint();
    let other = Learner::resume(Row::new(4), &checkpoint).err().unwrap().to_string();
    assert_eq!(other, "the checkpoint is of another training: it had 8 environments, and these are 4");
}

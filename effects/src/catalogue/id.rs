//! An effect by its place in the catalogue.

use super::list::Entry;
use super::{ENTRIES, Laws};
use crate::fit::{FitNumber, Sizes};
use crate::spec::Spec;

/// An effect of the catalogue. Ordered as the catalogue lists them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id(usize);

impl Id {
    /// Every effect, in the order of the catalogue.
    pub fn all() -> impl Iterator<Item = Self> + use<> {
        (0..ENTRIES.len()).map(Self)
    }

    /// The effect of a name.
    #[must_use]
    pub fn of(name: &str) -> Option<Self> {
        Self::all().find(|id| id.name() == name)
    }

    fn entry(self) -> &'static Entry {
        &ENTRIES[self.0]
    }

    /// What is known about it.
    #[must_use]
    pub fn spec(self) -> &'static Spec {
        &self.entry().spec
    }

    /// The name of its table in the robot file.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.spec().name
    }

    /// Whether it contains another effect as a special case.
    #[must_use]
    pub fn contains(self, other: Self) -> bool {
        self.spec().contains.contains(&other.name())
    }

    /// Whether two effects are forms of the same thing, so that both together are never asked for.
    #[must_use]
    pub fn overlaps(self, other: Self) -> bool {
        self == other || self.contains(other) || other.contains(self)
    }

    /// Whether recordings may not tell two effects apart, as either of them says.
    #[must_use]
    pub fn mistaken(self, other: Self) -> bool {
        let says =
            |one: Self, other: Self| one.spec().mistaken_for.iter().any(|confusion| confusion.with == other.name());
        says(self, other) || says(other, self)
    }

    /// Whether it is friction: what slides is dragged through a presliding length first.
    #[must_use]
    pub fn is_friction(self) -> bool {
        self.spec().parameters.iter().any(|one| one.key.starts_with("presliding"))
    }

    /// Whether it carries something from step to step.
    #[must_use]
    pub fn carries_state(self) -> bool {
        self.entry().carries_state
    }

    /// The numbers that a fit moves, for a rig of these sizes.
    #[must_use]
    pub fn fit(self, sizes: &Sizes) -> Vec<FitNumber> {
        (self.entry().fit)(sizes)
    }

    /// Puts the fit's numbers into values in the order of [`Spec::parameters`].
    pub fn values_of_fit(self, numbers: &[f64], values: &mut [f64]) {
        (self.entry().values_of_fit)(numbers, values);
    }

    /// The fit's numbers of values in the order of [`Spec::parameters`].
    #[must_use]
    pub fn fit_of_values(self, values: &[f64], count: usize) -> Vec<f64> {
        let mut numbers = vec![0.0; count];
        (self.entry().fit_of_values)(values, &mut numbers);
        numbers
    }

    /// Half the plausible range of each of the fit's numbers, from that of the values.
    #[must_use]
    pub fn fit_ranges(self, values: &[f64], half_ranges: &[f64], count: usize) -> Vec<f64> {
        let mut numbers = vec![0.0; count];
        (self.entry().fit_ranges)(values, half_ranges, &mut numbers);
        numbers
    }

    /// Gives a robot the effect with these values (SI, rad, in the order of [`Spec::parameters`]), or takes it away.
    pub fn put(self, laws: &mut Laws, values: Option<&[f64]>) {
        (self.entry().put)(laws, values);
    }
}

impl std::fmt::Debug for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

//! What follows from the list of effects: every effect's place in [`Laws`], [`States`] and [`Id`].

/// Makes the modules, [`super::Laws`] with a field an effect, [`super::States`], and [`super::Id`].
macro_rules! catalogue {
    ($($module:ident::$law:ident,)*) => {
        $(
            mod $module;
            pub use $module::$law;
        )*

        /// The effects that a robot has, SI units and radians: a field an effect, named as its table in the robot file.
        #[derive(Clone, Copy, Debug, PartialEq, Default)]
        pub struct Laws {
            $(#[doc = concat!("`", stringify!($module), "`")] pub $module: Option<$law>,)*
        }

        /// What the effects carry from step to step.
        #[derive(Clone, Copy, Debug, PartialEq, Default)]
        pub struct States {
            $($module: <$law as Effect>::State,)*
        }

        /// Every effect's entry, in the order of the list.
        static ENTRIES: &[Entry] = &[$(Entry::of::<$law>(|laws, values| {
            laws.$module = values.map($law::from_values);
        }),)*];

        impl Laws {
            /// A robot without any effect.
            pub const NONE: Self = Self { $($module: None,)* };

            /// The duty that arrives, −1 … 1, of one that is commanded.
            #[inline]
            #[must_use]
            pub fn duty(&self, duty: f64) -> f64 {
                let mut duty = duty;
                $(if acts::<$law>(Acts::Command) && let Some(law) = &self.$module {
                    duty = law.duty(duty);
                })*
                duty
            }

            /// By how much the command arrives late, s.
            #[inline]
            #[must_use]
            pub fn command_age(&self) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Command) && let Some(law) = &self.$module {
                    sum += law.command_age();
                })*
                sum
            }

            /// Voltage that the bridge takes.
            #[inline]
            #[must_use]
            pub fn bridge(&self) -> BridgeDrop {
                let mut sum = BridgeDrop::default();
                $(if acts::<$law>(Acts::Bridge) && let Some(law) = &self.$module {
                    let one = law.bridge();
                    sum.drop_v += one.drop_v;
                    sum.knee_a += one.knee_a;
                    sum.slope_ohm += one.slope_ohm;
                    sum.of_supply += one.of_supply;
                    sum.switching_knee_a += one.switching_knee_a;
                    sum.fades_within += one.fades_within;
                    sum.of_command_v += one.of_command_v;
                })*
                sum
            }

            /// Resistance of the bridge's supply that acts at once, Ω.
            #[inline]
            #[must_use]
            pub fn supply_resistance(&self) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Supply) && let Some(law) = &self.$module {
                    sum += law.supply_resistance();
                })*
                sum
            }

            /// By how much the supply has fallen slowly, V.
            #[inline]
            #[must_use]
            pub fn supply_fallen(&self, states: &States) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Supply) && let Some(law) = &self.$module {
                    sum += law.supply_fallen(&states.$module);
                })*
                sum
            }

            /// Advances what the supply remembers, by a mean bridge current (A) over a time (s).
            #[inline]
            pub fn draw(&self, states: &mut States, bridge_a: f64, time: f64) {
                $(if acts::<$law>(Acts::Supply) && let Some(law) = &self.$module {
                    law.draw(&mut states.$module, bridge_a, time);
                })*
            }

            /// Level at which friction slides, N·m, at an angle (rad) and a speed (rad/s) with a torque (N·m) through the
            /// teeth.
            #[inline]
            #[must_use]
            pub fn friction_level(&self, angle: f64, speed: f64, transmitted_nm: f64) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Shaft) && let Some(law) = &self.$module {
                    sum += law.friction_level(angle, speed, transmitted_nm);
                })*
                sum
            }

            /// Presliding length of the one bristle that carries all friction, rad: that of the first effect in the list
            /// that has one; `None` without friction.
            #[inline]
            #[must_use]
            pub fn presliding(&self) -> Option<f64> {
                $(if acts::<$law>(Acts::Shaft) && let Some(length) = self.$module.and_then(|law| law.presliding()) {
                    return Some(length);
                })*
                None
            }

            /// Torque on the shaft at an angle (rad), N·m, counter-clockwise positive.
            #[inline]
            #[must_use]
            pub fn torque(&self, angle: f64) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Shaft) && let Some(law) = &self.$module {
                    sum += law.torque(angle);
                })*
                sum
            }

            /// By how much friction slides higher counter-clockwise than its level, and lower clockwise, N·m.
            #[inline]
            #[must_use]
            pub fn friction_lean(&self) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Shaft) && let Some(law) = &self.$module {
                    sum += law.friction_lean();
                })*
                sum
            }

            /// Torque against the motion that grows faster than the speed.
            #[inline]
            #[must_use]
            pub fn drag(&self) -> Drag {
                let mut sum = Drag::default();
                $(if acts::<$law>(Acts::Shaft) && let Some(law) = &self.$module {
                    let one = law.drag();
                    sum.quadratic += one.quadratic;
                    sum.cubic += one.cubic;
                })*
                sum
            }

            /// The spring behind which the load turns; `None` for a rigid shaft.
            #[must_use]
            pub fn coupling(&self) -> Option<Coupling> {
                let mut row: Option<Coupling> = None;
                $(if acts::<$law>(Acts::Shaft) && let Some(law) = &self.$module && let Some(one) = law.coupling() {
                    row = Some(row.map_or(one, |first| first.with(one)));
                })*
                row
            }

            /// Whether what turns into heat changes any of them.
            #[must_use]
            pub fn warms(&self) -> bool {
                let mut any = false;
                $(if acts::<$law>(Acts::Shaft) && let Some(law) = &self.$module {
                    any |= law.warms();
                })*
                any
            }

            /// Advances their warmth, by mean losses (W) in the winding and by friction over a time (s).
            #[inline]
            pub fn warm(&self, states: &mut States, winding_w: f64, friction_w: f64, time: f64) {
                $(if acts::<$law>(Acts::Shaft) && let Some(law) = &self.$module {
                    law.warm(&mut states.$module, winding_w, friction_w, time);
                })*
            }

            /// Factor on the winding's resistance.
            #[inline]
            #[must_use]
            pub fn resistance_factor(&self, states: &States) -> f64 {
                let mut factor = 1.0;
                $(if acts::<$law>(Acts::Shaft) && let Some(law) = &self.$module {
                    factor *= law.resistance_factor(&states.$module);
                })*
                factor
            }

            /// Factor on the viscous damping.
            #[inline]
            #[must_use]
            pub fn viscous_factor(&self, states: &States) -> f64 {
                let mut factor = 1.0;
                $(if acts::<$law>(Acts::Shaft) && let Some(law) = &self.$module {
                    factor *= law.viscous_factor(&states.$module);
                })*
                factor
            }

            /// Error of the reading at a shaft angle (rad), rad.
            #[inline]
            #[must_use]
            pub fn reading_error(&self, angle: f64) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Sensor) && let Some(law) = &self.$module {
                    sum += law.reading_error(angle);
                })*
                sum
            }

            /// Age of the reading, s.
            #[inline]
            #[must_use]
            pub fn reading_age(&self) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Sensor) && let Some(law) = &self.$module {
                    sum += law.reading_age();
                })*
                sum
            }

            /// By how much the age of the reading grows in a second of the run, s/s.
            #[inline]
            #[must_use]
            pub fn ageing(&self) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Sensor) && let Some(law) = &self.$module {
                    sum += law.ageing();
                })*
                sum
            }

            /// Chance that a reading repeats the one before it, 0 … 1.
            #[inline]
            #[must_use]
            pub fn held(&self) -> f64 {
                let mut fresh = 1.0;
                $(if acts::<$law>(Acts::Sensor) && let Some(law) = &self.$module {
                    fresh *= 1.0 - law.held();
                })*
                1.0 - fresh
            }

            /// Whether the reading follows the shaft with a memory.
            #[must_use]
            pub fn follows(&self) -> bool {
                let mut any = false;
                $(if acts::<$law>(Acts::Sensor) && let Some(law) = &self.$module {
                    any |= law.follows();
                })*
                any
            }

            /// How far what is read moves on (rad) where the shaft, or the wiper that it drags, has moved by `moved` (rad)
            /// within a step (s), evenly. One effect follows the other.
            #[inline]
            pub fn follow(&self, states: &mut States, moved: f64, step: f64) -> f64 {
                let mut moved = moved;
                $(if acts::<$law>(Acts::Sensor) && let Some(law) = &self.$module {
                    moved = law.follow(&mut states.$module, moved, step);
                })*
                moved
            }

            /// How far what is read is behind, rad.
            #[inline]
            #[must_use]
            pub fn behind(&self, states: &States) -> f64 {
                let mut sum = 0.0;
                $(if acts::<$law>(Acts::Sensor) && let Some(law) = &self.$module {
                    sum += law.behind(&states.$module);
                })*
                sum
            }

            /// Puts what is read to where it ends up behind a shaft that turns at a speed (rad/s), as surely as `dragging`
            /// (−1 … 1) says.
            pub fn settle(&self, states: &mut States, speed: f64, dragging: f64) {
                $(if acts::<$law>(Acts::Sensor) && let Some(law) = &self.$module {
                    law.settle(&mut states.$module, speed, dragging);
                })*
            }

            /// Factor on the coefficient of friction of a foot that slides at `speed` (m/s) under `load` (N).
            #[inline]
            #[must_use]
            pub fn friction_factor(&self, speed: f64, load: f64) -> f64 {
                let mut factor = 1.0;
                $(if acts::<$law>(Acts::Foot) && let Some(law) = &self.$module {
                    factor *= law.friction_factor(speed, load);
                })*
                factor
            }

            /// Whether a foot's friction depends on its speed or load.
            #[must_use]
            pub fn varies_foot_friction(&self) -> bool {
                false $(|| self.$module.is_some_and(|law| law.varies_foot_friction()))*
            }

            /// A foot's friction across its module as a share of that along it.
            #[inline]
            #[must_use]
            pub fn lateral_share(&self) -> f64 {
                let mut share = 1.0;
                $(if acts::<$law>(Acts::Foot) && let Some(law) = &self.$module {
                    share *= law.lateral_share();
                })*
                share
            }

            /// Share of a foot's load that is carried as by a sphere, and the load (N) at which it sinks as deep as a linear spring:
            /// those of the first effect in the list that has a share.
            #[must_use]
            pub fn sphere(&self) -> [f64; 2] {
                $(if acts::<$law>(Acts::Foot) && let Some(sphere) = self.$module.map(|law| law.sphere()).filter(|s| s[0] > 0.0) {
                    return sphere;
                })*
                [0.0, 1.0]
            }

            /// Direction of gravity, a unit vector in the ground's frame (x ahead, z up).
            #[must_use]
            pub fn down(&self) -> [f64; 3] {
                let mut down = [0.0, 0.0, -1.0];
                $(if acts::<$law>(Acts::Ground) && let Some(law) = &self.$module {
                    down = law.down(down);
                })*
                down
            }

            /// Factor on the coefficient of friction of one foot: its module and its side, both from 0, left before right.
            #[must_use]
            pub fn foot_share(&self, module: usize, side: usize) -> f64 {
                let mut share = 1.0;
                $(if acts::<$law>(Acts::Foot) && let Some(law) = &self.$module {
                    share *= law.foot_share(module, side);
                })*
                share
            }

            /// Where a courier's mass is centred, from the middle of its box in its own frame, m.
            #[must_use]
            pub fn payload(&self) -> [f64; 3] {
                let mut sum = [0.0; 3];
                $(if acts::<$law>(Acts::Ground) && let Some(law) = &self.$module {
                    sum.iter_mut().zip(law.payload()).for_each(|(sum, one)| *sum += one);
                })*
                sum
            }

            /// Factors on the stiffness and on the damping of a backbone, counted from 0 at the front.
            #[must_use]
            pub fn backbone_shares(&self, backbone: usize) -> [f64; 2] {
                let mut shares = [1.0; 2];
                $(if acts::<$law>(Acts::Ground) && let Some(law) = &self.$module {
                    shares.iter_mut().zip(law.backbone_shares(backbone)).for_each(|(share, one)| *share *= one);
                })*
                shares
            }

            /// By how much stiffer a backbone is, as a share, where its ends are turned by 1 rad against each other:
            /// torsion, stiff and soft bending.
            #[must_use]
            pub fn hardening(&self) -> [f64; 3] {
                let mut sum = [0.0; 3];
                $(if acts::<$law>(Acts::Ground) && let Some(law) = &self.$module {
                    sum.iter_mut().zip(law.hardening()).for_each(|(sum, one)| *sum += one);
                })*
                sum
            }

            /// What is left of what they carry after a hole in a recording.
            #[must_use]
            pub fn lasting(&self, states: &States) -> States {
                let mut left = States::default();
                $(if self.$module.is_some_and(|law| law.lasts()) {
                    left.$module = states.$module;
                })*
                left
            }

            /// The effects that are there, in the order of the catalogue.
            pub fn listed(&self) -> impl Iterator<Item = Id> + use<> {
                let there = [$(self.$module.is_some(),)*];
                Id::all().zip(there).filter(|(_, there)| *there).map(|(id, _)| id)
            }

            /// The largest torque that an effect puts on the shaft by itself, N·m.
            #[must_use]
            pub fn largest_torque(&self) -> f64 {
                let mut largest = 0.0f64;
                $(if let Some(law) = &self.$module {
                    largest = largest.max(law.largest_torque());
                })*
                largest
            }
        }
    };
}
pub(super) use catalogue;

use super::{Acts, Effect, FitNumber, Laws, Sizes, Spec};

/// Whether an effect acts in a part of the chain: known when it is compiled, so that the others cost nothing there.
#[inline(always)]
pub(super) const fn acts<E: Effect>(part: Acts) -> bool {
    E::SPEC.acts as u8 == part as u8
}

/// An effect's functions, by value.
pub(super) struct Entry {
    pub spec: Spec,
    pub fit: fn(&Sizes) -> Vec<FitNumber>,
    pub values_of_fit: fn(&[f64], &mut [f64]),
    pub fit_of_values: fn(&[f64], &mut [f64]),
    pub fit_ranges: fn(&[f64], &[f64], &mut [f64]),
    pub put: fn(&mut Laws, Option<&[f64]>),
    pub carries_state: bool,
}

impl Entry {
    pub(super) const fn of<E: Effect>(put: fn(&mut Laws, Option<&[f64]>)) -> Self {
        Self {
            spec: E::SPEC,
            fit: E::fit,
            values_of_fit: E::values_of_fit,
            fit_of_values: E::fit_of_values,
            fit_ranges: E::fit_ranges,
            put,
            carries_state: size_of::<E::State>() > 0,
        }
    }
}

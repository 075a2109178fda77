//! Which step a body can be advanced with.
//!
//! The leapfrog carries a spring k on an inertia I while `h²·k/I < 4`. In a chain of equal inertias the fastest mode has four
//! times the stiffness and the damping of one joint, so `h²·k < I` without damping. Where the damping d rules, the motion of
//! a joint follows `z³ + (c − 3/2) z² + z − 1/2 = 0` with `c = h·k/d`, which by Jury's criterion is stable for c < 1. Together:
//! `h²·k < I + h·d`. The backbones' light segments live of the second part: h up to about d/k.

use super::plan::{GRAVITY, Plan, PlanError};
use super::skeleton::{Link, Skeleton, difference};

/// Fails where the step (s) is too long for a spring of the body.
pub(super) fn check(plan: &Plan, step: f64) -> Result<(), PlanError> {
    if !(step.is_finite() && step > 0.0) {
        let what = format!("a step of {step} s: it must be positive");
        return Err(PlanError::Field { field: "step_s", what });
    }
    let skeleton = Skeleton::new(plan);
    for arm in &skeleton.arms {
        let mut inner = &skeleton.base;
        for link in arm {
            for axis in 0..3 {
                // Of a spring that hardens, its slope where the whole backbone is turned by 1 rad.
                let angle = 1.0 / link.joint.map_or(1.0, |joint| plan.backbone_of(joint).segments as f64);
                let steepest = 1.0 + 3.0 * link.hardening[axis] * angle * angle;
                let (k, d) = (steepest * link.stiffness[axis], link.damping[axis]);
                let inertia = about_hinge(link, axis).min(least(inner));
                // Written so that NaN is refused.
                let carried = step * step * k < inertia + step * d;
                if !carried {
                    let longest = (d + (d * d + 4.0 * k * inertia).sqrt()) / (2.0 * k);
                    let what = format!(
                        "a step of {step:e} s cannot carry a hinge of {k} N·m/rad and {d:e} N·m·s/rad; {longest:.1e} s can"
                    );
                    return Err(PlanError::Field { field: "backbone", what });
                }
            }
            inner = link;
        }
    }
    contact(plan, step)
}

/// Both feet of a module together on their springs: `h²·ω² < 4` for its fastest motion, alone and without the damping.
fn contact(plan: &Plan, step: f64) -> Result<(), PlanError> {
    let Some(contact) = &plan.contact else { return Ok(()) };
    // Of a sphere, its slope where it carries the whole robot.
    let [share, nominal] = contact.laws.sphere();
    let whole = plan.modules.iter().map(|module| module.mass).sum::<f64>() * GRAVITY;
    let steepest = 1.0 + share * (1.5 * (whole / nominal).cbrt().max(1.0) - 1.0);
    let (normal, shear) = (steepest * contact.normal_stiffness, contact.shear_stiffness);
    for (number, module) in plan.modules.iter().enumerate() {
        let [ix, iy, iz] = module.principal_inertia();
        let per_mass = 1.0 / module.mass;
        let fastest = (0..2).filter(|side| module.has_foot[*side]).map(|side| {
            // From where the mass is centred.
            let [_, y, z] = difference(module.feet[side], module.mass_centre);
            let heaving = normal * per_mass.max(y * y / ix);
            let swaying = shear * (per_mass + z * z / ix);
            let surging = shear * (per_mass + z * z / iy + y * y / iz);
            // Two feet at the farther one's place.
            (2.0 * heaving.max(swaying).max(surging)).sqrt()
        });
        let fastest = fastest.fold(0.0, f64::max);
        let carried = step * fastest < 2.0;
        if !carried {
            let what = format!(
                "a step of {step:e} s cannot carry feet of {normal} N/m and, along the ground, {shear} N/m under module {}; {:.1e} s can",
                number + 1,
                2.0 / fastest
            );
            return Err(PlanError::Field { field: "feet", what });
        }
    }
    Ok(())
}

/// Of a link about one of its hinges, kg·m².
fn about_hinge(link: &Link, axis: usize) -> f64 {
    let off: f64 = (0..3).filter(|other| *other != axis).map(|other| link.centre[other] * link.centre[other]).sum();
    link.inertia[axis][axis] + link.mass * off
}

/// Of a link about its centre, kg·m².
fn least(link: &Link) -> f64 {
    (0..3).map(|axis| link.inertia[axis][axis]).fold(f64::INFINITY, f64::min)
}

//! What a cross-section of a material predicts of a backbone's hinges.

use std::f64::consts::PI;

/// An I: two flanges across the ends of a web, from a cast of one material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Of the flanges, along y, m.
    pub width: f64,
    /// From outside to outside, along z, m.
    pub height: f64,
    /// Thickness of a flange along z, m; half the height for a solid rectangle.
    pub flange: f64,
    /// Thickness of the web along y, m.
    pub web: f64,
    /// Young's modulus, Pa.
    pub modulus: f64,
}

/// Why there is no such section.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error, miette::Diagnostic)]
#[error("a section of {0}")]
#[diagnostic(help("WIDTH,HEIGHT,FLANGE,WEB in mm: the flange at most half the height, the web at most the width"))]
pub struct SectionError(String);

/// Of an elastomer, which keeps its volume.
const POISSON: f64 = 0.5;

impl Section {
    /// Checks it.
    ///
    /// # Errors
    /// A length or the modulus is not positive, or the parts do not fit into each other.
    pub fn check(&self) -> Result<(), SectionError> {
        let Self { width, height, flange, web, modulus } = *self;
        let positive = [width, height, flange, web, modulus].iter().all(|x| x.is_finite() && *x > 0.0);
        if positive && 2.0 * flange <= height * (1.0 + 1e-9) && web <= width * (1.0 + 1e-9) {
            return Ok(());
        }
        let mm = [width, height, flange, web].map(|x| format!("{}", 1e3 * x));
        Err(SectionError(format!("{} mm and {modulus} Pa", mm.join(" × "))))
    }

    /// Stiffness of each of `segments` hinges in a beam of a length (m), about x, y, z, N·m/rad: n·GJ/L, n·EI_y/L and n·EI_z/L.
    ///
    /// Torsion by Saint-Venant: thin parts as their `⅓ a t³` with the correction of a rectangle's ends (S. Timoshenko and
    /// J. Goodier, *Theory of Elasticity*, 1951, article 94), warping left out.
    #[must_use]
    pub fn hinges(&self, length: f64, segments: usize) -> [f64; 3] {
        let Self { width, height, flange, web, modulus } = *self;
        let inner = (height - 2.0 * flange).max(0.0);
        let about_y = (width * height.powi(3) - (width - web) * inner.powi(3)) / 12.0;
        let about_z = (2.0 * flange * width.powi(3) + inner * web.powi(3)) / 12.0;
        let torsion = if inner > 0.0 {
            2.0 * rectangle_torsion(width, flange) + inner * web.powi(3) / 3.0
        } else {
            rectangle_torsion(width, height)
        };
        let shear = modulus / (2.0 * (1.0 + POISSON));
        let per_hinge = segments as f64 / length;
        [shear * torsion * per_hinge, modulus * about_y * per_hinge, modulus * about_z * per_hinge]
    }
}

/// Saint-Venant's torsion constant of a rectangle, m⁴ (the series' first terms, exact to 1e-6).
fn rectangle_torsion(a: f64, b: f64) -> f64 {
    let (long, short) = (a.max(b), a.min(b));
    let series: f64 = (0..8)
        .map(|k| {
            let n = f64::from(2 * k + 1);
            (0.5 * n * PI * long / short).tanh() / n.powi(5)
        })
        .sum();
    long * short.powi(3) / 3.0 * (1.0 - 192.0 / PI.powi(5) * short / long * series)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solid_rectangle_and_a_square_have_their_textbook_values() {
        // Timoshenko and Goodier's table: k₁ = 0.1406 for a square, 0.196 for 3 : 2.
        assert!((rectangle_torsion(1.0, 1.0) - 0.140_577).abs() < 1e-5, "{}", rectangle_torsion(1.0, 1.0));
        assert!((rectangle_torsion(1.5, 1.0) / 1.5 - 0.1958).abs() < 2e-4);
        let solid = Section { width: 0.004, height: 0.006, flange: 0.003, web: 0.004, modulus: 2.4e6 };
        solid.check().unwrap();
        let [x, y, z] = solid.hinges(0.020, 10);
        let (ey, ez) = (2.4e6 * 0.004 * 0.006_f64.powi(3) / 12.0, 2.4e6 * 0.006 * 0.004_f64.powi(3) / 12.0);
        assert!((y / (500.0 * ey) - 1.0).abs() < 1e-12 && (z / (500.0 * ez) - 1.0).abs() < 1e-12, "{y} {z}");
        assert!((x / (500.0 * 0.8e6 * 0.1958 * 0.006 * 0.004_f64.powi(3)) - 1.0).abs() < 2e-3, "{x}");
    }

    #[test]
    fn an_i_is_softer_than_its_box_and_nonsense_is_refused() {
        let solid = Section { width: 0.004, height: 0.006, flange: 0.003, web: 0.004, modulus: 2.4e6 };
        let beam = Section { flange: 0.0015, web: 0.001, ..solid };
        for (i, full) in beam.hinges(0.02, 10).iter().zip(solid.hinges(0.02, 10)) {
            assert!(*i < full && *i > 0.1 * full, "{i} {full}");
        }
        assert!(Section { flange: 0.004, ..solid }.check().unwrap_err().to_string().contains("4 × 6 × 4 × 4 mm"));
        assert!(Section { modulus: f64::NAN, ..solid }.check().is_err());
    }
}

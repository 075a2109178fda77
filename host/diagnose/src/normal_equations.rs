//! Normal equations of the linear model about a fit, segment by segment, with each segment's start eliminated.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::current::current_at;
use super::fit::{Columns, Data, with_current};
use super::rollout::{Normal2, Rolled, residual};
use super::track::{Segment, Track};

/// A segment's share, in units of the noise.
pub struct SegmentEquations {
    /// Curvature.
    pub matrix: DMatrix<f64>,
    /// What the numbers are pulled by.
    pub gradient: DVector<f64>,
    /// The start's own equations, for back substitution.
    pub start: Normal2,
    /// Their coupling to the numbers.
    pub coupling: Vec<[f64; 2]>,
}

/// A track's share, where its segments' curvatures are not asked for: of many numbers they are large.
pub struct TrackEquations {
    /// Curvature.
    pub matrix: DMatrix<f64>,
    /// Of each segment.
    pub gradients: Vec<DVector<f64>>,
}

/// Every track's share.
pub fn of_tracks(data: &Data, rolled: &[Rolled], columns: &[Columns]) -> Vec<TrackEquations> {
    let of_track = |(index, columns): (usize, &Columns)| {
        let size = columns.len() - 2;
        let mut equations = TrackEquations { matrix: DMatrix::zeros(size, size), gradients: Vec::new() };
        for segment in of_segments(data, &data.tracks[index], &rolled[index], columns) {
            equations.matrix += segment.matrix;
            equations.gradients.push(segment.gradient);
        }
        equations
    };
    columns.par_iter().enumerate().map(of_track).collect()
}

/// The shares of a track's segments, one after the other.
pub fn of_segments<'a>(
    data: &'a Data,
    track: &'a Track,
    rolled: &'a Rolled,
    columns: &'a Columns,
) -> impl Iterator<Item = SegmentEquations> + 'a {
    let mut first = 0;
    track.segments.iter().map(move |segment| {
        let places = first..first + segment.last - segment.first;
        first = places.end;
        eliminate(&products(&rows(data, track, segment, rolled, columns, places)))
    })
}

/// Takes the start out of the sums of products of the rows' entries: the start's two come first, what is left last.
fn eliminate(products: &DMatrix<f64>) -> SegmentEquations {
    let left = products.nrows() - 1;
    let size = left - 2;
    let of_start = |i: usize| [products[(i, 0)], products[(i, 1)]];
    let start = Normal2 { aa: products[(0, 0)], ab: products[(1, 0)], bb: products[(1, 1)], gradient: of_start(left) };
    let coupling: Vec<[f64; 2]> = (2..left).map(of_start).collect();
    let back = start.solve(start.gradient);
    let gradient =
        DVector::from_fn(size, |i, _| products[(left, i + 2)] - coupling[i][0] * back[0] - coupling[i][1] * back[1]);
    let mut matrix = DMatrix::zeros(size, size);
    for i in 0..size {
        let solved = start.solve(coupling[i]);
        for j in 0..=i {
            matrix[(i, j)] = products[(i + 2, j + 2)] - coupling[j][0] * solved[0] - coupling[j][1] * solved[1];
        }
    }
    matrix.fill_upper_triangle_with_lower_triangle();
    SegmentEquations { matrix, gradient, start, coupling }
}

/// The rows of a segment's equations in units of the noise, one after the other: how a reading or a current changes with the
/// starts' two and with each number, and what is left of it.
fn rows(
    data: &Data,
    track: &Track,
    segment: &Segment,
    rolled: &Rolled,
    columns: &Columns,
    places: Range<usize>,
) -> DMatrix<f64> {
    let width = columns.len() + 1;
    let mut rows = Vec::with_capacity(places.len() * width);
    let weight = 1.0 / data.sigma;
    for (k, place) in (segment.first..segment.last).zip(places) {
        if track.weight[k] > 0.0 {
            rows.extend(columns.iter().map(|column| column.0[place] * weight));
            rows.push(residual(track, segment, k, rolled.readings[place]) * weight);
        }
        if let (Some(sigma), true) = (data.sigma_current, with_current(data, track) && k > segment.first)
            && let Some(simulated) = current_at(track, k, &rolled.currents, place)
        {
            // The start's speed moves the current too, but so little beside the angle that it is left out.
            rows.extend([0.0; 2]);
            rows.extend(columns[2..].iter().map(|column| 0.5 * (column.1[place - 1] + column.1[place]) / sigma));
            rows.push((track.current[k] - simulated) / sigma);
        }
    }
    DMatrix::from_vec(width, rows.len() / width, rows)
}

/// Sums of the products of the rows' entries.
fn products(rows: &DMatrix<f64>) -> DMatrix<f64> {
    rows * rows.transpose()
}

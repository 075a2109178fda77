//! The word EXIT as strokes: a picture in pixels has no font, and these letters are straight lines.

/// Width and height of a letter, and from one to the next, in edges of the cell.
const WIDTH: f64 = 0.13;
const HEIGHT: f64 = 0.2;
const STEP: f64 = 0.19;

/// Each letter's strokes: 0 … 1 to the right and up.
const LETTERS: [&[&[[f64; 2]]]; 4] = [
    &[&[[1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0]], &[[0.0, 0.5], [0.8, 0.5]]],
    &[&[[0.0, 0.0], [1.0, 1.0]], &[[0.0, 1.0], [1.0, 0.0]]],
    &[&[[0.5, 0.0], [0.5, 1.0]]],
    &[&[[0.0, 1.0], [1.0, 1.0]], &[[0.5, 0.0], [0.5, 1.0]]],
];

/// Its strokes about the word's middle, in edges of the cell, to the right and up.
pub(super) fn exit() -> Vec<Vec<[f64; 2]>> {
    let letters = LETTERS.iter().enumerate();
    let strokes = letters.flat_map(|(place, letter)| letter.iter().map(move |stroke| (place, *stroke)));
    strokes
        .map(|(place, stroke)| {
            let left = STEP * (place as f64 - 0.5 * (LETTERS.len() - 1) as f64) - 0.5 * WIDTH;
            stroke.iter().map(|[x, y]| [left + WIDTH * x, HEIGHT * (y - 0.5)]).collect()
        })
        .collect()
}

//! Speeds of conditions, simulated over measured.

use identify::robot::ConditionFit;
use plotters::prelude::*;

use super::{Area, Drawn, FigureError, INK, Margins, Scale, axes, font, sheet};

const BEFORE: RGBColor = RGBColor(160, 160, 160);
const FITTED: RGBColor = RGBColor(33, 102, 172);
const HELD_OUT: RGBColor = RGBColor(214, 96, 20);
/// Of a panel, pixels.
const SIZE: (i32, i32) = (380, 360);
const MARGINS: Margins = Margins { left: 74, right: 20, top: 12, bottom: 46 };
/// Over the panels.
const LEGEND: i32 = 34;
const NAMES: [&str; 3] = ["vx, mm/s", "vy, mm/s", "yaw, °/s"];

/// A panel a speed: what was simulated over what was measured, with the file's numbers (grey, unless they are those found), with those found
/// under the fitted conditions (blue) and under the held-out ones (orange).
///
/// # Errors
/// The drawing library refuses.
pub fn speeds_svg(conditions: &[ConditionFit]) -> Result<String, FigureError> {
    let size = (3 * SIZE.0 as u32, (LEGEND + SIZE.1) as u32);
    sheet("speeds", size, |root| {
        legend(root, conditions)?;
        for (part, name) in NAMES.iter().enumerate() {
            let area = root.clone().shrink((part as i32 * SIZE.0, LEGEND), SIZE);
            panel(&area, name, part, conditions)?;
        }
        Ok(())
    })
}

/// Whether any dot of the file's numbers is beside that of those found.
fn is_moved(conditions: &[ConditionFit]) -> bool {
    conditions.iter().any(|one| one.before != one.after)
}

fn legend(root: &Area<'_>, conditions: &[ConditionFit]) -> Drawn {
    let entries = [(BEFORE, "the file's numbers"), (FITTED, "found, fitted"), (HELD_OUT, "found, held out")];
    let shown = entries.into_iter().skip(usize::from(!is_moved(conditions)));
    for (place, (colour, words)) in shown.enumerate() {
        let x = 80 + 220 * place as i32;
        root.draw(&Circle::new((x, 18), 4, colour.filled()))?;
        root.draw(&Text::new(words, (x + 12, 10), font(15)))?;
    }
    Ok(())
}

fn panel(area: &Area<'_>, name: &str, part: usize, conditions: &[ConditionFit]) -> Drawn {
    let measured: Vec<(f64, &ConditionFit)> =
        conditions.iter().filter_map(|one| Some((one.measured[part]?, one))).collect();
    let all = measured.iter().flat_map(|(measured, one)| [*measured, one.before[part], one.after[part]]);
    let (low, high) = all.fold((0.0f64, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    let more = (0.06 * (high - low)).max(1e-3);
    let range = (low - more, high + more);
    let (x, y) = (format!("measured {name}"), format!("simulated {name}"));
    let scale = |words| Scale { range, words, marks: 6 };
    let mut chart = axes(area, MARGINS, &scale(&x), &scale(&y))?;
    chart.draw_series(LineSeries::new([(range.0, range.0), (range.1, range.1)], INK.stroke_width(1)))?;
    let grey = measured.iter().filter(|_| is_moved(conditions));
    let before = grey.map(|(at, one)| Circle::new((*at, one.before[part]), 3, BEFORE.filled()));
    chart.draw_series(before)?;
    let after = measured.iter().map(|(at, one)| {
        let colour = if one.held_out { HELD_OUT } else { FITTED };
        Circle::new((*at, one.after[part]), 4, colour.filled())
    });
    chart.draw_series(after)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_is_drawn_where_it_was_measured() {
        let one = |held_out, yaw| ConditionFit {
            f_hz: 7.0,
            alpha_deg: 60.0,
            held_out,
            measured: [Some(10.0), Some(-1.0), yaw],
            before: [2.0, 0.0, 1.0],
            after: [9.5, -1.1, 0.5],
        };
        let svg = speeds_svg(&[one(false, Some(0.4)), one(true, None)]).unwrap();
        let circles = |colour: &str| svg.matches("<circle").count().min(svg.matches(colour).count());
        // A legend entry, and a dot for each speed that was measured.
        assert_eq!((circles("#2166AC"), circles("#D66014")), (1 + 3, 1 + 2), "{svg}");
        assert!(svg.contains("measured vx, mm/s") && svg.contains("s numbers"));
        // The file's own numbers were found: no grey dots under the others.
        let same = ConditionFit { after: [2.0, 0.0, 1.0], ..one(false, Some(0.4)) };
        let svg = speeds_svg(&[same]).unwrap();
        assert!(svg.matches("<circle").count() == 2 + 3 && !svg.contains("s numbers"), "{svg}");
    }
}

//! What the diagnosis of a walk says to people.

use effects::Id;

use super::feet::pointed;
use super::outcome::{WalkCause, WalkDiagnosis};
use super::place::Place;
use crate::Verdict;

/// A headline, then what to do.
pub fn summary(diagnosis: &WalkDiagnosis) -> Vec<String> {
    let mut lines = match diagnosis.verdict {
        Verdict::Nothing => {
            vec![
                "The simulated walk lacks nothing that these speeds show: what is left is what repeats scatter by."
                    .into(),
            ]
        }
        Verdict::Explained => vec![format!("The simulated walk lacks {}.", named(&diagnosis.causes))],
        Verdict::Ambiguous => {
            let also: Vec<String> =
                diagnosis.causes.iter().flat_map(|cause| &cause.also).map(|name| title(name)).collect();
            vec![
                format!("The simulated walk lacks {}, or {}.", named(&diagnosis.causes), also.join(", or ")),
                "These speeds do not tell them apart: measure at further frequencies and α.".into(),
            ]
        }
        Verdict::Unexplained => {
            vec!["The simulated walk is wrong beyond its numbers, and no effect of the catalogue explains it.".into()]
        }
    };
    lines.extend(diagnosis.place.as_ref().map(|place| format!("It is most clearly wrong {}.", whereabouts(place))));
    if diagnosis.verdict == Verdict::Unexplained {
        lines.extend(pointed(&diagnosis.feet).map(|foot| {
            let (side, module) = foot.side_and_module();
            let share = foot.share;
            format!(
                "Of single feet, the {side} one of module {module} says most, with {share:.2} of the ground's friction."
            )
        }));
    }
    lines
}

fn named(causes: &[WalkCause]) -> String {
    causes.iter().map(|cause| title(&cause.effect)).collect::<Vec<_>>().join(" and ")
}

fn title(name: &str) -> String {
    Id::of(name).map_or_else(|| name.to_owned(), |id| id.spec().title.to_owned())
}

fn whereabouts(place: &Place) -> String {
    let at = &place.at;
    let part = match place.by.as_str() {
        "frequency_hz" => format!("at {at} Hz"),
        "direction" => format!("while the eccentric turns {at}"),
        "alpha_deg" => format!("at α = {at}°"),
        _ => format!("in {at}"),
    };
    format!("{part}: off by {:.1} of what the means are known to, elsewhere by {:.1}", place.misfit, place.elsewhere)
}

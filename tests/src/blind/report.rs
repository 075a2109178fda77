//! What a campaign reached, beside what is asked.

use std::collections::BTreeSet;

use comfy_table::Table;

use super::case::Category;
use super::heard::Heard;
use super::score::{Mark, Outcome, confusion, median_and_worst};

/// A bar and what was reached.
#[derive(Clone, Debug)]
pub struct Bar {
    /// For people.
    pub line: String,
    /// Whether it is reached.
    pub reached: bool,
}

/// Truth against verdict.
#[must_use]
pub fn table(outcomes: &[Outcome]) -> Table {
    let counts = confusion(outcomes);
    let columns: BTreeSet<&String> = counts.values().flat_map(|row| row.keys()).collect();
    let mut shown = Table::new();
    shown.set_header(["hidden".to_owned()].into_iter().chain(columns.iter().map(|&column| column.clone())));
    for ((category, truth), row) in &counts {
        let name = match category {
            Category::Hidden | Category::Nothing | Category::Outside | Category::Mistaken => truth.clone(),
            Category::Weak => format!("{truth} (weak)"),
            Category::Two => format!("{truth} (two)"),
            Category::Beside => format!("{truth} (beside known effects)"),
        };
        let cells = columns.iter().map(|column| row.get(*column).map_or(String::new(), usize::to_string));
        shown.add_row([name].into_iter().chain(cells));
    }
    shown
}

/// Every bar that was tried.
#[must_use]
pub fn bars(outcomes: &[Outcome]) -> Vec<Bar> {
    let count = |category: Category, pick: &dyn Fn(&Outcome) -> bool| {
        outcomes.iter().filter(|one| one.category == category && pick(one)).count()
    };
    let marked = |category, mark: Mark| count(category, &|one| one.mark == mark);
    let named = |category| count(category, &|one| matches!(one.mark, Mark::Right | Mark::InClass));
    let all = |category| count(category, &|_| true);
    let mut bars = Vec::new();
    let mut bar = |name: &str, value: String, wanted: String, reached: bool| {
        let line = format!("{} {name}: {value} (bar: {wanted})", word(reached));
        bars.push(Bar { line, reached });
    };
    // The bars are for so many data sets; of others in proportion, rounded in favour of nobody.
    let sets = all(Category::Hidden);
    if sets > 0 {
        let (right, most) = (named(Category::Hidden), sets * 6 / 120);
        let value = format!(
            "{right} of {sets} named right, {} of them in a stated class, {} under a wrong name",
            marked(Category::Hidden, Mark::InClass),
            marked(Category::Hidden, Mark::FalseName)
        );
        bar("one effect", value, format!("{}", sets - most), right + most >= sets);
    }
    let sets = all(Category::Weak);
    if sets > 0 {
        let (right, wrong) = (named(Category::Weak), marked(Category::Weak, Mark::FalseName));
        let (most, most_wrong) = (sets * 12 / 60, sets * 2 / 60);
        let value = format!("{right} of {sets} named right, {wrong} under a wrong name");
        bar(
            "one weak effect",
            value,
            format!("{}, at most {most_wrong} wrong", sets - most),
            right + most >= sets && wrong <= most_wrong,
        );
    }
    let sets = all(Category::Nothing);
    if sets > 0 {
        let (alarms, most) = (sets - marked(Category::Nothing, Mark::Right), sets * 6 / 300);
        bar("nothing", format!("{alarms} alarms of {sets}"), format!("at most {most}"), alarms <= most);
    }
    let sets = all(Category::Two);
    if sets > 0 {
        let (both, one, wrong) =
            (named(Category::Two), marked(Category::Two, Mark::OneOfTwo), marked(Category::Two, Mark::FalseName));
        let (least, least_one, most) = (sets - sets * 12 / 60, sets - sets * 3 / 60, sets * 3 / 60);
        bar(
            "two effects",
            format!("both in {both} of {sets}, one in {}, {wrong} with one that is not there", both + one),
            format!("{least}, {least_one}, at most {most}"),
            both >= least && both + one >= least_one && wrong <= most,
        );
    }
    let sets = all(Category::Outside);
    if sets > 0 {
        let open = marked(Category::Outside, Mark::Right);
        let wrong = marked(Category::Outside, Mark::FalseName);
        let place = count(Category::Outside, &|one| one.right_place() == Some(true));
        let (least, least_place, most) = (sets - sets * 4 / 40, sets - sets * 10 / 40, sets / 40);
        bar(
            "outside",
            format!("{open} of {sets} unexplained, the right coordinate in {place}, {wrong} under a false name"),
            format!("{least}, {least_place}, at most {most}"),
            open >= least && place >= least_place && wrong <= most,
        );
    }
    let sets = all(Category::Mistaken);
    if sets > 0 {
        let heard = |pick: fn(&Heard) -> bool| count(Category::Mistaken, &|one| one.heard.as_ref().is_some_and(pick));
        let right = marked(Category::Mistaken, Mark::Right);
        let value = format!(
            "{right} of {sets} said with the mend: {} by the check of the rig, {} by the diagnosis, {} under a physical name",
            heard(|heard| heard.by_check),
            heard(|heard| heard.by_diagnosis),
            heard(|heard| heard.named)
        );
        bar("mistaken", value, format!("{sets}"), right == sets);
    }
    let single = |one: &&Outcome| matches!(one.category, Category::Hidden | Category::Weak) && one.passed();
    for (name, pick) in [("estimated", 0), ("true", 1)] {
        let after = outcomes.iter().filter(single).filter_map(Outcome::after);
        if let Some((median, worst)) = median_and_worst(after.map(|both| [both.0, both.1][pick]).collect()) {
            let value = format!("median {median:.3}, worst {worst:.3} times the {name} floor");
            // What noise that remembers leaves is more than the fast scatter that the estimate is made from.
            let reached = name == "estimated" || (median <= 1.02 && worst <= 1.15);
            bar("after extension", value, if name == "true" { "1.02, 1.15" } else { "none" }.to_owned(), reached);
        }
    }
    let (right, sets) = (named(Category::Beside), all(Category::Beside));
    if sets > 0 {
        bar("beside known effects", format!("{right} of {sets} named right"), "none".to_owned(), true);
    }
    bars.extend(times(outcomes));
    bars.extend(memory(outcomes));
    bars
}

/// What a rule that names the model with the least held-out error, and never keeps silent, would have reached on the same sets; `None`
/// for outcomes of a journal that does not know it.
#[must_use]
pub fn lowest_wins(outcomes: &[Outcome]) -> Option<String> {
    outcomes.iter().find(|one| !one.lowest.is_empty())?;
    let of = |category: Category| {
        let sets: Vec<&Outcome> = outcomes.iter().filter(|one| one.category == category).collect();
        let marked = |mark| sets.iter().filter(|one| one.lowest_mark() == mark).count();
        let (right, wrong) = (marked(Mark::Right), marked(Mark::FalseName));
        (!sets.is_empty()).then(|| format!("{} {right} of {} right, {wrong} false names", category.word(), sets.len()))
    };
    let told: Vec<String> =
        [Category::Hidden, Category::Weak, Category::Two, Category::Outside].into_iter().filter_map(of).collect();
    Some(format!("beside it, lowest held-out error wins: {}", told.join("; ")))
}

/// Runs of the bar on time: about 8 s at 1 kHz.
fn is_usual((per_s, seconds): (f64, f64)) -> bool {
    per_s == 1000.0 && (6.0..=10.0).contains(&seconds)
}

/// How long a data set takes. A machine that does other work as well takes longer: what is missed is shown, and fails nothing.
fn times(outcomes: &[Outcome]) -> Vec<Bar> {
    let of = |pick: fn((f64, f64)) -> bool| {
        // What a reader refuses takes no time.
        let diagnosed = outcomes.iter().filter(|one| one.said.is_ok() && one.recorded.is_some_and(pick));
        let times: Vec<f64> = diagnosed.map(|one| one.seconds).collect();
        let count = times.len();
        median_and_worst(times).map(|(median, worst)| (count, median, worst))
    };
    let bar = |what: &str, (count, median, worst): (usize, f64, f64), wanted: &str, reached: bool| Bar {
        line: format!(
            "{} time, {what}: median {median:.1} s, longest {worst:.1} s of {count} data sets (bar: {wanted}; fails nothing)",
            word(reached)
        ),
        reached: true,
    };
    let usual = of(is_usual)
        .map(|time| bar("runs of 6 to 10 s at 1 kHz", time, "median 1 s, worst 5 s", time.1 <= 1.0 && time.2 <= 5.0));
    let fast = of(|(per_s, _)| per_s == 5000.0).map(|time| bar("5 kHz", time, "worst 10 s", time.2 <= 10.0));
    let all = of(|_| true).map(|time| bar("every setting", time, "none", true));
    [usual, fast, all].into_iter().flatten().collect()
}

/// Most that a diagnosis may hold beyond what the process had before, MB.
const MOST_MB: f64 = 200.0;

/// How much memory a data set takes; where no machine said, that is said.
fn memory(outcomes: &[Outcome]) -> Option<Bar> {
    let peaks: Vec<f64> = outcomes.iter().filter_map(|one| one.peak_mb).collect();
    let unknown = outcomes.len() - peaks.len();
    let not_measured = if unknown > 0 { format!(", not measured in {unknown}") } else { String::new() };
    let Some((median, worst)) = median_and_worst(peaks) else {
        let line = "---- memory: not measured: this machine does not say it (bar: 200 MB)".to_owned();
        return (!outcomes.is_empty()).then_some(Bar { line, reached: true });
    };
    let reached = worst <= MOST_MB;
    let line = format!(
        "{} memory: median {median:.0} MB, most {worst:.0} MB beyond what the process had{not_measured} (bar: {MOST_MB:.0} MB)",
        word(reached)
    );
    Some(Bar { line, reached })
}

fn word(reached: bool) -> &'static str {
    if reached { "ok  " } else { "MISS" }
}

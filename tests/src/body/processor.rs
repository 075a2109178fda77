//! Which processor a figure was measured on.

/// The processor's name as the system tells it, and how many of its threads there are.
#[must_use]
pub fn processor() -> String {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    format!("{}, {threads} threads", name(&told).unwrap_or("an unnamed processor"))
}

/// What Linux says of the first processor.
fn name(told: &str) -> Option<&str> {
    let line = told.lines().find(|line| line.starts_with("model name"))?;
    line.split_once(':').map(|(_, name)| name.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_is_behind_the_colon() {
        let told = "processor\t: 0\nmodel\t\t: 17\nmodel name\t: A Processor 9000 @ 2.0 GHz\nflags\t\t: fpu\nmodel name\t: B\n";
        assert_eq!(name(told), Some("A Processor 9000 @ 2.0 GHz"));
        assert_eq!(name("processor: 0\n"), None);
        assert!(processor().contains("threads"));
    }
}

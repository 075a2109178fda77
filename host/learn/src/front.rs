//! What nothing else beats in two respects at once.

/// The places of those than which none is better in both respects (greater is better), the best in the first one first.
pub fn front<T>(all: &[T], [first, second]: [fn(&T) -> f64; 2]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..all.len()).collect();
    places.sort_by(|&a, &b| {
        let (a, b) = (&all[a], &all[b]);
        first(b).total_cmp(&first(a)).then(second(b).total_cmp(&second(a)))
    });
    let mut most = f64::NEG_INFINITY;
    places.retain(|&place| {
        let is_better = second(&all[place]) > most;
        most = most.max(second(&all[place]));
        is_better
    });
    places
}

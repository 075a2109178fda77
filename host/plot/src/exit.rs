//! Where a maze ends.

/// The cell that is a maze's exit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exit {
    /// Its middle, m.
    pub centre: [f64; 2],
    /// Its edge, m.
    pub edge_m: f64,
}

impl Exit {
    /// Counter-clockwise, m.
    pub(crate) fn corners(self) -> [[f64; 2]; 4] {
        let ([x, y], half) = (self.centre, 0.5 * self.edge_m);
        [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]]
    }
}

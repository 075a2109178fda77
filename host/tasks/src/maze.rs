//! Mazes of square cells with walls between them: the only place that knows where a maze's walls and its exit are.
//!
//! Cell (0, 0) has its centre at the origin, columns run along +x and rows along +y. The robot starts in the first cell of the way,
//! facing the second.

use std::f64::consts::FRAC_PI_2;

use hal_sim::body::Wall;
use hal_sim::random::{Source, Stream};
use pathfinding::prelude::dijkstra_all;

/// Column and row of a cell.
pub type Cell = [usize; 2];

/// A side of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards +x.
    East,
    /// Towards +y.
    North,
    /// Towards −x.
    West,
    /// Towards −y.
    South,
}

impl Side {
    /// All of them, counter-clockwise.
    pub const ALL: [Self; 4] = [Self::East, Self::North, Self::West, Self::South];

    /// Column and row of the neighbour less those of the cell.
    fn step(self) -> [isize; 2] {
        match self {
            Self::East => [1, 0],
            Self::North => [0, 1],
            Self::West => [-1, 0],
            Self::South => [0, -1],
        }
    }

    /// Direction, rad.
    #[must_use]
    pub fn heading(self) -> f64 {
        match self {
            Self::East => 0.0,
            Self::North => FRAC_PI_2,
            Self::West => std::f64::consts::PI,
            Self::South => -FRAC_PI_2,
        }
    }
}

/// A maze.
#[derive(Clone, Debug, PartialEq)]
pub struct Maze {
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// Of each cell, row after row: whether one can pass through its sides, in the order of [`Side::ALL`].
    open: Vec<[bool; 4]>,
    start: Cell,
    exit: Cell,
    /// Of each cell: how many cells it is to the exit along the corridors.
    steps: Vec<usize>,
}

/// What no way leads through.
const UNREACHED: usize = usize::MAX;

impl Maze {
    /// Edge of a cell that leaves the default robot, 0.14 m long, 20 mm to either side as it turns about its centre, m. Chosen: the thesis says
    /// that the corridors are narrow.
    pub const CELL_M: f64 = 0.18;

    /// The maze of the thesis's figure 5.5, from its description: straight ahead, a right-angle turn to the right, straight, one to the
    /// left, straight. The figure gives no lengths: three cells, two, and three. A cell of 0.18 m leaves the default robot, 0.14 m long,
    /// 20 mm to either side as it turns about its centre.
    #[must_use]
    pub fn figure_5_5(cell_m: f64) -> Self {
        let way = [[0, 2], [1, 2], [2, 2], [2, 1], [2, 0], [3, 0], [4, 0]];
        Self::from_way(cell_m, [5, 3], &way)
    }

    /// A single corridor through these cells, each beside the one before.
    fn from_way(cell_m: f64, [columns, rows]: [usize; 2], way: &[Cell]) -> Self {
        let mut maze = Self::closed(cell_m, [columns, rows], way[0], way[way.len() - 1]);
        for pair in way.windows(2) {
            maze.join(pair[0], pair[1]);
        }
        maze.find_way();
        maze
    }

    /// A maze drawn at random in which exactly one way leads from any cell to any other: a depth-first search that tries the sides in
    /// random order. It starts in cell (0, 0); its exit is the opposite corner.
    ///
    /// # Panics
    /// If there are not at least two cells.
    #[must_use]
    pub fn random(cell_m: f64, columns: usize, rows: usize, seed: u64) -> Self {
        assert!(columns * rows > 1, "a maze needs two cells or more");
        let mut maze = Self::closed(cell_m, [columns, rows], [0, 0], [columns - 1, rows - 1]);
        let mut stream = Stream::new(seed, Source::Maze);
        let mut visited = vec![false; columns * rows];
        visited[0] = true;
        let mut stack: Vec<Cell> = vec![[0, 0]];
        while let Some(cell) = stack.last().copied() {
            let new = |cell: &Cell| !visited[cell[1] * columns + cell[0]];
            let beside: Vec<Cell> = Side::ALL.iter().filter_map(|side| maze.beside(cell, *side)).filter(new).collect();
            if beside.is_empty() {
                stack.pop();
                continue;
            }
            let next = beside[stream.below(beside.len() as u32) as usize];
            visited[next[1] * columns + next[0]] = true;
            maze.join(cell, next);
            stack.push(next);
        }
        maze.find_way();
        maze
    }

    fn closed(cell_m: f64, [columns, rows]: [usize; 2], start: Cell, exit: Cell) -> Self {
        let cells = columns * rows;
        Self { cell_m, columns, rows, open: vec![[false; 4]; cells], start, exit, steps: vec![UNREACHED; cells] }
    }

    fn index(&self, [column, row]: Cell) -> usize {
        row * self.columns + column
    }

    /// The cell on the other side, if the maze goes on there.
    fn beside(&self, cell: Cell, side: Side) -> Option<Cell> {
        let [dx, dy] = side.step();
        let (column, row) = (cell[0].checked_add_signed(dx)?, cell[1].checked_add_signed(dy)?);
        (column < self.columns && row < self.rows).then_some([column, row])
    }

    /// Opens the side between two cells beside each other.
    fn join(&mut self, a: Cell, b: Cell) {
        for (k, side) in Side::ALL.into_iter().enumerate() {
            if self.beside(a, side) == Some(b) {
                let (a, b) = (self.index(a), self.index(b));
                self.open[a][k] = true;
                self.open[b][(k + 2) % 4] = true;
            }
        }
    }

    /// Counts the cells to the exit.
    fn find_way(&mut self) {
        let maze = &*self;
        let beside = |cell: &Cell| {
            let next = |side: Side| maze.beside(*cell, side).map(|next| (next, 1));
            maze.ways(*cell).into_iter().filter_map(next).collect::<Vec<_>>()
        };
        let reached = dijkstra_all(&self.exit, beside);
        for (cell, (_, steps)) in reached {
            let index = self.index(cell);
            self.steps[index] = steps;
        }
        let exit = self.index(self.exit);
        self.steps[exit] = 0;
    }

    /// Edge of a cell, m: from wall to wall.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// The open sides of a cell.
    ///
    /// # Panics
    /// There is no such cell.
    #[must_use]
    pub fn ways(&self, cell: Cell) -> Vec<Side> {
        let open = self.open[self.index(cell)];
        Side::ALL.into_iter().zip(open).filter(|(_, open)| *open).map(|(side, _)| side).collect()
    }

    /// Centre of a cell, m.
    #[must_use]
    pub fn centre(&self, cell: Cell) -> [f64; 2] {
        cell.map(|index| index as f64 * self.cell_m)
    }

    /// Where the robot starts, m.
    #[must_use]
    pub fn start(&self) -> [f64; 2] {
        self.centre(self.start)
    }

    /// Where it faces as it starts, rad: along the way.
    #[must_use]
    pub fn start_heading(&self) -> f64 {
        self.onward(self.start).map_or(0.0, Side::heading)
    }

    /// Centre of the exit's cell, m.
    #[must_use]
    pub fn exit_centre(&self) -> [f64; 2] {
        self.centre(self.exit)
    }

    /// The cell of a point, none outside.
    #[must_use]
    pub fn cell_at(&self, point: [f64; 2]) -> Option<Cell> {
        let [x, y] = point.map(|p| (p / self.cell_m).round());
        let inside = x >= 0.0 && y >= 0.0 && x < self.columns as f64 && y < self.rows as f64;
        inside.then_some([x as usize, y as usize])
    }

    /// Whether a point is in the exit's cell.
    #[must_use]
    pub fn at_exit(&self, point: [f64; 2]) -> bool {
        self.cell_at(point) == Some(self.exit)
    }

    /// The side of a cell through which the way leads on to the exit; none at the exit, and where no way leads there.
    #[must_use]
    pub fn onward(&self, cell: Cell) -> Option<Side> {
        let here = self.steps[self.index(cell)];
        let nearer = |side: &Side| self.beside(cell, *side).is_some_and(|next| self.steps[self.index(next)] < here);
        self.ways(cell).into_iter().find(nearer)
    }

    /// The cells from one to the exit, both included.
    #[must_use]
    pub fn way_from(&self, cell: Cell) -> Vec<Cell> {
        let next = |cell: &Cell| self.onward(*cell).and_then(|side| self.beside(*cell, side));
        std::iter::successors(Some(cell), next).collect()
    }

    /// The way from the start to the exit, along the middles of the corridors: its first point, its corners and its last one, m.
    #[must_use]
    pub fn way(&self) -> Vec<[f64; 2]> {
        let cells = self.way_from(self.start);
        let corner = |place: usize| {
            let (before, after) = (cells[place - 1], cells[place + 1]);
            before[0] != after[0] && before[1] != after[1]
        };
        let ends = |place: usize| place == 0 || place + 1 == cells.len();
        (0..cells.len()).filter(|place| ends(*place) || corner(*place)).map(|place| self.centre(cells[place])).collect()
    }

    /// From a point to where the exit's cell begins, along the middles of the corridors, m; a point beside the middle is as much farther.
    /// 0 in the exit's cell. Of a point outside: that of the nearest cell.
    #[must_use]
    pub fn distance_to_exit(&self, point: [f64; 2]) -> f64 {
        let most = [self.columns - 1, self.rows - 1];
        let nearest = |axis: usize| (point[axis] / self.cell_m).round().clamp(0.0, most[axis] as f64) as usize;
        let cell = [nearest(0), nearest(1)];
        let Some(side) = self.onward(cell) else { return 0.0 };
        let centre = self.centre(cell);
        let off = [point[0] - centre[0], point[1] - centre[1]];
        let along = side.step().map(|step| step as f64);
        let ahead = off[0] * along[0] + off[1] * along[1];
        let beside = (off[1] * along[0] - off[0] * along[1]).abs();
        (self.steps[self.index(cell)] as f64 - 0.5) * self.cell_m - ahead + beside
    }

    /// The walls: every closed side, those on one line as one wall.
    #[must_use]
    pub fn walls(&self) -> Vec<Wall> {
        let edge = |line: usize| (line as f64 - 0.5) * self.cell_m;
        let mut walls = vec![];
        for row in 0..=self.rows {
            for [from, to] in runs(self.columns, |column| self.closed_between(column, row, true)) {
                walls.push(Wall { from: [edge(from), edge(row)], to: [edge(to), edge(row)] });
            }
        }
        for column in 0..=self.columns {
            for [from, to] in runs(self.rows, |row| self.closed_between(row, column, false)) {
                walls.push(Wall { from: [edge(column), edge(from)], to: [edge(column), edge(to)] });
            }
        }
        walls
    }

    /// Whether a wall stands between cell `line − 1` and cell `line`, the other coordinate being `index`: between rows or columns.
    /// Between two cells into which no way leads there is none to be seen.
    fn closed_between(&self, index: usize, line: usize, rows: bool) -> bool {
        let (lines, side) = if rows { (self.rows, 1) } else { (self.columns, 0) };
        let cell = |line: usize| if rows { [index, line] } else { [line, index] };
        let used = |line: usize| self.open[self.index(cell(line))].contains(&true);
        match (line.checked_sub(1), line < lines) {
            (Some(before), true) => (used(before) || used(line)) && !self.open[self.index(cell(before))][side],
            (Some(before), false) => used(before),
            (None, _) => used(line),
        }
    }
}

/// The longest ranges of indices that are closed: the first, and one past the last.
fn runs(count: usize, closed: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let mut runs: Vec<[usize; 2]> = vec![];
    for index in (0..count).filter(|index| closed(*index)) {
        match runs.last_mut() {
            Some([_, end]) if *end == index => *end += 1,
            _ => runs.push([index, index + 1]),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_maze_of_figure_5_5_turns_right_and_then_left() {
        let maze = Maze::figure_5_5(0.2);
        let way = maze.way_from([0, 2]);
        let sides: Vec<Side> = way.iter().filter_map(|cell| maze.onward(*cell)).collect();
        use Side::{East, South};
        assert_eq!(sides, [East, East, South, South, East, East]);
        assert_eq!((maze.start(), maze.start_heading()), ([0.0, 0.4], 0.0));
        assert_eq!(maze.way(), [[0.0, 0.4], [0.4, 0.4], [0.4, 0.0], [0.8, 0.0]]);
        // 6 cells of 0.2 m, less the half of the last.
        assert!((maze.distance_to_exit(maze.start()) - 1.1).abs() < 1e-12);
        assert!((maze.distance_to_exit([0.03, 0.41]) - (1.1 - 0.03 + 0.01)).abs() < 1e-12);
        // Past the corner, 5 cm down: 3.5 cells less 5 cm.
        assert!((maze.distance_to_exit([0.4, 0.35]) - (3.5 * 0.2 - 0.05)).abs() < 1e-12);
        assert!(maze.at_exit([0.78, 0.02]) && !maze.at_exit([0.68, 0.0]) && maze.distance_to_exit([0.8, 0.0]) == 0.0);
    }

    #[test]
    fn its_walls_are_those_of_an_s() {
        let maze = Maze::figure_5_5(1.0);
        let walls = maze.walls();
        let has = |from: [f64; 2], to: [f64; 2]| walls.contains(&Wall { from, to });
        assert!(has([-0.5, 2.5], [2.5, 2.5]) && has([-0.5, 1.5], [1.5, 1.5]), "{walls:?}");
        assert!(has([1.5, -0.5], [4.5, -0.5]) && has([2.5, 0.5], [4.5, 0.5]));
        assert!(has([-0.5, 1.5], [-0.5, 2.5]) && has([4.5, -0.5], [4.5, 0.5]));
        assert!(has([1.5, -0.5], [1.5, 1.5]) && has([2.5, 0.5], [2.5, 2.5]));
        assert_eq!(walls.len(), 8);
    }

    #[test]
    fn a_random_maze_leads_from_every_cell_to_the_exit_by_one_way() {
        for seed in 0..20 {
            let maze = Maze::random(0.2, 6, 4, seed);
            let joints: usize = maze.open.iter().flatten().filter(|open| **open).count() / 2;
            assert_eq!(joints, 6 * 4 - 1, "a tree");
            assert!(maze.steps.iter().all(|steps| *steps < 24));
            assert_eq!(maze.way_from([0, 0]).last(), Some(&[5, 3]));
        }
        assert_eq!(Maze::random(0.2, 6, 4, 3), Maze::random(0.2, 6, 4, 3));
        assert_ne!(Maze::random(0.2, 6, 4, 3), Maze::random(0.2, 6, 4, 4));
    }

    #[test]
    fn no_way_leads_through_a_wall() {
        let maze = Maze::random(0.2, 5, 5, 7);
        let walls = maze.walls();
        let crosses = |a: [f64; 2], b: [f64; 2], wall: &Wall| {
            let side =
                |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            side(a, b, wall.from) * side(a, b, wall.to) < 0.0
                && side(wall.from, wall.to, a) * side(wall.from, wall.to, b) < 0.0
        };
        for column in 0..5 {
            for row in 0..5 {
                for side in Side::ALL {
                    let Some(next) = maze.beside([column, row], side) else { continue };
                    let (a, b) = (maze.centre([column, row]), maze.centre(next));
                    let wall = walls.iter().any(|wall| crosses(a, b, wall));
                    assert_ne!(wall, maze.ways([column, row]).contains(&side), "{column} {row} {side:?}");
                }
            }
        }
    }
}

use zsim::geometry::Vector;

/// A box, seen from outside (furniture) or inside (walls): its minimum and maximum corner.
type Corners = (Vector, Vector);

/// A closed room with boxes in it, axis-aligned.
#[derive(Debug, Clone)]
pub struct Room {
    walls: Corners,
    boxes: Vec<Corners>,
}

fn corners(c: [f64; 6]) -> Corners {
    (Vector::new(c[0], c[1], c[2]), Vector::new(c[3], c[4], c[5]))
}

impl Room {
    fn new(walls: [f64; 6], boxes: &[[f64; 6]]) -> Self {
        Self { walls: corners(walls), boxes: boxes.iter().copied().map(corners).collect() }
    }

    /// An empty hall, 8 x 6 x 4 m.
    pub fn bare() -> Self {
        Self::new([-4.0, -3.0, 0.0, 4.0, 3.0, 4.0], &[])
    }

    /// The same hall with furniture.
    pub fn furnished() -> Self {
        let boxes = [
            [-3.9, -2.9, 0.0, -2.9, -1.0, 0.75],
            [3.2, -1.0, 0.0, 3.95, 1.5, 2.0],
            [-1.0, 2.4, 0.0, 1.0, 2.95, 0.9],
            [-0.3, -0.3, 0.0, 0.3, 0.3, 0.8],
            [-3.95, 1.8, 0.0, -3.3, 2.9, 1.9],
            [1.5, -2.95, 0.0, 2.6, -2.5, 1.4],
            [-1.2, -2.95, 1.2, 0.8, -2.8, 2.0],
        ];
        Self::new([-4.0, -3.0, 0.0, 4.0, 3.0, 4.0], &boxes)
    }

    /// A corridor of 2.5 m width around a block, 18 x 11 x 2.7 m, with cupboards, pillars and niches.
    pub fn corridor_loop() -> Self {
        let boxes = [
            [-6.0, -2.5, 0.0, 6.0, 2.5, 2.7],
            [-8.95, -3.0, 0.0, -8.5, -1.0, 2.0],
            [-2.0, 5.1, 0.0, 0.5, 5.45, 1.2],
            [4.0, 5.2, 0.0, 5.0, 5.45, 2.2],
            [8.4, 0.5, 0.0, 8.95, 2.5, 1.0],
            [3.0, -5.45, 0.0, 5.0, -5.05, 1.6],
            [-4.0, -5.45, 0.0, -3.6, -4.9, 2.7],
            [-6.3, -0.5, 0.8, -6.0, 0.5, 1.6],
            [0.0, 2.5, 0.0, 0.6, 2.8, 1.8],
            [1.0, -2.75, 1.0, 2.5, -2.5, 1.9],
        ];
        Self::new([-9.0, -5.5, 0.0, 9.0, 5.5, 2.7], &boxes)
    }

    /// Distance to the first surface along a ray, both in the room.
    pub fn cast(&self, origin: &Vector, direction: &Vector) -> f64 {
        let inverse = direction.map(|x| 1.0 / x);
        let (_, exit) = slab(&self.walls, origin, &inverse);
        self.boxes.iter().fold(exit, |nearest, corners| {
            let (enter, exit) = slab(corners, origin, &inverse);
            if enter > 0.0 && enter < exit { nearest.min(enter) } else { nearest }
        })
    }
}

/// Distances at which a ray enters and leaves a box (Kay and Kajiya 1986).
fn slab((least, greatest): &Corners, origin: &Vector, inverse: &Vector) -> (f64, f64) {
    let (a, b) = ((least - origin).component_mul(inverse), (greatest - origin).component_mul(inverse));
    ((a.inf(&b)).max(), (a.sup(&b)).min())
}

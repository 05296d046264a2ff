//! A picture of the modes.

use crate::dynamics::{ElementSpec, HeadModel, HeadSpec, LinkageSpec, Mode, ModeKind, PartSpec};
use crate::elasticity::split;
use crate::geometry::{Pose, Rotation, Vector};
use crate::report::plot::{Chart, Colour, Figure, Mark, Series};

/// From one mode's picture to the next, m.
const APART_M: f64 = 0.28;

/// How far the picture's head is turned, rad, or moved, in parts of this times a tenth of a metre.
const SHOWN: f64 = 0.35;

/// Each mode as seen from where it is seen best: from the side in its own plane, yaw from above. Grey at rest, coloured
/// deflected to one side.
pub fn mode_figure(spec: &HeadSpec, head: &HeadModel) -> Figure {
    let colours = [Colour::Estimate, Colour::Second, Colour::Third, Colour::Fourth, Colour::Fifth, Colour::Truth];
    // The legend takes the title's place.
    let chart = Chart::new("", "Across, each mode in its own plane; yaw seen from above (m)", "Up (m)").as_map();
    let modes = head.linear_modes().iter().zip(colours).enumerate();
    let chart = modes.fold(chart, |chart, (place, (mode, colour))| {
        let picture = Picture::of(spec, head, mode, place as f64 * APART_M);
        let name = format!("{} {:.2} Hz", kind_name(mode.kind), mode.frequency_hz);
        let rest = Series::line("", Colour::Backdrop, picture.outline(&Pose::identity()));
        let moved = Series::line(&name, colour, picture.outline(&picture.moved)).marked(Mark::Line(1.5));
        chart.with(rest).with(moved)
    });
    Figure::of(vec![chart])
}

/// What a kind of mode is called.
fn kind_name(kind: ModeKind) -> &'static str {
    match kind {
        ModeKind::Rocking => "rocking",
        ModeKind::Sway => "sway",
        ModeKind::Bounce => "bounce",
        ModeKind::Yaw => "yaw",
    }
}

/// An element as it is drawn.
enum Link {
    /// A spring, by its two ends.
    Spring { foot: Pose, head_from_top: Pose },
    /// A straight line: a cord, or from a joint to the head.
    Cord { foot: Vector, top_in_head: Vector },
}

/// What is drawn of a linkage. A float is one of the head's parts already.
fn links(linkage: &LinkageSpec) -> Vec<Link> {
    match linkage {
        LinkageSpec::Spring { base_from_spring, head_from_spring, .. } => {
            vec![Link::Spring { foot: base_from_spring.pose(), head_from_top: head_from_spring.pose() }]
        }
        LinkageSpec::Suspension { elements, .. } => elements.iter().filter_map(link).collect(),
        LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => Vec::new(),
    }
}

fn link(element: &ElementSpec) -> Option<Link> {
    match element {
        ElementSpec::Spring(spring) => {
            Some(Link::Spring { foot: spring.base_from_spring.pose(), head_from_top: spring.head_from_spring.pose() })
        }
        ElementSpec::Cord(cord) => {
            Some(Link::Cord { foot: cord.base_point_m.into(), top_in_head: cord.head_point_m.into() })
        }
        ElementSpec::UniversalJoint(joint) => {
            let foot = joint.base_from_joint.pose().translation.vector;
            Some(Link::Cord { foot, top_in_head: Vector::zeros() })
        }
        ElementSpec::Float(_) => None,
    }
}

/// A head and its linkage, drawn in a plane.
struct Picture<'a> {
    spec: &'a HeadSpec,
    rest: Pose,
    links: Vec<Link>,
    /// The two directions of the paper.
    right: Vector,
    up: Vector,
    from_above: bool,
    offset_m: f64,
    /// The head's displacement in the base, about the base's origin.
    moved: Pose,
}

impl<'a> Picture<'a> {
    fn of(spec: &'a HeadSpec, head: &HeadModel, mode: &Mode, offset_m: f64) -> Self {
        let rest = *head.rest_pose_base_from_head();
        let (shift, turn) = split(&mode.shape);
        let scale = SHOWN / turn.norm().max(10.0 * shift.norm()).max(f64::MIN_POSITIVE);
        let centre = (rest * nalgebra::Point3::from(head.body().centre_of_mass_in_head)).coords;
        let rotation = Rotation::from_scaled_axis(turn * scale);
        let moved = Pose::from_parts((centre + shift * scale - rotation * centre).into(), rotation);
        let from_above = mode.kind == ModeKind::Yaw;
        // The plane in which a bending mode moves: across its axis of turn.
        let across = Vector::new(turn.y, -turn.x, 0.0);
        let right = if from_above || across.norm() < 1e-9 { Vector::x() } else { across.normalize() };
        let up = if from_above { Vector::y() } else { Vector::z() };
        Self { spec, rest, links: links(&spec.linkage), right, up, from_above, offset_m, moved }
    }

    /// The elements and the edges of the head's parts, displaced, in one broken line.
    fn outline(&self, displaced: &Pose) -> Vec<(f64, f64)> {
        let head = displaced * self.rest;
        let mut line = Vec::new();
        for link in &self.links {
            line.push((f64::NAN, f64::NAN));
            match link {
                Link::Spring { .. } if self.from_above => {}
                Link::Spring { foot, head_from_top } => line.extend(self.spring(foot, &(head * head_from_top))),
                Link::Cord { foot, top_in_head } => {
                    let top = head * nalgebra::Point3::from(*top_in_head);
                    line.extend([self.on_paper(foot), self.on_paper(&top.coords)]);
                }
            }
        }
        for part in &self.spec.parts {
            line.push((f64::NAN, f64::NAN));
            line.extend(self.edges(part).map(|corner| self.on_paper(&(head * corner).coords)));
        }
        line
    }

    /// A cubic from the foot to the top that leaves both along their axes.
    fn spring(&self, foot: &Pose, top: &Pose) -> Vec<(f64, f64)> {
        let (p, q) = (foot.translation.vector, top.translation.vector);
        let length = (q - p).norm();
        let (leave, arrive) = (foot.rotation * Vector::z() * length, top.rotation * Vector::z() * length);
        let at = |k: i32| {
            let u = f64::from(k) / 20.0;
            let place = p * ((1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u)) + q * (u * u * (3.0 - 2.0 * u));
            self.on_paper(&(place + leave * (u * (1.0 - u) * (1.0 - u)) + arrive * (u * u * (u - 1.0))))
        };
        (0..=20).map(at).collect()
    }

    /// The outline of a part as seen on the paper, closed: its middle section across the line of sight.
    fn edges(&self, part: &PartSpec) -> impl Iterator<Item = nalgebra::Point3<f64>> {
        let (size, centre) = match part {
            PartSpec::Block { size_m, centre_m, .. } => (Vector::from(*size_m) * 0.5, Vector::from(*centre_m)),
            PartSpec::Body { centre_of_mass_m, .. } => (Vector::repeat(0.005), Vector::from(*centre_of_mass_m)),
        };
        let (right, up) = (self.right, self.up);
        let wide = size.component_mul(&right.abs()).amax().max(1e-3);
        let high = size.component_mul(&up.abs()).amax();
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)]
            .into_iter()
            .map(move |(x, y)| nalgebra::Point3::from(centre + right * (x * wide) + up * (y * high)))
    }

    fn on_paper(&self, place: &Vector) -> (f64, f64) {
        (self.right.dot(place) + self.offset_m, self.up.dot(place))
    }
}

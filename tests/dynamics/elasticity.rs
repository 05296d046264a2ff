//! The spring's force law, compared with Haringx's theory and the elastica.
use approx::assert_relative_eq;
use zsim::elasticity::{Coil, Column, Matrix6, Moduli, Spring, SpringState, Vector6, loaded_stiffness, split, stack};
use zsim::geometry::{Pose, Rotation, Vector, skew};

const STEEL: Moduli = Moduli { youngs_pa: 206e9, shear_pa: 79.3e9 };

fn moved(top: &Pose, d: &Vector6) -> Pose {
    let (shift, turn) = split(d);
    Pose::from_parts((top.translation.vector + shift).into(), Rotation::from_scaled_axis(turn) * top.rotation)
}

fn wrench(spring: &Spring, state: &mut SpringState, top: &Pose) -> Vector6 {
    spring.wrench(state, top).unwrap().total()
}

/// Tangent stiffness: minus the derivative of the wrench by the top's displacement, by central differences.
fn tangent(spring: &Spring, state: &mut SpringState, top: &Pose) -> Matrix6 {
    let columns: Vec<Vector6> = (0..6)
        .map(|k| {
            let d = Vector6::ith(k, 1e-6);
            (wrench(spring, state, &moved(top, &-d)) - wrench(spring, state, &moved(top, &d))) / 2e-6
        })
        .collect();
    Matrix6::from_columns(&columns)
}

/// Equilibrium pose of the top under a force of constant direction, raised in steps.
fn rest_under(spring: &Spring, force: Vector) -> Pose {
    let mut state = spring.state();
    let mut top = Pose::translation(0.0, 0.0, spring.length_m());
    for share in 1..=20 {
        let load = stack(&(force * (share as f64 / 20.0)), &Vector::zeros());
        for _ in 0..50 {
            let unbalanced = wrench(spring, &mut state, &top) + load;
            let step = tangent(spring, &mut state, &top).lu().solve(&unbalanced).unwrap();
            let share = (0.2 / step.norm()).min(1.0);
            top = moved(&top, &(step * share));
            if step.norm() < 1e-10 {
                break;
            }
        }
    }
    top
}

#[test]
fn the_tangent_stiffness_under_load_is_haringxs_for_any_number_of_segments() {
    // Up to 60 % of the buckling load, and in tension.
    let coil = Coil::new(0.040, 0.0025, 15.0, 0.120, STEEL).unwrap();
    for load_n in [0.0, 12.1, -12.1] {
        let column = coil.under_load(load_n).unwrap();
        let expected = loaded_stiffness(&column).unwrap();
        for segments in [1, 2, 4, 8] {
            let spring = Spring::of_column(&column, segments).unwrap();
            let top = Pose::translation(0.0, 0.0, column.length_m);
            let found = tangent(&spring, &mut spring.state(), &top);
            for k in 0..6 {
                assert_relative_eq!(found[(k, k)], expected[(k, k)], max_relative = 1e-5);
            }
            assert_relative_eq!(found[(0, 4)], expected[(0, 4)], max_relative = 1e-5);
            assert_relative_eq!(found[(3, 1)], expected[(3, 1)], max_relative = 1e-5);
        }
    }
}

#[test]
fn a_spring_loaded_above_its_design_load_softens_as_in_haringxs_theory() {
    // Designed for 4 N and loaded with 12.1 N: the force law must follow the actual load, not the design load.
    let coil = Coil::new(0.040, 0.0025, 15.0, 0.120, STEEL).unwrap();
    let expected = loaded_stiffness(&coil.under_load(12.1).unwrap()).unwrap();
    for (segments, within) in [(2, 0.03), (4, 0.03), (8, 0.01)] {
        let spring = Spring::of_column(&coil.under_load(4.0).unwrap(), segments).unwrap();
        let top = rest_under(&spring, Vector::new(0.0, 0.0, -12.1));
        let found = tangent(&spring, &mut spring.state(), &top);
        assert_relative_eq!(found[(0, 0)], expected[(0, 0)], max_relative = within);
        assert_relative_eq!(found[(4, 4)], expected[(4, 4)], max_relative = within);
    }
}

#[test]
fn a_slender_cantilever_follows_the_elastica() {
    // Tip deflection over length under a lateral tip load, P L^2 / E I = 1, 2, 5, 10 (Bisshopp & Drucker 1945). Shear and
    // extension are negligible: P / S is at most 1e-3.
    let rigid = 1e4;
    let column = Column {
        length_m: 1.0,
        bending_nm2: 1.0,
        shear_n: rigid,
        axial_n_per_m: rigid,
        torsion_nm_per_rad: 1.0,
        load_n: 0.0,
    };
    for (load, deflection) in [(1.0, 0.3017), (2.0, 0.4935), (5.0, 0.7138), (10.0, 0.8106)] {
        for (segments, within) in [(2, 0.02), (4, 0.005), (8, 0.002)] {
            let spring = Spring::of_column(&column, segments).unwrap();
            let top = rest_under(&spring, Vector::new(load, 0.0, 0.0));
            assert_relative_eq!(top.translation.x, deflection, max_relative = within);
        }
    }
}

#[test]
fn the_wrench_of_a_segmented_spring_is_the_gradient_of_its_energy() {
    // The gradient of the energy with the inner nodes in equilibrium, at a large rotation about no coordinate axis.
    let spring =
        Spring::of_column(&Coil::new(0.025, 0.003, 12.0, 0.12, STEEL).unwrap().under_load(3.9).unwrap(), 4).unwrap();
    let turn = Rotation::from_scaled_axis(Vector::new(0.5, 1.1, 0.4));
    let top = Pose::from_parts(Vector::new(0.06, -0.03, 0.09).into(), turn);
    let mut state = spring.state();
    let found = wrench(&spring, &mut state, &top);
    for k in 0..6 {
        let d = Vector6::ith(k, 1e-5);
        let ahead = spring.potential_j(&mut state, &moved(&top, &d)).unwrap();
        let behind = spring.potential_j(&mut state, &moved(&top, &-d)).unwrap();
        assert_relative_eq!((behind - ahead) / 2e-5, found[k], max_relative = 1e-5, epsilon = 1e-5);
    }
}

#[test]
fn the_equilibrium_of_inner_nodes_does_not_depend_on_their_start() {
    let spring =
        Spring::of_column(&Coil::new(0.025, 0.003, 12.0, 0.12, STEEL).unwrap().under_load(3.9).unwrap(), 8).unwrap();
    let at = |angle: f64| {
        let place = skew(&Vector::y()) * Vector::z() * (0.06 * angle) + Vector::z() * 0.11;
        Pose::from_parts(place.into(), Rotation::from_scaled_axis(Vector::y() * angle))
    };
    let cold = wrench(&spring, &mut spring.state(), &at(1.2));
    let mut walked = spring.state();
    for k in -300..=300 {
        wrench(&spring, &mut walked, &at(1.2 * f64::from(k) / 300.0));
    }
    assert_relative_eq!(wrench(&spring, &mut walked, &at(1.2)), cold, epsilon = 1e-7);
}

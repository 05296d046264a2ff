use crate::dynamics::heads::{BasePulse, Nodding, ReferenceHead, displacement, shipped, states};
use zsim::dynamics::{DynamicsError, HeadSimulation};
use zsim::geometry::{Kinematics, Pose, Vector};
use zsim::motion::BaseMotion;

#[test]
fn a_rigid_head_moves_with_its_base() {
    let model = shipped("rigid");
    assert!(model.linear_modes().is_empty());
    let base = Nodding { amount_rad: 0.1 };
    for state in states(&model, &base, 1e-3, 1.0) {
        assert_eq!(state.head, base.at(state.t_s).of_frame(model.base_from_head_at_rest()));
    }
    // The rest position of the sprung head, to 1 mm and 0.2 degrees: it leans and turns a little under its load.
    let apart = shipped("handheld").base_from_head_at_rest().inv_mul(model.base_from_head_at_rest());
    assert!(apart.translation.vector.norm() < 1e-3 && apart.rotation.angle() < 3.5e-3);
}

/// A pulse of the base, after which a hand holds the head.
struct Held {
    pulse: BasePulse,
    from_s: f64,
}

impl BaseMotion for Held {
    fn at(&self, t_s: f64) -> Kinematics {
        self.pulse.at(t_s)
    }

    fn hold(&self, t_s: f64) -> f64 {
        ((t_s - self.from_s) / 0.3).clamp(0.0, 1.0)
    }
}

#[test]
fn a_hand_brings_a_swinging_head_to_rest() {
    let model =
        ReferenceHead { more: "hold: (frequency_hz: 6.0, damping_ratio: 0.8),", ..ReferenceHead::default() }.model();
    let pulse = || BasePulse { axis: 0, amount: 0.14, period_s: 0.4 };
    let free = states(&model, &pulse(), 1e-3, 3.0);
    let held = states(&model, &Held { pulse: pulse(), from_s: 1.0 }, 1e-3, 3.0);
    let swing =
        |path: &[zsim::dynamics::HeadState]| path.iter().map(|s| displacement(&model, s).norm()).fold(0.0, f64::max);
    assert!(swing(&free[2_000..]) > 0.2, "swings freely by {}", swing(&free[2_000..]));
    // A damping ratio of 0.8 at 6 Hz leaves exp(-0.8 * 2 pi 6 * 0.7) = 1e-9 of the swing after 0.7 s.
    assert!(swing(&held[2_500..]) < 1e-6, "still swings by {}", swing(&held[2_500..]));
}

#[test]
fn an_end_stop_limits_the_swing() {
    let stop = "end_stop: (angle_deg: 30.0, stiffness_nm_per_rad: 100.0, damping_nm_s_per_rad: 0.02),";
    let model = ReferenceHead { more: stop, ..ReferenceHead::default() }.model();
    let lean = |path: &[zsim::dynamics::HeadState]| {
        let axis = |s: &zsim::dynamics::HeadState| (s.head.world_from_body.rotation * Vector::z()).angle(&Vector::z());
        path.iter().map(axis).fold(0.0, f64::max).to_degrees()
    };
    let free = lean(&states(
        &ReferenceHead::default().model(),
        &BasePulse { axis: 0, amount: 0.14, period_s: 0.4 },
        1e-3,
        2.0,
    ));
    let stopped = lean(&states(&model, &BasePulse { axis: 0, amount: 0.14, period_s: 0.4 }, 1e-3, 2.0));
    assert!(free > 44.0 && (30.0..38.0).contains(&stopped), "{free} free, {stopped} with a stop");
}

#[test]
fn divergence_is_an_error_with_its_time_and_never_nan() {
    let model = ReferenceHead::default().model();
    let pulse = BasePulse { axis: 0, amount: 0.6, period_s: 0.3 };
    let mut last = None;
    for state in HeadSimulation::new(&model, &pulse, 1e-3).unwrap().take(5_000) {
        match &state {
            Ok(state) => {
                let Kinematics { world_from_body: Pose { rotation, translation }, .. } = state.head;
                assert!(rotation.coords.iter().chain(translation.vector.iter()).all(|x| x.is_finite()));
                assert!(last.is_none(), "continues after an error");
            }
            Err(_) => last = Some(state),
        }
    }
    let Some(Err(error @ DynamicsError::Diverged { t_s, .. })) = last else { panic!("did not diverge") };
    assert!(t_s > 0.05 && t_s < 2.0 && error.to_string().contains("end stop"), "{error}");
}

#[test]
fn a_base_pose_with_nan_is_an_error() {
    struct Lost;
    impl BaseMotion for Lost {
        fn at(&self, t_s: f64) -> Kinematics {
            let x = if t_s < 0.01 { 0.0 } else { f64::NAN };
            Kinematics::at_rest(Pose::translation(x, 0.0, 0.0))
        }
    }
    let model = ReferenceHead::default().model();
    let mut simulation = HeadSimulation::new(&model, &Lost, 1e-3).unwrap().skip_while(Result::is_ok);
    let error = simulation.next().unwrap().unwrap_err();
    assert!(error.to_string().contains("0.010 s after the start"), "{error}");
    assert!(simulation.next().is_none());
}

#[test]
fn a_step_too_long_for_the_fastest_mode_is_refused() {
    let model = ReferenceHead::default().model();
    for step_s in [0.1, 0.0, -1.0, f64::NAN] {
        let error = HeadSimulation::new(&model, &Nodding { amount_rad: 0.0 }, step_s).err().unwrap();
        assert!(error.to_string().contains("fastest oscillation"), "{error}");
    }
}

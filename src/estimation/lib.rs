//! Continuous-time SLAM over a sliding window: measurements in, trajectory, covariance and surfaces out.
//!
//! The method is that of Bosse, Zlot and Flick (IEEE Transactions on Robotics 28(5), 2012), with the changes listed
//! below.
//!
//! # Processing of a segment
//!
//! 1. [`Estimator::push`] sorts measurements, smooths the stamps of both sensors, and cuts time into segments of
//!    `step_s`.
//! 2. A new segment is integrated from the IMU, with coning and sculling corrections unless the IMU applies them. Its
//!    beams are projected with the trajectory into voxels of several sizes on two grids. The points of a voxel from one
//!    sweep form a *surfel*.
//! 3. The surfels of the window are transformed into the map frame. They are matched with each other by position and
//!    normal, reciprocally and at different times, and with those of *fixed views* (keyframes).
//! 4. The corrections of the window are solved for. Steps 3 and 4 are repeated until convergence.
//! 5. The oldest segment is removed: its poses are final, and its surfels may become a fixed view.
//! 6. After the open loop, [`register`] closes loops: it matches all observed surfaces at different times.
//! 7. The trajectory converts beams to a point cloud; [`CloudFilter`] removes points that are not on static surfaces.
//! 8. With an IMU on the base that carries the head, [`smooth_base`] estimates the trajectory of the base.
//!
//! # The problem
//!
//! Unknowns are a correction of the trajectory, `R' = exp(dr) R`, `t' = t + dt` (paper eq. 1-2), with `dr` and `dt`
//! uniform cubic B-splines; the biases of gyroscope and accelerometer; the scale errors and misalignments of both; the
//! tilt of gravity in the map; the clock offset and its rate; a range bias; optionally the lidar extrinsics. The cost is
//!
//! ```text
//! sum over IMU intervals  |e_w / sigma_w|^2 + |e_a / sigma_a|^2
//! + sum over matches      rho(zeta n^T (mu_i - mu_j))          rho: Cauchy
//! + prior on the start of the window + prior on biases, gravity, clock and calibration
//! ```
//!
//! # Choices
//!
//! These choices, and the numbers in `default.ron`, have a reason but were not all compared with alternatives.
//!
//! - The trajectory is that of the IMU, in IMU time. The clock offset `l` enters in the lookup of the beam times, `u =
//!   tau + l(tau)`. The paper has the trajectory in lidar time and `l` in the IMU residuals. Here a change of `l` also
//!   shifts the fast motion, which only the IMU measures; otherwise the smooth splines would have to follow it at the
//!   rocking frequency of the head. The IMU residuals need no lever arm either.
//! - The IMU residuals compare velocities, corrected by the exact derivative of the spline, so no second difference of
//!   positions is needed.
//! - A match may link any two times of the window, so the information matrix of the knots may be full. The solver stores
//!   an envelope, which is a band if matches are close in time or only with views.
//! - The start of a window is constrained in value and two derivatives. The information on biases, gravity and clock is
//!   carried over in proportion to the segment that leaves the window.
//! - Range bias, and scale and misalignment of the gyroscope are unknowns, because they caused the largest errors in
//!   tests (in the office and the courtyard the position error fell to about a third). Scale and misalignment of the
//!   accelerometer are observable almost only by gravity, and only if the prior mean is carried over; they help where
//!   surfaces constrain the height weakly.
//! - The lidar extrinsics are optional unknowns. The IMU frame is then that of the gyroscope axes, and the prior on the
//!   start of a window depends on the extrinsics.
//! - A head at rest yields no new surfels. The window then retains the old ones until the lidar has swept as much again,
//!   and the pose is dead reckoning with the IMU (within 3 cm over stops of 2 to 5 s). Matching the lines of a scan at
//!   rest with surfels was tested: it constrains the horizontal position to millimetres, but errors of the normals count
//!   as information on the height and cause errors of decimetres while the carrier climbs.
//! - The direction of gravity is an unknown, instead of the level of the map, so fixed views need no rotation when the
//!   estimate of gravity improves.

mod base;
mod border;
mod clock;
mod cloud;
mod coasting;
mod consider;
mod correlation;
mod dead_reckoning;
mod displacement;
mod error;
mod estimator;
mod event;
mod gaps;
mod inertial;
mod initial;
mod intake;
mod integrity;
mod layout;
mod local_map;
mod localisation;
mod map;
mod matching;
mod nominal;
mod normal_equations;
mod observed;
mod output;
mod registration;
mod residual;
mod scan_geometry;
mod spec;
mod spline;
mod stamps;
mod standstill;
mod strapdown;
mod surfel;
mod timing;
mod unknowns;
mod vectorised;
mod views;
mod window;

pub use base::{BaseEstimate, BaseFix, BaseImu, FixSigmas, smooth_base};
pub use cloud::{CloudFilter, ProjectedReturn, ReturnClass, point_sigma_m};
pub use dead_reckoning::integrate_imu;
pub use error::EstimationError;
pub use estimator::{Estimator, estimate_all};
pub use event::{Event, EventKind, Severity, Status, grouped};
pub use integrity::{Evidence, bound_factors, covariance_blocks, findings, radius_99};
pub use map::{LocalisedPose, locate_map, map_of, merge_maps};
pub use observed::ObservedSurfels;
pub use output::{ALIGNMENT_S, EstimatedPose, MatrixEntry, OpenLoop, TURN_LEVER_M, WindowReport};
pub use registration::{ClosedLoop, LoopReport, RegistrationInput, RegistrationReport, register};
pub use spec::{
    ClockSpec, EstimatorSpec, InertialSpec, MatchingSpec, PlacesSpec, RegistrationSpec, SolveSpec, SurfelSpec,
    ViewSpec, load,
};
pub use stamps::smoothed_stamps;
pub use timing::{PartTime, Timing};

//! The reader that makes sense of it: continuous-time SLAM over a sliding window. Measurements in, estimate out.
//!
//! The method is that of Bosse, Zlot and Flick (IEEE Transactions on Robotics 28(5), 2012), with the changes listed
//! below.
//!
//! # A stretch's way
//!
//! 1. [`Estimator::push`] puts measurements in order, smooths the stamps of both sensors by counting their samples, and
//!    cuts time into stretches of `step_s`.
//! 2. A new stretch is integrated from the IMU (coning, sculling: samples are averages), and its beams, projected by
//!    the trajectory, are gathered in voxels of several sizes on two grids: each cell's points of one passing make a
//!    *surfel*.
//! 3. The window's surfels are placed in the map, matched with each other in six dimensions (position and normal, from
//!    both sides, at different times) and with those of *fixed views*, stretches of the past that stand still.
//! 4. The window's corrections are solved for, and 3 begins again, until nothing moves.
//! 5. The oldest stretch leaves: its poses are final, its surfels may become a fixed view.
//! 6. Behind the open loop, [`register`] lays all that was seen on what was seen of it at other times.
//! 7. Beams become a cloud by the trajectory; [`CloudFilter`] tells which of them are no surface.
//! 8. Where the base was that carries the head, an IMU on it tells beside the head's trajectory: [`smooth_base`].
//!
//! # The problem
//!
//! Unknown are a correction of the trajectory, `R' = exp(dr) R`, `t' = t + dt` (paper eq. 1-2), with `dr` and `dt`
//! uniform cubic B-splines; the biases of gyroscope and accelerometer; the scale and misalignment of both; the tilt of
//! gravity in the map; the clock offset and its rate; an offset of all ranges. Minimised is
//!
//! ```text
//! sum over IMU intervals  |e_w / sigma_w|^2 + |e_a / sigma_a|^2
//! + sum over matches      rho(zeta n^T (mu_i - mu_j))          rho: Cauchy
//! + the beginning of the window held to the window before + what is remembered of biases, gravity and clock
//! ```
//!
//! # Choices
//!
//! Reasoned, and not yet compared with their alternatives; the same holds for the numbers in `default.ron`.
//!
//! - The trajectory is that of the IMU, in the IMU's time; the clock offset `l` enters where a beam's time is looked
//!   up, `u = tau + l(tau)`. The paper keeps the trajectory in lidar time and has `l` in the IMU's terms. Here a change
//!   of `l` moves the fast part of the motion, which the IMU alone knows, along by itself; otherwise the slow splines
//!   would have to follow it at the head's rocking frequency. The lever arm disappears from the IMU's terms too.
//! - The IMU's terms compare velocities, corrected by the spline's exact derivative: no second difference is taken.
//! - A match links any two times of the window, so its knots fill the window's triangle; the solver stores an envelope,
//!   which is a band where matches are near or with views alone.
//! - The beginning of a window is held (value and two derivatives). Of biases, gravity and clock the leaving stretch's
//!   share of the information goes on.
//! - Offset of the ranges, scale and misalignment of the gyroscope are unknowns: in trials they were the greatest
//!   errors (in the office and the courtyard the position's error fell to about a third). Those of the accelerometer
//!   are told by gravity nearly alone, and only with their mean remembered; then they help where surfaces say little of
//!   the height.
//! - Attitude and place of the lidar beside the IMU are unknowns too, when asked: then the poses stand along the
//!   gyroscope's axes, and the beginning of a window is held to where the lidar, as it is found to sit, would have put
//!   it.
//! - While the head is held still no patches are seen: the window keeps those it has until as much has been swept
//!   again, and the IMU carries it (within 3 cm over stops of 2 to 5 s). Matching the lines that a still scan draws
//!   with patches was tried: it holds the level directions to millimetres, but errors of the patches' normals pass for
//!   knowledge of the height, by decimetres where the carrier climbs meanwhile.
//! - Gravity's direction is unknown rather than the map's level: views once frozen need not be turned when it is
//!   learnt.

mod base;
mod border;
mod clock;
mod cloud;
mod consider;
mod error;
mod estimator;
mod gaps;
mod inertial;
mod initial;
mod intake;
mod integrity;
mod localisation;
mod map;
mod matching;
mod nominal;
mod normal_equations;
mod output;
mod registration;
mod residual;
mod scan_geometry;
mod spec;
mod spent;
mod spline;
mod stamps;
mod standstill;
mod strapdown;
mod surfel;
mod survey;
mod views;
mod window;

pub use base::{BaseEstimate, BaseFix, BaseImu, FixSigmas, smooth_base};
use clock::Clock;
pub use cloud::{CloudFilter, Fate, Hit, point_sigma_m};
pub use error::{Discarded, EstimationError, Warning, WarningKind};
pub use estimator::{Estimator, estimate_all};
pub use integrity::{Cause, Evidence, Finding, Status, bound_factors, covariance_blocks, findings, radius_99};
pub use map::{Located, locate_map, map_of, merge_maps};
pub use output::{EstimatedPose, GAUGED_S, OpenLoop, TURN_LEVER_M, WindowReport};
pub use registration::{ClosedLoop, LoopReport, PlacesSpec, RegistrationReport, RegistrationSpec, Travelled, register};
pub use spec::{ClockSpec, EstimatorSpec, InertialSpec, MatchingSpec, SolveSpec, SurfelSpec, ViewSpec, load};
pub use spent::TimeSpent;
pub use stamps::smoothed_stamps;
pub use survey::Survey;

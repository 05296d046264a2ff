//! The sliding window: states, solution and marginalisation.

mod assembly;
mod correspondence;
mod equations;
mod linearised;
mod local_motion;
mod rests;
mod search;
mod solve;
mod uncertainty;

pub(super) use linearised::Linearised;
pub(super) use local_motion::LocalMotion;
pub(super) use solve::WindowSolution;

use super::border::Border;
use super::clock::Clock;
use super::initial::{InitialState, RestReadings, StateBeforeGap};
use super::matching::Matcher;
use super::nominal::Nominal;
use super::observed::ObservedPatch;
use super::output::MatrixEntry;
use super::residual::contradiction::contradiction;
use super::residual::inertial::SHORT_GAP_S;
use super::residual::prior::Start;
use super::spec::EstimatorSpec;
use super::standstill::{Standstill, standstill};
use super::strapdown::{ImuScaleMisalignment, Interval};
use super::surfel::{Detail, FINE, Patch, PlacementState, Surfel, SurfelBuilder, TimedReturn};
use super::timing::{Stopwatch, Timing};
use super::unknowns::Unknowns;
use super::views::{SeenPatch, SeenSegment};
use correspondence::CachedNeighbours;
use equations::Workspace;
use rests::Rests;
use std::collections::VecDeque;
use zsim_base::geometry::{Matrix, Pose, Rotation, Vector};
use zsim_base::measurement::{ImuNoise, LidarCorrection};

/// The head may move for this time before the IMU shows it, s.
const REST_MARGIN_S: f64 = 0.3;
/// The window grows to at most this multiple of the nominal length while the segments contain few surfaces.
const MAX_LENGTH_RATIO: f64 = 3.0;
/// A segment counts as swept if it has this fraction of the largest number of surfels in a segment.
const MIN_SWEPT_RATIO: f64 = 0.25;

/// If the initial velocity has at least this standard deviation, the head may move at constant velocity, m/s.
const MOVING_SIGMA_M_PER_S: f64 = 5.0;
/// A velocity uncertainty above this in one segment, m/s, widens the match gate for [`SHOCK_GATE_S`].
const SHOCK_M_PER_S: f64 = 0.1;
/// Duration of the wide match gate after a shock, s.
const SHOCK_GATE_S: f64 = 2.0;

/// Standard deviations of the pose after relocalisation in a map, before the window is matched with it, rad and m.
const RELOCALISED_SIGMA: [f64; 2] = [0.05, 0.2];

/// A time segment of the window, `step_s` long.
#[derive(Debug)]
struct WindowSegment {
    end_tau_s: f64,
    returns: Vec<TimedReturn>,
    surfels: Vec<Surfel>,
    /// Cached fixed-view neighbours of each surfel.
    cached: Vec<CachedNeighbours>,
}

impl WindowSegment {
    /// Number of surfels without those that only [`Detail::Fine`] has: segments of both kinds are then comparable.
    fn usual_surfels(&self, least_points: f64) -> usize {
        self.surfels.iter().filter(|surfel| surfel.level != FINE && surfel.points >= least_points).count()
    }
}

/// The state of the estimator: trajectory, unknowns, and the surfels of the last few seconds.
#[derive(Debug)]
pub(super) struct Window {
    spec: EstimatorSpec,
    builder: SurfelBuilder,
    /// Surfels are also built of fine voxels until this time, because the geometry is weak, trajectory time, s.
    fine_until_s: f64,
    /// Builds the observed surfels, if they are requested.
    observed_builder: Option<SurfelBuilder>,
    matcher: Matcher,
    pub(super) nominal: Nominal,
    pub(super) unknowns: Unknowns,
    border: Border,
    segments: VecDeque<WindowSegment>,
    start: Start,
    /// Whether this is the first window and starts in motion: tilt and biases are uncertain, and the match gate is wide.
    wide_matching: bool,
    /// Whether the newest segment bridges an IMU gap, or a shock or clipping makes the velocity uncertain.
    bridged_gap: bool,
    /// End of the wide match gate after a shock, trajectory time, s.
    wide_gate_until_s: f64,
    /// The IMU readings at rest, until the head first moves.
    rest: Option<RestReadings>,
    /// End of the initial rest, trajectory time, s.
    rested_until_s: f64,
    /// Later rests.
    rests: Rests,
    /// Whether the speed is known. Constant motion looks like rest to the IMU until surfaces are matched.
    speed_is_known: bool,
    /// Whether the lidar would show a motion of a head that the IMU reports at rest.
    sees_rest: bool,
    workspace: Workspace,
}

impl Window {
    /// A window that starts with the first IMU interval, at `start_s`, IMU time, s.
    pub(super) fn new(
        spec: &EstimatorSpec,
        builder: SurfelBuilder,
        initial_state: &InitialState,
        start_s: f64,
        clock: Clock,
        border: Border,
    ) -> Self {
        Self {
            spec: spec.clone(),
            matcher: Matcher::new(&spec.matching, &spec.surfels),
            builder,
            fine_until_s: f64::NEG_INFINITY,
            observed_builder: None,
            nominal: Nominal::starting(start_s, initial_state.state),
            unknowns: Unknowns::initial(initial_state.biases, clock),
            border,
            segments: VecDeque::new(),
            start: Start::first(start_s, initial_state.velocity_sigma),
            wide_matching: initial_state.rest.is_none(),
            bridged_gap: false,
            wide_gate_until_s: f64::NEG_INFINITY,
            rest: initial_state.rest,
            rested_until_s: f64::NEG_INFINITY,
            rests: Rests::default(),
            speed_is_known: initial_state.velocity_sigma < MOVING_SIGMA_M_PER_S,
            sees_rest: true,
            workspace: Workspace::default(),
        }
    }

    /// The states that initialise the estimate after an IMU gap.
    pub(super) fn state_before_gap(&self) -> StateBeforeGap {
        let state = *self.nominal.end_state();
        let until_s = self.nominal.end_s();
        let displacement = state.position - self.start_pose().translation.vector;
        let mean_velocity = displacement / (until_s - self.start.u_s).max(self.spec.step_s);
        StateBeforeGap { until_s, state, mean_velocity, unknowns: self.unknowns }
    }

    /// Sets the sensor corrections to the values before an IMU gap.
    pub(super) fn resume_from(&mut self, before_gap: &StateBeforeGap) {
        let Unknowns { scale_misalignment, lidar, .. } = before_gap.unknowns;
        self.unknowns = Unknowns { scale_misalignment, lidar, ..self.unknowns };
    }

    /// Rotates the window by the smallest angle that aligns gravity with that before the gap.
    pub(super) fn align_gravity_with(&mut self, before_gap: &StateBeforeGap) {
        let (from, to) = (&self.unknowns.gravity, &before_gap.unknowns.gravity);
        let rotation = Rotation::rotation_between(from, to).unwrap_or_else(Rotation::identity);
        self.nominal.rotate(&rotation, &before_gap.state.position);
        self.unknowns.gravity = before_gap.unknowns.gravity;
    }

    /// All patches of the window, in the map frame.
    pub(super) fn patches(&self) -> Vec<Patch> {
        self.scene().into_iter().map(|placed| placed.patch).collect()
    }

    /// All patches of the window as a segment of `seconds`.
    pub(super) fn seen_segment(&self, seconds: f64) -> SeenSegment {
        let patches = self.scene().iter().map(SeenPatch::from).collect();
        SeenSegment { patches, lidar: self.lidar(), seconds }
    }

    /// Moves the window to the pose from relocalisation; from then on the map constrains it.
    pub(super) fn move_by(&mut self, map_from_here: &Pose) {
        self.nominal.move_by(map_from_here);
        self.unknowns.gravity = map_from_here.rotation * self.unknowns.gravity;
        self.start.sigmas[0] = RELOCALISED_SIGMA;
    }

    /// Whether the window was relocalised and has not advanced since.
    fn is_just_relocalised(&self) -> bool {
        self.start.sigmas[0] == RELOCALISED_SIGMA
    }

    /// The IMU pose at the start of the window.
    pub(super) fn start_pose(&self) -> Pose {
        self.pose_at(self.start.u_s)
    }

    /// The IMU pose at `u_s`, trajectory time, s.
    pub(super) fn pose_at(&self, u_s: f64) -> Pose {
        let motion = self.nominal.at(u_s, &self.unknowns.biases.gyro);
        let rotation = Rotation::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(motion.rotation));
        Pose::from_parts(motion.position.into(), rotation)
    }

    /// The contradiction between the IMU and the trajectory, as a multiple of the IMU noise.
    pub(super) fn imu_contradiction(&self) -> f64 {
        let first = self.nominal.times_s().partition_point(|t| *t < self.start.u_s - 1e-9);
        let states = self.nominal.states().get(first..).unwrap_or_default();
        let intervals = self.nominal.intervals().get(first..).unwrap_or_default();
        contradiction(states, intervals, &self.unknowns.biases, &self.unknowns.gravity)
    }

    /// The speed of the IMU at the end of the window, m/s.
    pub(super) fn speed_m_per_s(&self) -> f64 {
        self.nominal.at(self.nominal.end_s(), &self.unknowns.biases.gyro).velocity.norm()
    }

    /// The velocity of the IMU at the end of the window, IMU frame, m/s.
    fn velocity_in_imu(&self) -> Vector {
        let motion = self.nominal.at(self.nominal.end_s(), &self.unknowns.biases.gyro);
        motion.rotation.transpose() * motion.velocity
    }

    /// Projects onto the directions in which the lidar does not exclude a motion of a head that does not turn, IMU frame.
    ///
    /// At rest a level scan constrains the estimate weakly, and after lost samples the estimated speed may drift.
    fn motion_unobserved_in(&self, returns: &[TimedReturn], intervals: &[(f64, Interval)]) -> Matrix {
        let is_still = |interval: &Interval| interval.bridged || !rests::turns(interval, &self.unknowns.biases);
        let is_in_doubt = self.speed_m_per_s() >= rests::MAX_SPEED_M_PER_S
            && intervals.iter().all(|(_, interval)| is_still(interval));
        match is_in_doubt.then(|| standstill(returns, self.spec.step_s)) {
            Some(Standstill::Rests { unobserved }) => unobserved,
            _ => Matrix::identity(),
        }
    }

    /// Whether the head rests at the end of the window, by the IMU and the estimated speed.
    pub(super) fn is_resting(&self) -> bool {
        let end_s = self.nominal.end_s() - REST_MARGIN_S;
        self.rest.is_some() || self.rests.at(end_s)
    }

    /// Whether the lidar would show a motion of a head that the IMU reports at rest.
    pub(super) fn sees_rest(&self) -> bool {
        self.sees_rest
    }

    /// The same window, in which rest is unobserved by the lidar until surfaces are matched.
    pub(super) fn with_unobservable_rest(self) -> Self {
        Self { sees_rest: false, ..self }
    }

    /// Start of the window, trajectory time, s.
    pub(super) fn start_s(&self) -> f64 {
        self.start.u_s
    }

    /// The same window, which also builds the observed surfels with `builder`.
    pub(super) fn with_observed_builder(self, builder: SurfelBuilder) -> Self {
        Self { observed_builder: Some(builder), ..self }
    }

    pub(super) fn matcher(&self) -> &Matcher {
        &self.matcher
    }

    /// Appends a segment: integrates the intervals and builds surfels of the returns. Returns the run time.
    pub(super) fn extend(
        &mut self,
        intervals: &[(f64, Interval)],
        returns: Vec<TimedReturn>,
        end_tau_s: f64,
    ) -> Timing {
        let mut watch = Stopwatch::start();
        let unobserved = self.motion_unobserved_in(&returns, intervals);
        for (_, interval) in intervals {
            let Unknowns { biases, gravity, scale_misalignment, .. } = &self.unknowns;
            self.nominal.extend(interval.corrected_by(scale_misalignment), biases, gravity);
            self.rest = self.rest.filter(|rest| rest.agrees_with(interval));
            if self.speed_is_known {
                let speed_m_per_s = (unobserved * self.velocity_in_imu()).norm();
                self.rests.take(interval, &self.unknowns.biases, self.nominal.end_s(), speed_m_per_s);
            }
            if self.rest.is_some() {
                self.rested_until_s = self.nominal.end_s() - REST_MARGIN_S;
            }
        }
        let bridged = intervals.iter().filter(|(_, interval)| interval.bridged);
        let velocity_sigma =
            intervals.iter().map(|(_, interval)| (interval.accel_sigma * interval.h).powi(2)).sum::<f64>().sqrt();
        if velocity_sigma > SHOCK_M_PER_S {
            self.wide_gate_until_s = self.nominal.end_s() + SHOCK_GATE_S;
        }
        self.bridged_gap = bridged.map(|(_, interval)| interval.h).sum::<f64>() > SHORT_GAP_S
            || self.nominal.end_s() < self.wide_gate_until_s;
        let integration_s = watch.lap_s();
        let surfels = self.builder.build(&returns, &self.nominal, &self.unknowns, self.detail());
        let cached = vec![CachedNeighbours::default(); surfels.len()];
        self.segments.push_back(WindowSegment { end_tau_s, returns, surfels, cached });
        let surfels_s = watch.lap_s();
        // Reference time of the clock: the middle of the window, where offset and rate are least correlated.
        let length_s = self.spec.step_s * self.segments.len() as f64;
        let middle_s = end_tau_s - 0.5 * length_s;
        self.border.shift_clock_reference(middle_s - self.unknowns.clock.at_s);
        self.unknowns.clock = self.unknowns.clock.with_reference_at(middle_s);
        Timing { integration_s, surfels_s, ..Timing::default() }
    }

    /// The resolutions of new surfels.
    fn detail(&self) -> Detail {
        if self.nominal.end_s() < self.fine_until_s { Detail::Fine } else { Detail::Usual }
    }

    /// Rebuilds the surfels of the newest segment with the current trajectory.
    pub(super) fn rebuild_newest_surfels(&mut self) {
        let detail = self.detail();
        if let Some(newest) = self.segments.back_mut() {
            newest.surfels = self.builder.build(&newest.returns, &self.nominal, &self.unknowns, detail);
            newest.cached = vec![CachedNeighbours::default(); newest.surfels.len()];
            if self.observed_builder.is_none() {
                newest.returns = Vec::new();
            }
        }
    }

    /// Whether the oldest segment can be removed.
    ///
    /// The rest of the window must contain `window_s` of swept segments, or the oldest segment must have few surfaces.
    /// A head at rest measures only lines and needs the older patches.
    pub(super) fn is_full(&self) -> bool {
        let least_points = self.spec.surfels.min_points as f64;
        let richest = self.segments.iter().map(|segment| segment.usual_surfels(least_points)).max().unwrap_or(0);
        let enough = (richest as f64 * MIN_SWEPT_RATIO) as usize;
        let is_swept = |segment: &WindowSegment| segment.usual_surfels(least_points) >= enough;
        let swept = self.segments.iter().filter(|segment| is_swept(segment)).count();
        let windows = |segments: usize| segments as f64 * self.spec.step_s / self.spec.window_s + 1e-9;
        let all = windows(self.segments.len());
        windows(swept) > 1.0 || all > MAX_LENGTH_RATIO || (all > 1.0 && !self.segments.front().is_some_and(is_swept))
    }

    /// Start of the window after removal of the oldest segment, trajectory time, s.
    pub(super) fn next_start_s(&self) -> Option<f64> {
        // After a gap the IMU intervals may end before the segment does.
        let end_s = self.nominal.end_s();
        Some(self.unknowns.clock.trajectory_s(self.segments.front()?.end_tau_s).min(end_s).max(self.start.u_s))
    }

    /// The observed surfels of the oldest segment in the map frame.
    pub(super) fn observed_in_oldest(&self) -> Vec<ObservedPatch> {
        self.segments.front().map_or_else(Vec::new, |oldest| self.observed(oldest))
    }

    /// The observed surfels of all segments of the window, as [`Self::observed_in_oldest`].
    pub(super) fn observed_in_all(&self) -> Vec<ObservedPatch> {
        self.segments.iter().flat_map(|segment| self.observed(segment)).collect()
    }

    /// End of the oldest segment, lidar time, s.
    pub(super) fn oldest_end_s(&self) -> f64 {
        self.segments.front().map_or(f64::NEG_INFINITY, |oldest| oldest.end_tau_s)
    }

    /// End of the newest segment, lidar time, s.
    pub(super) fn end_s(&self) -> f64 {
        self.segments.back().map_or(f64::NEG_INFINITY, |newest| newest.end_tau_s)
    }

    fn observed(&self, segment: &WindowSegment) -> Vec<ObservedPatch> {
        let Some(builder) = &self.observed_builder else { return Vec::new() };
        let surfels = builder.build(&segment.returns, &self.nominal, &self.unknowns, Detail::Usual);
        let placing = self.placing();
        let observed = |surfel: &Surfel| {
            let patch = surfel.place(&placing).patch;
            ObservedPatch { tau_s: surfel.tau_s, patch, weakness: surfel.weakness }
        };
        surfels.iter().map(observed).collect()
    }

    /// Removes the oldest segment, whose states become final; returns that segment in the map frame.
    pub(super) fn remove_oldest(&mut self, linearised: Option<&Linearised>) -> Option<SeenSegment> {
        let start_s = self.next_start_s()?;
        let oldest = self.segments.pop_front()?;
        let patches = oldest.surfels.iter().map(|surfel| SeenPatch::from(&surfel.place(&self.placing()))).collect();
        let by_lidar = linearised.and_then(|at| self.regression_on_lidar(start_s, at));
        self.start = Start { by_lidar, ..Start::continuing(start_s) };
        self.rests.forget_before(start_s);
        self.wide_matching = false;
        let fraction = 1.0 / (self.segments.len() + 1) as f64;
        self.border.carry_over(fraction, self.spec.step_s);
        Some(SeenSegment { patches, lidar: self.lidar(), seconds: self.spec.step_s })
    }

    /// The estimated scale error or misalignment of the IMU that is the largest relative to the `model` of the IMU.
    pub(super) fn imu_matrix(&self, model: &ImuNoise) -> MatrixEntry {
        let sigmas = ImuScaleMisalignment::sigmas_of(model);
        let all = self.unknowns.scale_misalignment.entries().zip(sigmas.entries());
        let entries = all.map(|(estimated, model_sigma)| MatrixEntry { value: estimated.abs(), model_sigma });
        entries.max_by(|a, b| a.over_model().total_cmp(&b.over_model())).unwrap_or_default()
    }

    /// The estimated corrections of the lidar calibration.
    pub(super) fn lidar(&self) -> LidarCorrection {
        self.unknowns.lidar
    }

    /// The lidar correction in the axes of the IMU calibration.
    ///
    /// If the extrinsics are estimated, the axes are midway between the gyroscope axes, which the estimated attitude
    /// refers to, and the accelerometer axes; both are equally accurate.
    pub(super) fn calibrated_lidar(&self) -> LidarCorrection {
        let lidar = self.unknowns.lidar;
        if !self.spec.extrinsics.estimated {
            return lidar;
        }
        let imu_from_gyro = Rotation::from_scaled_axis(self.unknowns.scale_misalignment.accel_against_gyro() * 0.5);
        let position = self.builder.laser_in_imu + lidar.translation;
        let translation = lidar.translation + imu_from_gyro * position - position;
        LidarCorrection { rotation: imu_from_gyro * lidar.rotation, translation, ..lidar }
    }

    /// The current states with which surfels are placed in the map.
    fn placing(&self) -> PlacementState<'_> {
        PlacementState {
            nominal: &self.nominal,
            unknowns: &self.unknowns,
            laser_in_imu: &self.builder.laser_in_imu,
            knot_spacing_s: self.spec.knot_spacing_s,
        }
    }
}

//! Recordings: measurements and ground truth.

use crate::background;
use crate::calibration::Calibration;
use crate::failure::Failure;
use crate::trajectory::Trajectory;
use crate::window::Window;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use tempfile::TempDir;
use zsim::measurement::Measurement;
use zsim::recording::{Reader, TopicPreference};
use zsim::run::{CalibrationSpec, recording_calibration};
use zsim::time::{Span, Stamp};

/// A recording in a file.
#[pyclass(frozen, module = "zsim")]
pub struct Recording {
    path: PathBuf,
    /// The folder of a recording that is deleted with this object.
    _folder: Option<TempDir>,
}

impl Recording {
    /// The recording at `path`; `folder` is deleted with it.
    ///
    /// # Errors
    /// When the file is not a recording.
    pub fn of(path: PathBuf, folder: Option<TempDir>) -> Result<Self, Failure> {
        Reader::open(&path)?;
        Ok(Self { path, _folder: folder })
    }
}

#[pymethods]
impl Recording {
    #[new]
    fn new(path: PathBuf) -> Result<Self, Failure> {
        Self::of(path, None)
    }

    /// The file or folder.
    #[getter]
    fn path(&self) -> &Path {
        &self.path
    }

    /// The true trajectory of the head; `None` for a recording without ground truth.
    fn read_truth(&self, py: Python<'_>) -> Result<Option<Trajectory>, Failure> {
        let path = self.path.clone();
        let truth = background::run(py, None, move |_| Ok(Reader::open(&path)?.truth_trajectory()?))?;
        Ok((!truth.is_empty()).then_some(Trajectory(truth)))
    }

    /// All measurements.
    fn read_all(&self, py: Python<'_>) -> Result<Window, Failure> {
        let windows = Windows::start(self.path.clone(), None);
        let mut all = Window::default();
        while let Some(window) = windows.next(py)? {
            all.0.extend(window.0);
        }
        Ok(all)
    }

    /// The measurements in windows of this many seconds.
    fn windows(&self, seconds: f64) -> Result<Windows, Failure> {
        if !(seconds.is_finite() && seconds >= 1e-3) {
            return Err(Failure::input(format!("windows({seconds}): a window has at least 0.001 s")));
        }
        Ok(Windows::start(self.path.clone(), Some(Span::from_seconds(seconds))))
    }

    /// The calibration of the sensors: from the file, else from the recording, else that of unknown sensors.
    #[pyo3(signature = (file=None))]
    fn calibration(&self, file: Option<PathBuf>) -> Result<Calibration, Failure> {
        let given = file.map_or_else(|| Ok(CalibrationSpec::default()), |file| CalibrationSpec::read(&file))?;
        let reader = Reader::open(&self.path)?;
        let selection = reader.select(&TopicPreference::default())?;
        Ok(Calibration(recording_calibration(&reader, &selection, &given)?.calibration))
    }

    fn __repr__(&self) -> String {
        format!("<zsim.Recording: {}>", self.path.display())
    }
}

/// What a thread that reads a recording sends.
enum Item {
    Window(Window),
    /// The data that could not be read.
    Loss(String),
    Failed(Failure),
}

/// Iterator over the windows of a recording; a thread reads one window ahead.
#[pyclass(frozen, module = "zsim")]
pub struct Windows(Mutex<Receiver<Item>>);

impl Windows {
    fn start(path: PathBuf, length: Option<Span>) -> Self {
        let (sender, receiver) = sync_channel(1);
        thread::spawn(move || {
            if let Err(failure) = send_windows(&path, length, &sender) {
                // Without a receiver, the iteration was abandoned.
                let _ = sender.send(Item::Failed(failure));
            }
        });
        Self(Mutex::new(receiver))
    }

    fn next(&self, py: Python<'_>) -> PyResult<Option<Window>> {
        loop {
            match background::next(py, &self.0)? {
                None => return Ok(None),
                Some(Item::Window(window)) => return Ok(Some(window)),
                Some(Item::Failed(failure)) => return Err(failure.into()),
                Some(Item::Loss(text)) => {
                    // A message of the library has no NUL.
                    let text = CString::new(text).unwrap_or_default();
                    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 2)?;
                }
            }
        }
    }
}

#[pymethods]
impl Windows {
    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Window>> {
        self.next(py)
    }
}

/// Reads the measurements and sends them in windows, until the receiver is dropped.
fn send_windows(path: &Path, length: Option<Span>, sender: &SyncSender<Item>) -> Result<(), Failure> {
    let reader = Reader::open(path)?;
    let selection = reader.select(&TopicPreference::default())?;
    let mut measurements = reader.measurements(&selection);
    let mut window = Window::default();
    let mut end: Option<Stamp> = None;
    for measurement in measurements.by_ref() {
        let measurement = measurement?;
        let stamp = stamp_of(&measurement);
        if let Some(length) = length {
            let mut next = *end.get_or_insert(stamp + length);
            if stamp >= next {
                while stamp >= next {
                    next += length;
                }
                end = Some(next);
                if sender.send(Item::Window(std::mem::take(&mut window))).is_err() {
                    return Ok(());
                }
            }
        }
        window.0.push(measurement);
    }
    let loss = measurements.loss();
    if !loss.is_none() {
        let text = format!("{}: {}", path.display(), loss.sentences().join(" "));
        // Without a receiver, the iteration was abandoned.
        let _ = sender.send(Item::Loss(text));
    }
    let _ = sender.send(Item::Window(window));
    Ok(())
}

fn stamp_of(measurement: &Measurement) -> Stamp {
    match measurement {
        Measurement::Imu(sample) => sample.stamp,
        Measurement::Lidar(scan) => scan.stamp,
    }
}

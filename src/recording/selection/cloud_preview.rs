//! First clouds of a lidar, from which the encoding of the points' times is detected.

use super::candidates::LidarKind;
use super::preview::PREVIEW_MESSAGES;
use crate::message::point_times::{CloudTimes, PointTimes, RawCloud, TimeUnit};
use crate::message::{livox, points};
use crate::{Reader, RecordingError};

/// Maximum number of messages that are read to find clouds with returns.
const MAX_MESSAGES: usize = 1000;

/// What the first clouds of a lidar show.
#[derive(Debug, Default)]
pub struct CloudPreview {
    /// How to convert the points' times; `None` if no cloud has returns.
    pub times: Option<PointTimes>,
    /// Unit of times after the stamp, if it is not the usual one.
    pub unusual_unit: Option<TimeUnit>,
    /// Whether the points have a time field.
    pub has_time_field: bool,
    /// Fields of the points with their types, for messages.
    pub fields: String,
    /// Length of a row that contradicts the data, bytes.
    pub wrong_row_step: Option<usize>,
}

impl Reader {
    /// Reads the first clouds of a lidar that have returns.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn preview_clouds(
        &self,
        topic: &str,
        kind: LidarKind,
        no_return_range_m: Option<f32>,
    ) -> Result<CloudPreview, RecordingError> {
        let mut preview = CloudPreview::default();
        if !matches!(kind, LidarKind::Points | LidarKind::Livox) {
            return Ok(preview);
        }
        let ids = self.ids_of(topic);
        let mut messages = self.messages_in_blocks_of(&ids);
        let (mut clouds, mut read, mut with_returns) = (Vec::new(), 0, 0);
        while with_returns < PREVIEW_MESSAGES && read < MAX_MESSAGES {
            let Some(message) = messages.next()? else { break };
            if !ids.contains(&message.channel) {
                continue;
            }
            read += 1;
            let cloud = match kind {
                LidarKind::Points => points::decode(message.data, None, no_return_range_m),
                _ => livox::decode(message.data, no_return_range_m),
            };
            let Some(cloud) = cloud.ok().filter(|cloud: &RawCloud| !cloud.returns.is_empty()) else { continue };
            if with_returns == 0 && kind == LidarKind::Points {
                preview.fields = points::fields(message.data).unwrap_or_default();
                preview.wrong_row_step = points::wrong_row_step(message.data).ok().flatten();
            }
            with_returns += 1;
            clouds.extend(CloudTimes::of(&cloud));
        }
        preview.has_time_field = !clouds.is_empty();
        (preview.times, preview.unusual_unit) = match PointTimes::detect(&clouds) {
            Some((times, unit)) => (Some(times), unit),
            None => ((with_returns > 0).then_some(PointTimes::AtStamp), None),
        };
        Ok(preview)
    }
}

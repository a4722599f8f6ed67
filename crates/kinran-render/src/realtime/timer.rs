//! How long each pass of a frame takes, by the device's own clock.

use std::cell::RefCell;
use std::time::Duration;

use super::device::{Gpu, read_back};
use crate::Error;

/// More passes than a frame has.
const PASSES: u32 = 8;

/// A pass and how long it took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PassTime {
    /// `shadow`, `fill` (of the G-buffer), `light` (deferred), `forward` (with the sky) or `accumulate`.
    pub pass: &'static str,
    /// From its begin to its end.
    pub time: Duration,
}

/// Timestamps of one frame.
pub(super) struct Timer {
    queries: wgpu::QuerySet,
    passes: RefCell<Vec<&'static str>>,
}

impl Timer {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, Error> {
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Err(Error::Gpu("the device has no clock for passes; time whole frames".into()));
        }
        let queries = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::Timestamp,
            count: 2 * PASSES,
        });
        Ok(Self { queries, passes: RefCell::default() })
    }

    /// The timestamps of the next pass.
    pub(super) fn pass(&self, name: &'static str) -> wgpu::RenderPassTimestampWrites<'_> {
        let mut passes = self.passes.borrow_mut();
        let begin = 2 * passes.len() as u32;
        passes.push(name);
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(begin),
            end_of_pass_write_index: Some(begin + 1),
        }
    }

    /// Waits for the frame.
    pub(super) fn read(&self, gpu: &Gpu) -> Result<Vec<PassTime>, Error> {
        let passes = self.passes.borrow();
        let count = 2 * passes.len() as u32;
        let buffer = |usage| {
            let size = u64::from(2 * PASSES) * 8;
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let resolved = buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC);
        let readable = buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.resolve_query_set(&self.queries, 0..count, &resolved, 0);
        encoder.copy_buffer_to_buffer(&resolved, 0, &readable, 0, u64::from(2 * PASSES) * 8);
        gpu.queue.submit([encoder.finish()]);

        let bytes = read_back(gpu, &readable)?;
        let ticks: Vec<u64> = (bytes.chunks_exact(8))
            .map(|b| u64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]))
            .collect();
        let nanoseconds = f64::from(gpu.queue.get_timestamp_period());
        let time = |(&pass, ticks): (&&'static str, &[u64])| PassTime {
            pass,
            time: Duration::from_nanos((ticks[1].saturating_sub(ticks[0]) as f64 * nanoseconds) as u64),
        };
        Ok(passes.iter().zip(ticks.chunks_exact(2)).map(time).collect())
    }
}

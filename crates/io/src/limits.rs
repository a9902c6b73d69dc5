//! How much of a file is believed: bounds that hold before memory is reserved for what a header claims.

/// Bytes of one file, and of what it unpacks to: about 40 hours of 12 channels at 1 kHz in binary.
pub(crate) const MAX_BYTES: u64 = 1 << 34;

/// Channels of one file. A recording of a limb has tens; EMG arrays and motion capture have hundreds.
pub(crate) const MAX_CHANNELS: usize = 4096;

/// Samples in a resampled recording per sample in the file, so that two stamps far apart do not fill the memory.
pub(crate) const MAX_RESAMPLE_GROWTH: f64 = 16.0;

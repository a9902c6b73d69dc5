//! Files of laboratories: several trials, several clocks, and frequency responses.

use ndof_io::{ReadOptions, Resample, encode_response, read_response_bytes, read_trials_bytes};

/// Reads the trials of a file; what can be read has numbers where it says so.
pub fn trials(file: &str, data: &[u8]) {
    let repair = ReadOptions { sample_rate_hz: Some(200.0), allow_nan: true, any_timing: true, resample: Some(Resample::Auto), ..ReadOptions::default() };
    for options in [ReadOptions::default(), repair] {
        for read in read_trials_bytes(data, file, &options).unwrap_or_default() {
            assert!(read.recording.sample_rate_hz().is_finite() && read.recording.sample_rate_hz() > 0.0);
            assert!(!read.recording.channels().is_empty());
        }
    }
}

/// Reads a frequency response; what can be read can be written, and comes back.
pub fn response(data: &[u8]) {
    for file in ["fuzz.csv", "fuzz.s2p"] {
        let Ok(response) = read_response_bytes(data, file) else { continue };
        response.check().expect("what is read has one size");
        if let Ok((bytes, _)) = encode_response(&response, "again.npz") {
            let again = read_response_bytes(&bytes, "again.npz").expect("our own file");
            assert_eq!((again.outputs, again.inputs, again.frequency_hz), (response.outputs, response.inputs, response.frequency_hz));
        }
    }
}
